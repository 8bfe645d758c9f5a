"""RESULTATS.md read back: which file stated which figure, and the band."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from factorlab.l19.results.claims import Claim
from factorlab.l19.results.course import item_of
from factorlab.l19.results.numbers import band_of, number_of
from factorlab.l19.results.page import CLAIM_HEADINGS
from sequential.errors import FileFormatError

__all__ = ["Row", "read_results"]

_HEADING = re.compile(r"^### (\d\d_\w+\.py)$")
_CELLS = re.compile(r"(?<!\\)\|")


@dataclass(frozen=True, slots=True)
class Row:
    """One figure of the page under the name of its script; the value is as written."""

    script: str
    claim: Claim
    written: str  # value and unit


def read_results(path: Path) -> list[Row]:
    """The rows of every script's own table, in the order of the scripts; times are none of them.

    Raises
    ------
    FileFormatError
        naming the line that cannot be read, or where there is no such table at all.
    """
    rows, script, inside = [], "", False
    for k, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if line.startswith("#"):
            found = _HEADING.match(line)
            script, inside = (found[1] if found else ""), False
        if not line.startswith("|"):
            inside = False
            continue
        cells = tuple(one.strip().replace("\\|", "|") for one in _CELLS.split(line)[1:-1])
        if cells == CLAIM_HEADINGS:
            inside = True
        elif script and inside and not line.startswith("|---"):
            rows.append(_row(script, cells, f"{path.name}, ligne {k}"))
    if not rows:
        raise FileFormatError(
            f"{path} : aucun tableau « {' | '.join(CLAIM_HEADINGS)} » ; attendu un fichier que "
            "`factorlab l19 rapport` a écrit"
        )
    return sorted(rows, key=lambda row: row.script)


def _split(written: str) -> tuple[str, str]:
    """Value and unit: `3,2 °/s`, `4,5°`, `7`."""
    value = written.partition(" ")[0].removesuffix("°")
    return value, written.removeprefix(value).strip()


def _row(script: str, cells: tuple[str, ...], where: str) -> Row:
    try:
        quantity, written, band, source, _ = cells
        value, unit = _split(written)
        low, high = band_of(band)
        claim = Claim(item_of(script) or "", quantity, number_of(value), unit, low, high, source)
    except ValueError as error:
        raise FileFormatError(f"{where} : ce rang ne se lit pas : {' | '.join(cells)}") from error
    return Row(script, claim, written)
