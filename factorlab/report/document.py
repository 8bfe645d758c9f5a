"""A report in general: verdicts first, then sections of words, tables and figures.

>>> from factorlab.report.document import Document, Section, Table, Verdict
>>> page = Document(
...     title="Gyro of the left wheel",
...     lead="Ten minutes at rest.",
...     verdicts=(Verdict("bias of gx", 0.012, (0.011, 0.013), "WARN", "turns by 0.7 °/min", "take it off"),),
...     sections=(Section("Axes", table=Table(("axis", ("σ", "rad/s")), (("gx", 0.0011),))),),
...     numbers={"axes": {"gx": {"sigma": 0.0011}}},
... )
>>> page.to_json()["verdicts"][0]["verdict"]
'WARN'

`write_document(page, Path("out"))` writes `out/report.html`, one file that needs nothing else, and
`out/report.json`, which is what `--json` prints, with the names of the files.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from factorlab.report.folder import MANIFEST, whole_folder
from factorlab.report.words import WORDS, Language, interval, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Cell", "Document", "Section", "Status", "Table", "Verdict", "fill_folder", "write_document"]

Status = Literal["PASS", "WARN", "FAIL", "INFO"]
Cell = str | float | None
SCHEMA = 1


@dataclass(frozen=True, slots=True)
class Verdict:
    """One line of the verdict: a metric beside its 95 % band, what it means, what to do.

    `unit` is written behind value and band; `meaning` and `action` are phrases in the document's language.
    """

    metric: str
    value: Cell
    band: tuple[float, float] | None
    verdict: Status
    meaning: str
    action: str = ""
    unit: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain values under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of cells under headings; a heading is a name, or a name and a unit.

    Numbers are written with `digits` significant digits and stand right; None becomes a dash.
    """

    headings: tuple[str | tuple[str, str], ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    digits: int = 3

    def __post_init__(self) -> None:
        for k, row in enumerate(self.rows):
            if len(row) != len(self.headings):
                raise ValueError(
                    f"row {k} of a table has {len(row)} cells under {len(self.headings)} headings"
                )


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """A heading, words (blank lines part paragraphs), a table and a figure; all but the heading optional.

    `figure` is drawn when the page is written, in the page's style, where it is a function; a `Figure` that
    exists already is taken as it is (make it inside `factorlab.report.style.styled`).
    """

    heading: str
    text: str = ""
    table: Table | None = None
    figure: Figure | Callable[[], Figure | None] | None = None
    caption: str = ""  # how the figure is read
    page_only: bool = False  # a table that a terminal has no room for


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """What a report says; `numbers` become keys of `report.json` beside title, lead and verdicts."""

    title: str
    lead: str
    verdicts: tuple[Verdict, ...] = ()
    sections: tuple[Section, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)
    lang: Language = "en"
    command: str = ""  # as it can be typed again
    conclusion: str = ""  # the verdict in one sentence: below the lead on the page, last in a terminal

    @property
    def failed(self) -> bool:
        """Whether any verdict is FAIL."""
        return any(one.verdict == "FAIL" for one in self.verdicts)

    def to_json(self) -> dict[str, Any]:
        """One JSON document; NaN and infinity become null.

        Raises
        ------
        ValueError
            where a key of `numbers` is one that every report has.
        """
        from factorlab.compare.table import strict
        from factorlab.versions import versions

        own = {
            "schema": SCHEMA,
            "title": self.title,
            "lead": self.lead,
            "conclusion": self.conclusion,
            "verdicts": [one.to_json() for one in self.verdicts],
        }
        last = {"versions": versions(), "command": self.command}
        if taken := {*own, *last, "files"} & {*self.numbers}:
            raise ValueError(
                f"every report has {', '.join(sorted(taken))} already; name these numbers otherwise"
            )
        return {key: strict(value) for key, value in (own | dict(self.numbers) | last).items()}


def write_document(
    document: Document, out: Path, *, force: bool = False, files: Mapping[str, str | bytes] | None = None
) -> Path:
    """Write page and JSON, all or nothing; returns the path of the page.

    Parameters
    ----------
    files : further files of the folder by name, such as `{"imu.yaml": "…"}`

    Raises
    ------
    OutputExistsError
        where `out` holds files and `force` is False.
    """
    with whole_folder(out, force=force) as folder:
        fill_folder(document, folder, files)
    return out / "report.html"


def fill_folder(document: Document, folder: Path, files: Mapping[str, str | bytes] | None = None) -> None:
    """Write page and JSON into a folder that may hold files already; the JSON names all of them."""
    (folder / "report.html").write_text(render_document(document), encoding="utf-8")
    for name, content in (files or {}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    there = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    whole = document.to_json() | {"files": [*there, MANIFEST]}
    text = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")


def render_document(document: Document) -> str:
    """The whole page as text."""
    from factorlab.report.template import fill
    from factorlab.versions import versions

    lang = document.lang
    return fill(
        "document.html.j2",
        lang=lang,
        document=document,
        words=WORDS[lang],
        number=lambda value, digits=3: number(value, lang, digits),
        interval=lambda limits: interval(limits, lang),
        sections=[_section(section, k, document.title) for k, section in enumerate(document.sections)],
        versions=versions(),
    )


def _section(section: Section, k: int, title: str) -> dict[str, Any]:
    """What the template needs of one section."""
    svg = None
    if section.figure is not None:
        from markupsafe import Markup

        from factorlab.report.style import inline_svg

        given = section.figure
        draw = given if callable(given) else lambda: given
        drawn = inline_svg(f"section{k}", draw, f"{section.heading}, {title}. {section.caption}")
        # the SVG is made here from numbers and names that matplotlib has escaped
        svg = None if drawn is None else Markup(drawn)  # noqa: S704
    table = section.table
    return {
        "heading": section.heading,
        "paragraphs": [part for part in section.text.split("\n\n") if part.strip()],
        "caption": section.caption,
        "table": table,
        "headings": [(h, "") if isinstance(h, str) else h for h in table.headings] if table else [],
        "right": _right(table) if table else [],
        "svg": svg,
    }


def _right(table: Table) -> list[bool]:
    """Which columns stand right: those that hold a number anywhere."""
    columns = zip(*table.rows, strict=True) if table.rows else [()] * len(table.headings)
    return [any(not isinstance(cell, str | None) for cell in column) for column in columns]
