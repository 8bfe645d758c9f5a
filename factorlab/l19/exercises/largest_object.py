"""E4: `plus_gros_objet(masque, aire_min)`, judged on objects whose components nobody disputes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from factorlab.l19.exercises.component_mutants import components
from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.signatures import imported

__all__ = ["check_largest"]

TITLE = "plus_gros_objet : le centre de la plus grande, ou None"
MASK = np.zeros((9, 12), np.uint8)
MASK[0, 0] = 1  # a grain, first in reading order
MASK[2:5, 1:5] = 1
MASK[6:8, 8:11] = 1
MASK[5, 2] = 1  # the middle of the box is not the centroid
AREA = 13
ROWS = (tuple, list, np.ndarray)
CENTRE = components(MASK)[0][1]
Turn = Callable[[tuple[float, float]], tuple[float, float]]


def check_largest(sheet: Sheet, function: Callable[..., Any], turned: Turn | None) -> None:
    """Judge plus_gros_objet; `turned` is the order of the coordinates that composantes has shown."""
    more = {"example": _example(sheet), "expected": f"{shown(CENTRE)} en (ligne, colonne)"}
    given = MASK.copy()
    try:
        got = sheet.call(function, given, 5)
        none = sheet.call(function, MASK.copy(), 500)
        empty = sheet.call(function, np.zeros_like(MASK), 1)
        equal = sheet.call(function, MASK.copy(), AREA)
    except Stumble as stumble:
        sheet.stumbled("plus_gros_objet", TITLE, stumble.fault, **more)
        return
    more["got"] = shown(got)
    if not np.array_equal(given, MASK) and "composantes" not in sheet.failed:
        cause = Cause("argument modifié", "travaillez sur une copie : masque.copy().")
        sheet.wrong("plus_gros_objet", TITLE, "`plus_gros_objet` change le masque.", cause)
        return
    if not _is_centre(got, turned):
        sheet.wrong(
            "plus_gros_objet", TITLE, "Ce n'est pas le centre de la plus grande.", _cause(got), **more
        )
        return
    if none is not None or empty is not None:
        bad, when = (none, "aire_min = 500") if none is not None else (empty, "le masque est vide")
        cause = Cause("aire_min ignorée", "rendez None si la plus grande n'atteint pas aire_min.")
        if not _is_centre(bad, turned):
            cause = Cause("autre chose que None", "rendez None quand rien n'est assez grand.")
        said = f"Quand {when}, la réponse est None."
        sheet.wrong("plus_gros_objet", TITLE, said, cause, expected="None", got=shown(bad))
        return
    sheet.passed("plus_gros_objet", TITLE)
    if equal is None:
        said = "Une aire égale à aire_min est refusée (>) : accepté ; « au moins aire_min » s'écrit >=."
        sheet.remark("aire_min", "l'aire juste égale à aire_min", said)


def _example(sheet: Sheet) -> str:
    return "\n".join([
        "import numpy as np", imported(sheet.module, "plus_gros_objet"), "m = np.zeros((9, 12), np.uint8)",
        "m[0, 0] = m[5, 2] = 1", "m[2:5, 1:5] = 1", "m[6:8, 8:11] = 1", "plus_gros_objet(m, 5)",
    ])  # fmt: skip


def _pair(value: Any) -> tuple[float, float] | None:
    try:
        first, second = np.ravel(np.asarray(value, float)).tolist()
    except (TypeError, ValueError):
        return None
    return first, second


def _is_centre(value: Any, turned: Turn | None) -> bool:
    pair = _pair(value)
    if pair is None:
        return False
    row, column = CENTRE
    wanted = [turned(CENTRE)] if turned else [(row, column), (column, row)]
    return any(np.allclose(pair, one, atol=1e-6) for one in wanted) or (
        turned is None and any(np.allclose(pair, one, atol=1.01) for one in wanted)
    )


def _cause(got: Any) -> Cause | None:
    """The named mistake that gives this answer, whichever order its coordinates have."""
    if got is None:
        return Cause("None à tort, ou return oublié", "l'objet a 13 pixels, plus que 5 : rendez son centre.")
    try:
        flat = (
            np.hstack([np.ravel(np.asarray(one, float)) for one in got]) if isinstance(got, ROWS) else [got]
        )
    except (TypeError, ValueError):
        flat = []
    if len(flat) == 3 and flat[0] == AREA:
        return Cause("(aire, centre) au lieu du centre", "rendez le centre seul : le deuxième élément.")
    if len(flat) == 1 and flat[0] == AREA:
        return Cause("aire au lieu du centre", "rendez le centre de la composante, et non son aire.")
    return None if (pair := _pair(got)) is None else _misplaced(pair)


def _misplaced(pair: tuple[float, float]) -> Cause | None:
    """A point that is the centre of something else."""
    found = components(MASK)
    rows, columns = np.nonzero(MASK)
    mend = "prenez la première composante de la liste triée par aire décroissante."
    known = {
        "plus petite au lieu de la plus grande": found[-1][1],
        "deuxième composante au lieu de la première": found[1][1],
        "centre de tous les pixels": (float(rows.mean()), float(columns.mean())),
        "centre de la boîte au lieu du centre de gravité": (3.5, 2.5),
        "coordonnées échangées": CENTRE,
    }
    for name, (row, column) in known.items():
        if np.allclose(pair, (row, column)) or np.allclose(pair, (column, row)):
            return Cause(name, "gardez l'ordre de composantes." if name == "coordonnées échangées" else mend)
    return None
