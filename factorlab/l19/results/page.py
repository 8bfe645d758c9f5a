"""RESULTATS.md as text: the course item by item, then every figure under the file that claims it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from factorlab.l19.results.claims import Claim
from factorlab.l19.results.course import COURSE, PICTURED, part_of
from factorlab.l19.results.numbers import band_text, number_text
from factorlab.l19.results.running import Outcome
from factorlab.report.document import Table
from factorlab.report.words import number

__all__ = ["CLAIM_HEADINGS", "Work", "cells", "results_page", "verdict_of"]

CLAIM_HEADINGS = ("grandeur", "valeur", "tolérance", "source", "verdict")
GOOD, BAD, TOLD, FAILED, MISSING, SILENT = "bon", "HORS TOLÉRANCE", "dit", "ÉCHEC", "PAS DE FICHIER", "MUET"


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """What a page is made of.

    Attributes
    ----------
    outcomes : of the scripts that ran, in the order of the course
    pictures : by script stem, paths as the page links to them
    sources : by script name, where the page links to for the script itself
    name : whose work it is; empty for the project's own
    recordings : the student's own files, by the id of the item that read them
    whole : whether every item of the course was asked for, so that a missing file is a fault
    command : as it can be typed again
    """

    outcomes: Sequence[Outcome]
    pictures: Mapping[str, Sequence[str]] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    recordings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    whole: bool = True
    command: str = ""

    @property
    def missing(self) -> list[str]:
        """Ids that no script is for."""
        there = {one.item for one in self.outcomes}
        return [item.id for item in COURSE if self.whole and item.id not in there]

    @property
    def failed(self) -> bool:
        """Whether an example failed, said nothing or left its band, or an id has no file."""
        return bool(self.missing) or not all(one.good for one in self.outcomes)


def results_page(work: Work) -> str:
    """The whole page, in French."""
    lines = [*_head(work), "", *_overview(work), ""]
    titles = {item.id: item.title for item in COURSE}
    practical = [one for one in work.outcomes if part_of(one.item) in PICTURED]
    for item in dict.fromkeys(one.item for one in practical):
        lines += [f"## {item}. {titles[item]}", ""]
        for one in practical:
            if one.item == item:
                lines += _section(one, work.pictures.get(one.script.stem, ()))
    rest = [one for one in work.outcomes if part_of(one.item) not in PICTURED]
    if rest:
        lines += ["## Cours, pièges, exercices et fiches", ""]
        for one in rest:
            lines += _section(one, ())
    return "\n".join([*lines, *_times(work.outcomes)]).rstrip() + "\n"


def _head(work: Work) -> list[str]:
    judged = [claim for one in work.outcomes for claim in one.claims if claim.judged]
    good = sum(claim.holds for claim in judged)
    lines = [f"# Résultats du module L19, « Perception »{f' : {work.name}' if work.name else ''}", ""]
    if work.recordings:
        lines.append("Enregistrements personnels :\n")
        lines += [f"- {item} : {_named(files)}" for item, files in work.recordings.items()]
        lines.append("")
    scripts = "exemple a tourné" if len(work.outcomes) == 1 else "exemples ont tourné"
    lines.append(
        f"{len(work.outcomes)} {scripts} ; {good} grandeurs sur {len(judged)} sont dans la tolérance que "
        "leur exemple annonce, bornes comprises.  « Source » dit d'où vient la grandeur : d'une "
        "simulation, ou de l'enregistrement réel nommé.  Les temps, qui dépendent de la machine, sont à la "
        "fin et ne sont pas jugés."
    )
    if work.command:
        lines += ["", f"Page écrite par `{work.command}` ; ne pas la corriger à la main."]
    return lines


def _named(files: Sequence[str]) -> str:
    if len(files) <= 3:
        return ", ".join(f"`{file}`" for file in files)
    return f"{len(files)} fichiers, de `{files[0]}` à `{files[-1]}`"


def _overview(work: Work) -> Iterable[str]:
    yield "## Le cours, point par point"
    yield ""
    # the verdict beside the id, where a narrow window does not cut it off
    yield from table_lines(("", CLAIM_HEADINGS[-1], "fichier", *CLAIM_HEADINGS[:-1]))
    missing = set(work.missing)
    for item in COURSE:
        for one in work.outcomes:
            if one.item == item.id:
                *found, verdict = _headline(one, own=one.item in work.recordings)
                yield row_line((f"**{item.id}**", verdict, _file(one.script.name, work.sources), *found))
        if item.id in missing:
            yield row_line((f"**{item.id}**", MISSING, "–", item.title, "–", "–", "–"))


def _file(name: str, sources: Mapping[str, str]) -> str:
    return f"[`{name}`]({sources[name]})" if name in sources else f"`{name}`"


def _headline(outcome: Outcome, *, own: bool) -> tuple[str, ...]:
    # where a student has measured, what was measured leads
    measured = [claim for claim in outcome.claims if own and not claim.source.startswith("simulé")]
    claim = measured[0] if measured else outcome.headline
    if claim is None:
        words = outcome.fault or "aucune grandeur annoncée"
        return (words, "–", "–", "–", FAILED if outcome.fault else SILENT)
    found = cells(claim)
    if outcome.fault:
        return (*found[:-1], FAILED)
    return found if all(c.holds for c in outcome.claims) else (*found[:-1], BAD)


def cells(claim: Claim) -> tuple[str, ...]:
    """A claim under `CLAIM_HEADINGS`."""
    space = "" if claim.unit in {"", "°"} else " "
    value = f"{number_text(claim.value)}{space}{claim.unit}"
    return (claim.quantity, value, band_text(claim.low, claim.high), claim.source, verdict_of(claim))


def verdict_of(claim: Claim) -> str:
    """In its band, out of it, or told without one."""
    if not claim.judged:
        return TOLD
    return GOOD if claim.holds else BAD


def _section(outcome: Outcome, pictures: Sequence[str]) -> list[str]:
    lines = [f"### {outcome.script.name}", "", *([outcome.title, ""] if outcome.title else [])]
    if outcome.fault:
        lines += [f"**{FAILED}** : {outcome.fault}", ""]
    claims = [claim for claim in outcome.claims if not claim.is_time]
    if claims:
        lines += [*table_lines(CLAIM_HEADINGS), *(row_line(cells(claim)) for claim in claims), ""]
    for table in outcome.tables:
        lines += [f"{table.caption} :", "", *_table(table), ""]
    return lines + [line for path in pictures for line in (f"![Figure de {outcome.script.stem}]({path})", "")]


def _table(table: Table) -> Iterable[str]:
    names = [h if isinstance(h, str) else f"{h[0]} ({h[1]})" for h in table.headings]
    right = [all(_is_number(row[k]) for row in table.rows) for k in range(len(names))]
    yield from table_lines(names, right)
    for row in table.rows:
        yield row_line(
            [c if isinstance(c, str) else number(None) if c is None else number_text(c) for c in row]
        )


def _is_number(cell: str | float | None) -> bool:
    """A number, or words that begin with one."""
    return not isinstance(cell, str) or cell[:1].isdigit() or cell[:1] in "<≥≤−–"


def _times(outcomes: Sequence[Outcome]) -> Iterable[str]:
    rows = [(one.script.name, claim) for one in outcomes for claim in one.claims if claim.is_time]
    if not rows:
        return
    yield "## Temps et vitesses"
    yield ""
    yield "Ils dépendent de la machine : dits, pas jugés."
    yield ""
    yield from table_lines(("fichier", "grandeur", "valeur"))
    for name, claim in rows:
        yield row_line((f"`{name}`", *cells(claim)[:2]))


def table_lines(headings: Sequence[str], right: Sequence[bool] = ()) -> list[str]:
    """The two first lines of a table."""
    sides = ["--:" if k < len(right) and right[k] else "---" for k in range(len(headings))]
    return [row_line(headings), "|" + "|".join(sides) + "|"]


def row_line(given: Sequence[str]) -> str:
    """One line of a table."""
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in given) + " |"
