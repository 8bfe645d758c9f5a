"""E2: `median_glissant(x, k)` and `detecter_sauts(x, k, seuil)` against the statement."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.jump_detection import check_jumps
from factorlab.l19.exercises.signatures import imported, signature_fault
from factorlab.l19.exercises.window_mutants import EDGES, EVEN, MEDIANS, Array, sliding

__all__ = ["check"]

TITLE = "median_glissant : la médiane de chaque fenêtre de k mesures"
EXAMPLE, SIZE = (1.0, 9.0, 2.0, 3.0, 8.0, 4.0, 7.0), 3
LONG, LONG_K, LONG_S = 5000, 101, 3.0


def check(sheet: Sheet) -> None:
    """Every check of E2 on the names of a file."""
    median, jumps = sheet.names.get("median_glissant"), sheet.names.get("detecter_sauts")
    if median is not None:
        fault = signature_fault(median, ("x", "k"))
        if fault:
            sheet.wrong("median_glissant", TITLE, f"`median_glissant` {fault}.")
        else:
            _check_median(sheet, median)
    if jumps is not None:
        fault = signature_fault(jumps, ("x", "k", "seuil"))
        if fault:
            sheet.wrong("detecter_sauts", "detecter_sauts(x, k, seuil)", f"`detecter_sauts` {fault}.")
        else:
            check_jumps(sheet, jumps)


def _example(sheet: Sheet) -> str:
    row = shown(list(EXAMPLE)).replace(",", ".,").replace("]", ".]")
    return "\n".join(
        ["import numpy as np", imported(sheet.module, "median_glissant"),
         f"median_glissant(np.array({row}), {SIZE})"]
    )  # fmt: skip


def _check_median(sheet: Sheet, function: Callable[..., Any]) -> None:
    rng = np.random.default_rng(3)
    inputs = [(np.array(EXAMPLE), SIZE), *((rng.standard_normal(60), k) for k in (5, 9))]
    rows = []
    for x, k in inputs:
        given = x.copy()
        try:
            got = sheet.call(function, given, k)
        except Stumble as stumble:
            sheet.stumbled("median_glissant", TITLE, stumble.fault, example=_example(sheet))
            return
        if not np.array_equal(given, x):
            cause = Cause("argument modifié", "une tranche x[i:j] n'est pas une copie : np.sort(fenêtre) ou "
                          "fenêtre.copy() avant de trier sur place.")  # fmt: skip
            sheet.wrong(
                "median_glissant", TITLE, "`median_glissant` change le tableau x qu'on lui donne.", cause
            )
            return
        rows.append(got)
    if _judge(sheet, inputs, rows):
        _ends(sheet, inputs[1:], [np.asarray(row, float).ravel() for row in rows[1:]])
        _even(sheet, function)
        _plain_list(sheet, function)
        _time(sheet, function)


def _judge(sheet: Sheet, inputs: list[tuple[Array, int]], rows: list[Any]) -> bool:
    """The middle of every row, against the definition and against wrong ones."""
    wanted = sliding(inputs[0][0], SIZE // 2, SIZE // 2)
    more: dict[str, Any] = {"expected": shown(wanted), "got": shown(rows[0]), "example": _example(sheet)}
    try:
        found = [np.asarray(row, float).ravel() for row in rows]
    except (TypeError, ValueError):
        cause = Cause("return oublié", "rendez le tableau des médianes.") if rows[0] is None else None
        sheet.wrong("median_glissant", TITLE, "Le résultat n'est pas un tableau de nombres.", cause, **more)
        return False
    lengths = {len(row) - len(x) for row, (x, _) in zip(found, inputs, strict=True)}
    if lengths != {0}:
        short = all(len(f) == len(x) - k + 1 for f, (x, k) in zip(found, inputs, strict=True))
        mend = "rendez autant de valeurs que x : raccourcissez la fenêtre aux bords."
        cause = Cause("bords coupés", mend)
        said = "Le résultat n'a pas la longueur de x."
        sheet.wrong("median_glissant", TITLE, said, cause if short else None, **more)
        return False
    if all(_agrees(f, sliding(x, k // 2, k // 2), k) for f, (x, k) in zip(found, inputs, strict=True)):
        sheet.passed("median_glissant", TITLE)
        return True
    said = "Ce n'est pas la médiane de la fenêtre centrée."
    for cause, wrong in MEDIANS.items():
        if all(_agrees(f, wrong(x, k), k) for f, (x, k) in zip(found, inputs, strict=True)):
            sheet.wrong("median_glissant", TITLE, said, cause, **more)
            return False
    sheet.wrong("median_glissant", TITLE, said, **more)
    return False


def _agrees(got: Array, wanted: Array, k: int) -> bool:
    inner = slice(k, len(wanted) - k)
    if len(wanted) < 3 * k:
        inner = slice(k // 2, len(wanted) - k // 2)
    return bool(np.allclose(got[inner], wanted[inner], rtol=1e-9, atol=1e-12))


def _ends(sheet: Sheet, inputs: list[tuple[Array, int]], rows: list[Array]) -> None:
    """What is done at the ends, where the statement leaves the choice."""
    for how, of in EDGES.items():
        if all(np.allclose(f, of(x, k), equal_nan=True) for f, (x, k) in zip(rows, inputs, strict=True)):
            if how:
                kept = "Une fenêtre raccourcie garde toutes les mesures sans en inventer."
                sheet.remark("bords", "aux bords", f"Vous avez choisi {how} : accepté. {kept}")
            return
    said = "Les premières et dernières valeurs ne sont pas des médianes de fenêtres raccourcies : accepté."
    sheet.remark("bords", "aux bords", said)


def _even(sheet: Sheet, function: Callable[..., Any]) -> None:
    x, k = np.random.default_rng(4).standard_normal(40), 4
    try:
        got = np.asarray(sheet.call(function, x.copy(), k), float).ravel()
    except (Stumble, TypeError, ValueError):
        sheet.remark(
            "k_pair", "k pair", "Votre fonction n'accepte pas un k pair : c'est permis, si c'est dit."
        )
        return
    for how, of in EVEN.items():
        if len(got) == len(x) and _agrees(got, of(x, k), k):
            if how:
                sheet.remark("k_pair", "k pair", f"Avec k pair, {how} : accepté.")
            return
    said = "Avec k pair, le résultat n'est plus une médiane ordinaire (moyenne des deux valeurs du milieu)."
    sheet.remark("k_pair", "k pair", said)


def _plain_list(sheet: Sheet, function: Callable[..., Any]) -> None:
    if sheet.call.tried(function, list(EXAMPLE), SIZE) is None:
        said = "Une liste Python arrête votre fonction : x = np.asarray(x, float) accepte les deux."
        sheet.remark("liste", "une liste", said)


def _time(sheet: Sheet, function: Callable[..., Any]) -> None:
    title = "la durée"
    x = np.random.default_rng(5).standard_normal(LONG)
    began = time.perf_counter()
    try:
        sheet.call(function, x, LONG_K, limit_s=LONG_S)
    except Stumble as stumble:
        if stumble.fault.kind != "durée":
            sheet.stumbled("durée", title, stumble.fault)
            return
        sheet.remark("durée", title, f"Plus de {LONG_S:g} s pour {LONG} mesures et k = {LONG_K} : l'énoncé "
                     "demande O(n·k), une fenêtre triée ou np.median par mesure.")  # fmt: skip
        return
    each_us = f"{1e6 * (time.perf_counter() - began) / LONG:.2g}".replace(".", ",")
    sheet.passed("durée", title, f"{each_us} µs par mesure pour k = {LONG_K}.")
