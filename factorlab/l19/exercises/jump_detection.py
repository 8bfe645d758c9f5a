"""E2: `detecter_sauts(x, k, seuil)`, on a signal whose noise changes; its mistakes called by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.signatures import imported
from factorlab.l19.exercises.window_mutants import (
    RULES,
    WRONG_RULES,
    Array,
    global_levels,
    levels_of,
    noisy_jumps,
    separated,
)

__all__ = ["check_jumps"]

TITLE = "detecter_sauts : |x - médiane locale| > seuil × MAD locale"
K, THRESHOLD = 21, 4.0
INNER = range(25, 475)
GLOBAL = (
    "avec une MAD globale : l'énoncé la demande locale, car un bruit qui change la rend trop grande ici et "
    "trop petite là"
)
SMALL = (0.0, 0.1, -0.1, 5.0, 0.0, 0.2, -4.0, 0.1, -0.2, 0.0)
SMALL_K, SMALL_THRESHOLD, SMALL_FOUND = 5, 4.0, [3, 6]


def check_jumps(sheet: Sheet, function: Callable[..., Any]) -> None:
    """Judge detecter_sauts by the indices that it gives away from the ends."""
    x, at = noisy_jumps(np.random.default_rng(8))
    lines = [
        "import numpy as np",
        imported(sheet.module, "detecter_sauts"),
        f"detecter_sauts(np.array({shown(list(SMALL))}), {SMALL_K}, {SMALL_THRESHOLD:g})",
    ]
    more = {"example": "\n".join(lines), "expected": shown(SMALL_FOUND)}
    given = x.copy()
    try:
        got = sheet.call(function, given, K, THRESHOLD)
        small = sheet.call(function, np.array(SMALL), SMALL_K, SMALL_THRESHOLD)
    except Stumble as stumble:
        sheet.stumbled("detecter_sauts", TITLE, stumble.fault, **more)
        return
    more["got"] = shown(small)
    if (same := _indices(small, np.array(SMALL))[0]) is not None and same.tolist() == SMALL_FOUND:
        more = {}  # the small example does not show the mistake
    if not np.array_equal(given, x):
        copy = Cause("argument modifié", "travaillez sur une copie : x = np.array(x, float).")
        sheet.wrong("detecter_sauts", TITLE, "`detecter_sauts` change le tableau x qu'on lui donne.", copy)
        return
    indices, how = _indices(got, x)
    if indices is None:
        cause = how if isinstance(how, Cause) else None
        sheet.wrong("detecter_sauts", TITLE, "Le résultat n'est pas une suite d'indices.", cause, **more)
        return
    if isinstance(how, str):
        sheet.remark("sauts.forme", "la forme du résultat", how)
    _judge(sheet, x, at, indices, more)
    _flat(sheet, function)


def _indices(got: Any, x: Array) -> tuple[Array | None, Cause | str | None]:
    """What was given back as indices, with a remark about its form, or the cause why it is none."""
    if got is None:
        return None, Cause("return oublié", "rendez les indices, par exemple np.flatnonzero(condition).")
    form = None
    if isinstance(got, tuple) and len(got) == 1:
        got, form = (
            got[0],
            "np.where rend un tuple : np.flatnonzero(condition) donne directement les indices.",
        )
    try:
        found = np.asarray(got).ravel()
    except ValueError:
        return None, None
    if found.dtype == bool and len(found) == len(x):
        form = "C'est un masque de booléens ; l'énoncé demande les indices, np.flatnonzero(masque). Accepté."
        return np.flatnonzero(found).astype(float), form
    return _whole(found, x, form)


def _whole(found: Any, x: Array, form: str | None) -> tuple[Array | None, Cause | str | None]:
    """Numbers that are indices."""
    if found.size and found.dtype.kind not in "iuf":
        return None, None
    numbers = found.astype(float)
    if np.all(numbers == np.round(numbers)):
        return numbers, form
    if np.isin(numbers, x).all():
        return None, Cause(
            "valeurs au lieu des indices", "rendez où sont les sauts : np.flatnonzero(condition)."
        )
    return None, None


def _inner(indices: Any) -> set[int]:
    return {int(i) for i in indices if int(i) in INNER}


def _accepted(x: Array, found: set[int]) -> str | None:
    """How the rule of these indices differs from the statement's: "" not at all, None too much."""
    for how, rule in RULES.items():
        if found and found == _inner(np.flatnonzero(rule(x, K, THRESHOLD))):
            return how
    for how, level in global_levels(x, K, THRESHOLD).items():
        if found and found == _inner(np.flatnonzero(levels_of(x, K) > level)):
            return f"{GLOBAL}{how}"
    return None


def _of_global_mad(x: Array, found: set[int]) -> str | None:
    """Which global scale these indices come from; the ends, where everybody does as they like, move it."""
    between = separated(x, K, found, INNER)
    for how, level in global_levels(x, K, THRESHOLD).items():
        if between is not None and between[0] < 1.1 * level and 0.9 * level < between[1]:
            return f"{GLOBAL}{how}"
    return None


def _cause(x: Array, found: set[int], jumps: set[int]) -> Cause | None:
    with np.errstate(all="ignore"):
        for cause, rule in WRONG_RULES.items():
            if found == _inner(np.flatnonzero(rule(x, K, THRESHOLD))):
                return cause
    by = next((s for s in (K // 2, -(K // 2), 1, -1) if {i + s for i in found} >= jumps - found), None)
    if by is None or not jumps - found:
        return None
    return Cause("indices décalés", f"ils sont décalés de {abs(by)} : l'indice i doit être celui de x.")


def _judge(sheet: Sheet, x: Array, at: Any, indices: Array, more: dict[str, Any]) -> None:
    found, jumps = _inner(indices), _inner(at)
    how = _accepted(x, found)
    if how == "":
        sheet.passed("detecter_sauts", TITLE)
        return
    cause = None if how else _cause(x, found, jumps)
    how = how or (None if cause else _of_global_mad(x, found))
    missed, extra = len(jumps - found), len(found - jumps)
    said = f"Sur {len(jumps)} sauts simulés, {missed} sont oubliés et {extra} mesures ordinaires sont prises."
    if how:
        sheet.remark("detecter_sauts", TITLE, f"Juste, {how}.")
    elif cause is None and missed == 0 and extra <= 5:
        sheet.remark("detecter_sauts", TITLE, f"Une règle à vous, acceptée. {said}")
    elif cause is None and "median_glissant" in sheet.failed:
        sheet.wrong("detecter_sauts", TITLE, f"{said} Corrigez d'abord median_glissant.", **more)
    else:
        mend = {} if cause else {"mend": "comparez |x - médiane locale| à seuil × 1,4826 × MAD locale."}
        sheet.wrong("detecter_sauts", TITLE, said, cause, **more, **mend)


def _flat(sheet: Sheet, function: Callable[..., Any]) -> None:
    """A constant with one jump: its MAD is zero, and the jump is a jump."""
    x = np.full(40, 2.0)
    x[20] = 2.5
    got = sheet.call.tried(function, x.copy(), 7, 3.0)
    indices, _ = _indices(got, x)
    if "detecter_sauts" not in sheet.failed and (indices is None or indices.tolist() != [20.0]):
        sheet.remark("mad_nulle", "une MAD nulle", "Sur un signal constant la MAD vaut 0 et un saut vous "
                     "échappe, ou tout est pris : comparez par >, sans diviser par la MAD.")  # fmt: skip
