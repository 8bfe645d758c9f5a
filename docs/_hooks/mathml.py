"""Formulas between dollars become MathML while the site is built: a browser draws them by itself."""

import html
import re

from latex2mathml.converter import convert

# what the extension `arithmatex` makes of $…$ and $$…$$ in its generic form
FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)
# a command that the converter does not know comes out as it went in
UNKNOWN = re.compile(r">(\\[a-zA-Z]+)<")


def on_page_content(content, page, **_):
    """Replace every formula of a page."""

    def drawn(found):
        latex = html.unescape(found["latex"]).strip()
        where = f"{page.file.src_uri}: no MathML for the formula {latex!r}"
        try:
            drawing = convert(latex, display="block" if found["tag"] == "div" else "inline")
        except Exception as fault:  # the converter raises what it pleases; the page has to be named
            raise ValueError(f"{where}: {fault!r}") from fault
        if unknown := UNKNOWN.findall(drawing):
            raise ValueError(f"{where}: the converter does not know {', '.join(unknown)}")
        return drawing

    return FORMULA.sub(drawn, content)
