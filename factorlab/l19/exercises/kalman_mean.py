"""E1: `nis_moyen(kf, mesures, commandes)`, on the statement's system; its mistakes called by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.kalman_systems import ReferenceKalman, System, constant_velocity, styled
from factorlab.l19.exercises.signatures import signature_fault

__all__ = ["check_mean_nis"]

TITLE = "nis_moyen(kf, mesures, commandes)"
STEPS = 40
Run = tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]


def check_mean_nis(sheet: Sheet, made: Any, reading: str | None) -> None:
    """Judge nis_moyen with the student's filter where that is right, and with ours where it is not."""
    function = sheet.names.get("nis_moyen")
    if not callable(function):
        return  # told with the names that are missing
    fault = signature_fault(function, ("kf", "mesures", "commandes"))
    if fault:
        sheet.wrong("nis_moyen", TITLE, f"`nis_moyen` {fault}.")
        return
    system = constant_velocity(STEPS, np.random.default_rng(19))
    if reading is None or sheet.failed:
        _judge_apart(sheet, function, system)
        return
    try:
        got = _called(sheet, function, made, system)
    except Stumble as stumble:
        sheet.stumbled("nis_moyen", TITLE, stumble.fault)
        return
    if _is_right(system, got):
        sheet.passed("nis_moyen", TITLE)
    else:
        _tell(sheet, system, got, _named(system, got))


def _judge_apart(sheet: Sheet, function: Any, system: System) -> None:
    """With our filter, whose innovation may not have the student's form: both are tried, doubt is silent."""
    causes = []
    for returns in ("nis", "blanchie"):
        got = sheet.call.tried(function, ReferenceKalman(system, returns), *_lists(system, "vecteurs"))
        if got is not None and _is_right(system, got):
            sheet.passed("nis_moyen", TITLE)
            return
        causes.append((got, _named(system, got) if got is not None else None))
    for got, cause in causes:
        if cause in HABITS:
            _tell(sheet, system, got, cause)
            return


def _tell(sheet: Sheet, system: System, got: Any, cause: Cause | None) -> None:
    said = f"Sur {STEPS} mesures simulées avec les bons Q et R."
    sheet.wrong("nis_moyen", TITLE, said, cause, expected=shown(_wanted(system)), got=shown(got))


def _wanted(system: System) -> float:
    return float(np.mean(_run(system)[0]))


def _is_right(system: System, got: Any) -> bool:
    value = _numbers(got)
    return value.size == 1 and bool(np.isclose(value.item(), _wanted(system), rtol=1e-6))


def _numbers(got: Any) -> Any:
    try:
        return np.asarray(got, float)
    except (TypeError, ValueError):
        return np.array([])


def _called(sheet: Sheet, function: Any, made: Any, system: System) -> Any:
    """With whichever way of handing over vectors runs; the first one's fault where none does."""
    fault: Stumble | None = None
    several: list[Any] = []
    for style in ("vecteurs", "colonnes", "nombres"):
        try:
            kf = sheet.call(made, *system.arguments(style))
            got = sheet.call(function, kf, *_lists(system, style))
        except Stumble as stumble:
            fault = fault or stumble
            continue
        if np.size(got) == 1 and got is not None:
            return got
        several.append(got)
    if fault is not None and not several:
        raise fault
    return several[0]


def _lists(system: System, style: str) -> tuple[list[Any], list[Any]]:
    return [styled(z, style) for z in system.measurements], [styled(u, style) for u in system.commands]


def _run(system: System, *, predicts: int = 1, commands: bool = True, late: bool = False) -> Run:
    """NIS and normalised innovations of the reference, (N,) each, with a habit that is wrong."""
    kf = ReferenceKalman(system, "blanchie")
    white = []
    for u, z in zip(system.commands, system.measurements, strict=True):
        for _ in range(0 if late else predicts):
            kf.predire(u if commands else None)
        white.append(kf.corriger(z).item())
        if late:
            kf.predire(u)
    found = np.array(white)
    return found**2, found


SIMPLE: dict[Cause, Callable[[Run], Any]] = {
    Cause("moyenne sans carré", "l'innovation normalisée a des deux signes : c'est son carré qui vaut 1 "
          "en moyenne."): lambda r: r[1].mean(),
    Cause("valeur absolue au lieu du carré", "le NIS est le carré de l'innovation normalisée."): lambda r: (
        np.abs(r[1]).mean()
    ),
    Cause("somme au lieu de la moyenne", "divisez par le nombre de mesures (np.mean)."): lambda r: r[0].sum(),
    Cause("racine du NIS moyen", "rendez la moyenne des NIS, sans racine."): lambda r: np.sqrt(r[0].mean()),
    Cause("NIS élevé au carré deux fois", "corriger rend déjà un carré : moyennez-le tel quel."): lambda r: (
        (r[0] ** 2).mean()
    ),
    Cause("médiane au lieu de la moyenne", "c'est la moyenne qui vaut 1 : np.mean."): lambda r: (
        np.median(r[0])
    ),
    Cause("variance au lieu du carré moyen", "np.var retranche la moyenne ; prenez la moyenne des carrés."):
        lambda r: r[1].var(),
    Cause("dernière mesure seulement", "gardez tous les NIS, puis moyennez."): lambda r: r[0][-1],
    Cause("mauvais diviseur", "divisez par le nombre de mesures, len(mesures)."): lambda r: (
        r[0].sum() / (len(r[0]) - 1)
    ),
}  # fmt: skip
HABITS: dict[Cause, dict[str, Any]] = {
    Cause("predire oublié", "pour chaque mesure : kf.predire(u), puis kf.corriger(z)."): {"predicts": 0},
    Cause("commandes oubliées", "donnez à predire la commande de ce pas : kf.predire(commandes[k])."): {
        "commands": False
    },
    Cause("corriger avant predire", "pour chaque mesure : d'abord kf.predire(u), puis kf.corriger(z)."): {
        "late": True
    },
    Cause("predire appelé deux fois", "une seule prédiction par mesure."): {"predicts": 2},
}


def _named(system: System, got: Any) -> Cause | None:
    """The mistake that gives this number."""
    value = _numbers(got)
    if got is None:
        return Cause("return oublié", "terminez nis_moyen par return.")
    right = _run(system)
    if value.size == STEPS and np.allclose(value.ravel(), right[0]):
        return Cause("liste au lieu de la moyenne", "rendez un seul nombre : np.mean de la liste.")
    if value.size != 1:
        return None
    number = value.item()
    for cause, form in SIMPLE.items():
        if np.isclose(number, form(right), rtol=1e-6):
            return cause
    for cause, habit in HABITS.items():
        if np.isclose(number, _run(system, **habit)[0].mean(), rtol=1e-6):
            return cause
    return None
