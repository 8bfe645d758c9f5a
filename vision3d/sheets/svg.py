"""A sheet as SVG, in millimetres."""

from __future__ import annotations

from xml.sax.saxutils import escape

from vision3d.sheets.page import Disc, Page, Rect

__all__ = ["svg_of"]


def svg_of(page: Page) -> str:
    """Write a sheet as SVG whose units are millimetres, true to size when printed without scaling."""
    size = f'width="{_n(page.width)}mm" height="{_n(page.height)}mm"'
    box = f'viewBox="0 0 {_n(page.width)} {_n(page.height)}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} {box}>',
        f"<title>{escape(page.title)}</title>",
        f'<rect width="{_n(page.width)}" height="{_n(page.height)}" fill="white"/>',
        f'<path fill="black" d="{"".join(_path(shape) for shape in page.black)}"/>',
    ]
    for line in page.lines:
        level = round(255 * line.grey)
        ends = f'x1="{_n(line.x1)}" y1="{_n(line.y1)}" x2="{_n(line.x2)}" y2="{_n(line.y2)}"'
        parts.append(f'<line {ends} stroke="rgb({level},{level},{level})" stroke-width="{_n(line.width)}"/>')
    for text in page.texts:
        anchor = ' text-anchor="middle"' if text.middle else ""
        place = f'x="{_n(text.x)}" y="{_n(text.y)}" font-size="{_n(text.size)}"'
        face = 'font-family="Helvetica, Arial, sans-serif"'
        parts.append(f"<text {place} {face}{anchor}>{escape(text.words)}</text>")
    return "\n".join([*parts, "</svg>", ""])


def _n(value: float) -> str:
    """A number to a ten-thousandth of a millimetre."""
    return f"{value:.4f}".rstrip("0").rstrip(".")


def _path(shape: Rect | Disc) -> str:
    if isinstance(shape, Rect):
        return f"M{_n(shape.x)} {_n(shape.y)}h{_n(shape.width)}v{_n(shape.height)}h{_n(-shape.width)}z"
    r = _n(shape.radius)
    turn = f"a{r} {r} 0 1 0 "
    across = _n(2.0 * shape.radius)
    return f"M{_n(shape.x - shape.radius)} {_n(shape.y)}{turn}{across} 0{turn}-{across} 0z"
