"""Fresh figures against those that a RESULTATS.md states."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from factorlab.l19.results.claims import Claim, inside
from factorlab.l19.results.numbers import band_text, number_text
from factorlab.l19.results.reading import Row, read_results
from factorlab.l19.results.readme import readme_table, table_in
from factorlab.l19.results.running import Outcome

__all__ = ["differences", "stale_readme"]


def differences(outcomes: Sequence[Outcome], rows: Sequence[Row], *, whole: bool = True) -> list[str]:
    """What is no longer as stated, a sentence each: out of its band, missing, added; times are not compared.

    Parameters
    ----------
    outcomes : of the scripts that ran
    rows : of the page
    whole : whether all scripts ran, so that a script the page names and nobody ran is a difference
    """
    found: list[str] = []
    stated: dict[str, list[Row]] = {}
    for row in rows:
        stated.setdefault(row.script, []).append(row)
    for outcome in outcomes:
        found += _of_one(outcome, stated.pop(outcome.script.name, []))
    if whole:
        found += [f"{script} : dans la page, mais l'exemple n'existe plus" for script in stated]
    return found


def _of_one(outcome: Outcome, rows: Sequence[Row]) -> Iterable[str]:
    name = outcome.script.name
    if outcome.fault:
        yield f"{name} : a échoué : {outcome.fault}"
    fresh = {claim.quantity: claim for claim in outcome.claims if not claim.is_time}
    if not rows and fresh:
        yield f"{name} : {len(fresh)} grandeurs, aucune dans la page"
        return
    for row in rows:
        claim = fresh.pop(row.claim.quantity, None)
        if claim is not None:
            yield from _of_claim(name, claim, row)
        elif not outcome.fault:
            yield f"{name} : « {row.claim.quantity} » est dans la page, mais l'exemple ne l'annonce plus"
    for quantity in fresh:
        yield f"{name} : « {quantity} » est annoncé, mais absent de la page"


def _of_claim(name: str, fresh: Claim, row: Row) -> Iterable[str]:
    stated = row.claim
    of = f"{name} : {fresh.quantity}"
    if fresh.unit != stated.unit:
        yield f"{of} est en {fresh.unit or 'nombre pur'}, en {stated.unit or 'nombre pur'} dans la page"
    elif not inside(fresh.value, stated.low, stated.high):
        band = band_text(stated.low, stated.high)
        value = f"{number_text(fresh.value)} {fresh.unit}".strip()
        yield f"{of} = {value}, hors de la tolérance {band}"
    if band_text(fresh.low, fresh.high) != band_text(stated.low, stated.high):
        bands = band_text(fresh.low, fresh.high), band_text(stated.low, stated.high)
        yield f"{of} : tolérance {bands[0]} dans l'exemple, {bands[1]} dans la page"


def stale_readme(readme: Path, results: Path) -> bool:
    """Whether the table of the README is not the one that RESULTATS.md gives."""
    return table_in(readme.read_text(encoding="utf-8")) != readme_table(read_results(results))
