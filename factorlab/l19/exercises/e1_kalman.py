"""E1: `Kalman(F, B, H, Q, R, x0, P0)` against the statement, its mistakes called by name."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np

from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.innovation_readings import NIS, Parts, misread, read_innovation
from factorlab.l19.exercises.kalman_diagnosis import (
    close,
    correction_causes,
    example_lines,
    predicted_cause,
    right_after,
)
from factorlab.l19.exercises.kalman_driver import STYLES, Drive, NoStateError, drive
from factorlab.l19.exercises.kalman_habits import check_habits
from factorlab.l19.exercises.kalman_mean import check_mean_nis
from factorlab.l19.exercises.kalman_systems import EXAMPLE, ONE, SYSTEMS, THREE, TWO, System
from factorlab.l19.exercises.signatures import misspelt, signature_fault

__all__ = ["NAMES", "check"]

NAMES = ("Kalman", "nis_moyen")
# right for the one command and the one measurement of the statement
HARMLESS = {"division au lieu de l'inverse", "produit élément par élément"}
METHODS = {"predire": ("u",), "corriger": ("z",)}
TITLES = {
    ("predire", "x"): "predire : l'état x = F x + B u",
    ("predire", "P"): "predire : la covariance P = F P Fᵀ + Q",
    ("corriger", "x"): "corriger : l'état x = x + K (z - H x)",
    ("corriger", "P"): "corriger : la covariance P = (I - K H) P",
}


def check(sheet: Sheet) -> None:
    """Every check of E1 on the names of a file."""
    made = sheet.names.get("Kalman")
    if not inspect.isclass(made):
        sheet.wrong("Kalman", "une classe Kalman", "`Kalman` doit être une classe : class Kalman: …")
    elif _has_methods(sheet, made):
        reading = _check_filter(sheet, made)
        check_mean_nis(sheet, made, reading)
        if not set(sheet.failed) - {"nis_moyen"}:
            check_habits(sheet, made)


def _has_methods(sheet: Sheet, made: Any) -> bool:
    fault = signature_fault(made, ("F", "B", "H", "Q", "R", "x0", "P0"))
    if fault:
        sheet.wrong("signature", "Kalman(F, B, H, Q, R, x0, P0)", f"`Kalman` {fault}.")
        return False
    for name, arguments in METHODS.items():
        method = getattr(made, name, None)
        if not callable(method):
            near = misspelt(name, [one for one in vars(made) if not one.startswith("__")])
            sheet.wrong("signature", f"une méthode {name}", f"La méthode `{name}` manque{near}.")
            return False
        fault = signature_fault(method, ("self", *arguments))
        if fault:
            sheet.wrong("signature", f"{name}({', '.join(arguments)})", f"`{name}` {fault}.")
            return False
    return True


def _check_filter(sheet: Sheet, made: Any) -> str | None:
    """Judge predire and corriger; the form in which corriger returns its innovation, where it is right."""
    try:
        style, first = _style(sheet, made)
        drives = [first, *(drive(made, sheet.call, s, style) for s in SYSTEMS[1:])]
    except NoStateError:
        sheet.wrong(
            "état", "l'état se lit dans self.x et self.P",
            "Après Kalman(…), aucun attribut ne contient x0, ou aucun ne contient P0 : gardez l'état dans "
            "`self.x` et sa covariance dans `self.P`.",
        )  # fmt: skip
        return None
    if first.fault is not None and not first.stages:
        _tell_fault(sheet, first)
        return None
    halves = [_judge(sheet, drives, kind, part) for kind in METHODS for part in "xP"]
    right = all(halves)
    if right:
        _several(sheet, drives)
    if style == "colonnes" and right:
        sheet.remark(
            "colonnes", "vecteurs ou colonnes",
            "Votre classe veut des vecteurs colonnes, de taille (n, 1) ; c'est permis. np.ravel(x0) dans "
            "__init__ accepterait les deux.",
        )  # fmt: skip
    return _check_returned(sheet, drives, trusted=right)


def _style(sheet: Sheet, made: Any) -> tuple[str, Drive]:
    """The way of handing over vectors that suits this class: one that gives right numbers, or that runs."""
    drives = [drive(made, sheet.call, EXAMPLE, style) for style in STYLES]
    best = max(drives, key=lambda d: (_all_right(d), len(d.stages)))
    return best.style, best


def _all_right(d: Drive) -> bool:
    return d.fault is None and all(
        close(s.after_x, x) and close(s.after_P, P) for s in d.stages for x, P in [right_after(d.system, s)]
    )


def _tell_fault(sheet: Sheet, d: Drive) -> None:
    assert d.fault is not None  # noqa: S101 - for the type checker
    lines = example_lines(d.system, d.style, sheet.module, "corriger" if d.at == "corriger" else "predire")
    sheet.stumbled(d.at.partition("(")[0], f"{d.at} va jusqu'au bout", d.fault, example=lines)


def _judge(sheet: Sheet, drives: list[Drive], kind: str, part: str) -> bool:
    """One half of one method, on the systems with one measurement; passed, or wrong with its cause."""
    title, name = TITLES[kind, part], f"{kind}.{part}"
    small = [d for d in drives if d.system in (EXAMPLE, ONE)]
    for d in small:
        if d.fault is not None and d.at == kind and not d.of(kind):
            if part == "x":
                _tell_fault(sheet, d) if not _named_elsewhere(sheet, drives, kind) else None
            return False
        if kind == "corriger" and not d.of(kind):
            return False  # told as predire's
    bad = [(d, s) for d in small for s in d.of(kind) if not _half_right(d.system, s, part)]
    if not bad:
        sheet.passed(name, title)
        return True
    _tell_wrong(sheet, drives, kind, part, *bad[0])
    return False


def _half_right(system: System, stage: Any, part: str) -> bool:
    x, P = right_after(system, stage)
    return close(stage.after_x, x) if part == "x" else close(stage.after_P, P)


def _named_elsewhere(sheet: Sheet, drives: list[Drive], kind: str) -> bool:
    """A call that fails where sizes differ may run where they agree, and show there what it is."""
    if kind != "corriger" or not (causes := correction_causes(drives)):
        return False
    d = next(d for d in drives if d.fault is not None)
    assert d.fault is not None  # noqa: S101 - for the type checker
    sheet.stumbled(
        "corriger.x", TITLES["corriger", "x"], d.fault, cause=causes[0],
        example=example_lines(d.system, d.style, sheet.module, "corriger"),
    )  # fmt: skip
    return True


def _tell_wrong(sheet: Sheet, drives: list[Drive], kind: str, part: str, d: Drive, stage: Any) -> None:
    x, P = right_after(d.system, stage)
    wanted, got = (x, stage.after_x) if part == "x" else (P, stage.after_P)
    first = stage is d.of(kind)[0]
    causes = (
        [predicted_cause(drives, part)] if kind == "predire" else list(correction_causes(drives) or [None])
    )
    if part == "P" and f"{kind}.x" in sheet.failed and causes[0] is not None:
        told = correction_causes(drives) if kind == "corriger" else None
        if told:  # the mistake in x is the one in P, and has been told
            sheet.failed.append(f"{kind}.P")
            return
    step = "" if first else " Le premier appel est juste ; le suivant garde une ancienne valeur."
    more: dict[str, Any] = {
        "expected": f"kf.{part} = {shown(wanted)}",
        "got": f"kf.{part} = {shown(got)}",
        "example": example_lines(d.system, d.style, sheet.module, kind) if first else "",
    }
    if kind == "corriger" and causes[0] is None and first:
        S = d.system.H @ stage.P @ d.system.H.T + d.system.R
        K = stage.P @ d.system.H.T @ np.linalg.inv(S)
        v = stage.given - d.system.H @ stage.x
        more["mend"] = f"refaites l'exemple à la main : ν = {shown(v)}, S = {shown(S)}, K = {shown(K)}."
    for number, cause in enumerate(causes):
        check = f"{kind}.{part}" if number == 0 else f"{kind}.{part}.{number + 1}"
        said = "Le résultat n'est pas celui des équations." + step
        sheet.wrong(check, TITLES[kind, part], said, cause, **({} if number else more))


def _several(sheet: Sheet, drives: list[Drive]) -> None:
    """Two measurements at once: transposes and divisions show."""
    title = "plusieurs mesures et commandes à la fois"
    for d in (d for d in drives if d.system in (TWO, THREE)):
        if _all_right(d):
            continue
        wrong = [s for s in d.stages if not (_half_right(d.system, s, "x") and _half_right(d.system, s, "P"))]
        kind = wrong[0].kind if wrong else d.at
        what = "commande" if kind == "predire" else "mesure"
        more = {"example": example_lines(d.system, d.style, sheet.module, kind)}
        cause = _cause_of_several(drives, d, kind, wrong)
        said = f"Juste pour une {what} ; avec deux, le résultat est faux."
        if cause is not None and cause.name in HARMLESS:
            sheet.remark("mesures", title, f"{said} Cause : {cause.name} ; {cause.mend}", **more)
        elif wrong:
            x, _ = right_after(d.system, wrong[0])
            shown_x = {"expected": f"kf.x = {shown(x)}", "got": f"kf.x = {shown(wrong[0].after_x)}"}
            sheet.wrong("mesures", title, said, cause, **more, **shown_x)
        else:
            assert d.fault is not None  # noqa: S101 - for the type checker
            where = f" (ligne {d.fault.line})" if d.fault.line else ""
            said = f"Juste pour une {what} ; avec deux, {kind} s'arrête{where} : {d.fault.said}."
            sheet.remark(
                "mesures", title, f"{said} np.linalg.inv(S) et @ marchent pour toutes les tailles.", **more
            )
        return
    sheet.passed("mesures", title)


def _cause_of_several(drives: list[Drive], d: Drive, kind: str, wrong: list[Any]) -> Cause | None:
    if kind == "corriger":
        return next(iter(correction_causes(drives) or ()), None)
    part = "P" if wrong and _half_right(d.system, wrong[0], "x") else "x"
    return predicted_cause(drives, part) if wrong else None


def _check_returned(sheet: Sheet, drives: list[Drive], *, trusted: bool) -> str | None:
    """What corriger returns; judged where the correction itself is right."""
    title = "corriger rend l'innovation normalisée"
    pairs = [(s.returned, Parts(d.system, s)) for d in drives for s in d.of("corriger")]
    small = [(s.returned, Parts(d.system, s)) for d in drives[:2] for s in d.of("corriger")]
    if not pairs or not (trusted or all(r is None for r, _ in pairs)):
        return None
    form = read_innovation(pairs) or read_innovation(small)
    if form is not None:
        if form == NIS:
            sheet.passed("corriger.rendu", title, f"C'est {NIS}.")
        else:
            said = f"C'est {form} : accepté. Le NIS, νᵀ S⁻¹ ν, se compare directement à 1."
            sheet.remark("corriger.rendu", title, said)
        return form
    first = drives[0].of("corriger")[0]
    sheet.wrong(
        "corriger.rendu", title, "Ce que `corriger` rend n'est pas l'innovation normalisée.", misread(pairs),
        expected=f"r = {shown(Parts(EXAMPLE, first).nis)}", got=f"r = {shown(first.returned)}",
        example=example_lines(EXAMPLE, drives[0].style, sheet.module, "corriger"),
    )  # fmt: skip
    return None
