"""Docstrings as this house writes them, told to the parser: sessions (`>>>`), names without a type."""

import re
import textwrap

import griffe

# a block of lines from one that begins with a prompt to the next empty one
SESSION = re.compile(r"^(?P<indent> *)>>> .*(?:\n(?=.*\S).*)*", re.MULTILINE)
# a section of names with what they mean, and a name in it; the types are in the signature
NAMES = re.compile(r"^(?:Parameters|Attributes)\n-+\n(?:.+\n?|\n(?=    ))+", re.MULTILINE)
NAME = re.compile(r"^(?P<names>[*\w][\w, *]*) : (?P<meaning>.+)$", re.MULTILINE)


class HouseDocstrings(griffe.Extension):
    """Rewrites every docstring before it is parsed."""

    def on_instance(self, *, obj, **_):
        """Look at every docstring once."""
        if obj.docstring is None:
            return
        text = NAMES.sub(lambda section: NAME.sub(meant, section[0]), obj.docstring.value)
        if "Examples\n---" not in text:
            text = SESSION.sub(fenced, text)
        obj.docstring.value = text


def meant(entry):
    """`name : what it means` with the meaning where the parser looks for it, not where it expects a type."""
    return f"{entry['names']}\n    {entry['meaning']}"


def fenced(session):
    """One session between fences."""
    return textwrap.indent(f"```pycon\n{textwrap.dedent(session[0])}\n```", session["indent"])
