"""A document as a terminal shows it: lead, verdicts and tables, line by line."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap

from factorlab.compare.text import WIDTH
from factorlab.report.document import Document, Table, Verdict
from factorlab.report.words import WORDS, Language, interval, number
from factorlab.typography import bound

__all__ = ["document_lines"]


def document_lines(document: Document) -> Iterable[str]:
    """Title and lead, tables, verdicts last, where the eye is when a terminal has stopped scrolling."""
    yield document.title
    if document.lead:
        yield from _wrapped(document.lead)
    yield ""
    for section in document.sections:
        if section.table is not None and not section.page_only:
            yield f"{section.table.caption or section.heading}:"
            yield from table_lines(section.table, document.lang)
            yield ""
    for one in document.verdicts:
        yield from _verdict(one, document.lang)
    if document.conclusion:
        yield ""
        yield from _wrapped(document.conclusion)


def _wrapped(text: str, indents: tuple[str, str] = ("", "")) -> Iterable[str]:
    """Lines of words, none of which begins with a « : » or a « ? » of French."""
    first, rest = indents
    for line in wrap(bound(text), WIDTH, initial_indent=first, subsequent_indent=rest):
        yield line.replace("\u00a0", " ")


def _verdict(one: Verdict, lang: Language) -> Iterable[str]:
    value = f"  {number(one.value, lang)}" if one.value is not None else ""
    limits = f"  [{interval(one.band, lang)}]" if one.band else ""
    unit = f" {one.unit}" if one.unit and one.value is not None else ""
    yield f"{WORDS[lang].badges[one.verdict]}  {one.metric}{value}{limits}{unit}"
    yield from _wrapped(one.meaning, (6 * " ", 6 * " "))
    if one.action:
        yield from _wrapped(f"-> {one.action}", (6 * " ", 9 * " "))


def table_lines(table: Table, lang: Language = "en") -> Iterable[str]:
    """Headings with their units, then the rows; text left, numbers right."""
    pairs = [(h, "") if isinstance(h, str) else h for h in table.headings]
    lines = [tuple(name for name, _ in pairs), tuple(unit for _, unit in pairs)]
    lines = lines if any(lines[1]) else lines[:1]
    lines += [tuple(number(cell, lang, table.digits) for cell in row) for row in table.rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    columns = zip(*table.rows, strict=True) if table.rows else [()] * len(pairs)
    left = [all(isinstance(cell, str) for cell in column) for column in columns]
    for line in lines:
        cells = zip(line, widths, left, strict=True)
        yield "  ".join(c.ljust(w) if is_left else c.rjust(w) for c, w, is_left in cells).rstrip()
