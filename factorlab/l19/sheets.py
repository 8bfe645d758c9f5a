"""The course's sheets: Markdown that a student reads, and a script that checks what it says.

sheet = read_sheet("examples/l19/fiches/s1_definitions.md")
found = verified(sheet, {"Bruit": noise, "Biais": bias})
print(as_text(sheet, found))

A sheet has one title (`# `), an introduction, and entries (`## `).  Every entry links to the example that
shows it, and has a check of the same name: a function that asserts what the entry says and returns in a
few words what it found.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from textwrap import indent

from sequential.errors import DataError, FileFormatError

__all__ = ["Entry", "Sheet", "as_text", "in_plain_text", "read_sheet", "verified"]

LINK = re.compile(r"\[([^\]]+)\]\(([^)\s]+)\)")
FENCED = re.compile(r"^```\w*\n(.*?)\n```$", re.MULTILINE | re.DOTALL)
WEB = ("http://", "https://", "#")


@dataclass(frozen=True)
class Entry:
    """One entry of a sheet.

    Attributes
    ----------
    title : without its mark
    text : Markdown below the title
    links : targets of its links to files, in reading order
    """

    title: str
    text: str
    links: tuple[str, ...]


@dataclass(frozen=True)
class Sheet:
    """A sheet of the course.

    Attributes
    ----------
    path : of its file
    title : without its mark
    introduction : Markdown between the title and the first entry
    entries : in reading order
    """

    path: Path
    title: str
    introduction: str
    entries: tuple[Entry, ...]

    @property
    def titles(self) -> tuple[str, ...]:
        """Of the entries."""
        return tuple(entry.title for entry in self.entries)


def read_sheet(path: Path | str) -> Sheet:
    """Read a sheet, and make sure that every entry leads to a file that is there.

    Raises
    ------
    FileFormatError
        where the title or the entries are missing, two entries have one name, an entry has no link, or a
        link leads nowhere.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read as a sheet ({error.strerror})") from None
    head, *parts = re.split(r"^## ", text, flags=re.MULTILINE)
    title, _, introduction = head.strip().partition("\n")
    if not title.startswith("# ") or not parts:
        raise FileFormatError(f"{path}: a sheet begins with a line '# title' and has entries '## title'")
    entries = tuple(_entry(path, part) for part in parts)
    names = [entry.title for entry in entries]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise FileFormatError(f"{path}: two entries are called {twice!r}; give each a name of its own")
    _links(path, "the introduction", introduction)
    return Sheet(path, title[2:].strip(), introduction.strip(), entries)


def verified(sheet: Sheet, checks: Mapping[str, Callable[[], str]]) -> dict[str, str]:
    """Run every entry's check: what it found, by the entry's title, in reading order.

    Raises
    ------
    DataError
        where an entry has no check, or a check no entry.
    AssertionError
        from a check, where the sheet says what is not so.
    """
    if unchecked := [title for title in sheet.titles if title not in checks]:
        raise DataError(f"{sheet.path.name}: nothing checks the entry {unchecked[0]!r}")
    if stray := [name for name in checks if name not in sheet.titles]:
        near = get_close_matches(stray[0], sheet.titles, n=1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        raise DataError(f"{sheet.path.name} has no entry {stray[0]!r} to check{meant}")
    return {title: checks[title]() for title in sheet.titles}


def as_text(sheet: Sheet, found: Mapping[str, str]) -> str:
    """The whole sheet as a terminal shows it, under each entry what its check found."""
    entries = [f"{one.title}\n{in_plain_text(one.text)}\n  → {found[one.title]}" for one in sheet.entries]
    return "\n\n".join([sheet.title, in_plain_text(sheet.introduction), *entries])


def in_plain_text(markdown: str) -> str:
    """Markdown as a terminal shows it: no marks, code set in, links by their words and their file."""
    text = LINK.sub(lambda m: m[1] if m[1] == Path(m[2]).name else f"{m[1]} ({Path(m[2]).name})", markdown)
    text = FENCED.sub(lambda m: indent(m[1], "    "), text)
    text = re.sub(r"\*\*(.+?)\*\*|(?<!\w)\*([^*\n]+)\*(?!\w)", lambda m: m[1] or m[2], text)
    return text.replace("`", "").strip("\n").rstrip()


def _entry(path: Path, part: str) -> Entry:
    title, _, text = part.partition("\n")
    links = _links(path, f"the entry {title.strip()!r}", text)
    if not links:
        raise FileFormatError(f"{path}: the entry {title.strip()!r} links to no example; each needs one")
    return Entry(title.strip(), text.strip(), links)


def _links(path: Path, where: str, text: str) -> tuple[str, ...]:
    """Targets of the links to files, each of which must be there."""
    links = tuple(target for _, target in LINK.findall(text) if not target.startswith(WEB))
    if lost := [link for link in links if not (path.parent / link.partition("#")[0]).exists()]:
        raise FileFormatError(f"{path}: {where} links to {lost[0]}, and no such file exists")
    return links
