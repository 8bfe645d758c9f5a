"""E1, once the equations are right: the statement's own checks, and habits that will bite later."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet
from factorlab.l19.exercises.kalman_diagnosis import ARGUMENTS
from factorlab.l19.exercises.kalman_driver import Driver
from factorlab.l19.exercises.kalman_systems import EXAMPLE, System, constant_velocity

__all__ = ["check_habits"]

STEPS = 800


def check_habits(sheet: Sheet, made: Any) -> None:
    """P converges, the NIS tells a wrong R, the arguments stay as they were, B may be None."""
    _arguments(sheet, made)
    _without_command(sheet, made)
    try:
        _statement(sheet, made)
    except Stumble as stumble:
        sheet.stumbled("converge", "P converge, le NIS vaut 1", stumble.fault)


def _arguments(sheet: Sheet, made: Any) -> None:
    """What a filter is built from belongs to the caller."""
    title = "les arguments restent intacts"
    for style in ("vecteurs", "colonnes"):
        given = EXAMPLE.arguments(style)
        try:
            kf = sheet.call(made, *given)
            z = EXAMPLE.measurements[0].copy()
            for _ in range(2):
                sheet.call(kf.predire, EXAMPLE.commands[0].copy())
                sheet.call(kf.corriger, z)
        except Stumble:
            continue
        for name, now, before in zip(ARGUMENTS, given, EXAMPLE.arguments(style), strict=True):
            if not np.array_equal(now, before):
                cause = Cause("argument modifié", f"`+=` change le tableau reçu : gardez une copie, "
                              f"np.array({name}, float) dans __init__, ou écrivez x = x + …")  # fmt: skip
                sheet.wrong("arguments", title, f"Après predire et corriger, le `{name}` donné à Kalman a "
                            "changé : un deuxième filtre partirait de là.", cause)  # fmt: skip
                return
        if not np.array_equal(z, EXAMPLE.measurements[0]):
            cause = Cause("argument modifié", "écrivez nu = z - H @ x, sans z -= …")
            sheet.wrong("arguments", title, "`corriger` change la mesure z qu'on lui donne.", cause)
            return
    sheet.passed("arguments", title)


def _without_command(sheet: Sheet, made: Any) -> None:
    """A system without a command: B None, or B of zeros."""
    title = "sans commande"
    F, _, H, Q, R, x0, P0 = EXAMPLE.arguments("vecteurs")
    wanted = F @ x0
    for given, how in (((None,), "predire(None)"), ((), "predire()")):
        for B in (None, np.zeros((2, 1))):
            try:
                kf = sheet.call(made, F, B, H, Q, R, x0.copy(), P0)
                sheet.call(kf.predire, *given)
                if np.allclose(np.ravel(getattr(kf, "x", wanted)), wanted):
                    sheet.passed("sans_commande", title, f"B = {'None' if B is None else '0'}, {how}.")
                    return
            except Stumble:
                continue
    said = (
        "Un système sans commande (B = None, u = None) arrête votre classe : `def predire(self, u=None)` et "
        "un `if` sur u la rendraient plus commode."
    )
    sheet.remark("sans_commande", title, said)


def _statement(sheet: Sheet, made: Any) -> None:
    """What the statement itself asks to look at, told with its numbers."""
    system = constant_velocity(STEPS, np.random.default_rng(7))
    means, P = {}, []
    for factor in (1.0, 0.1):
        told = System(**{**vars(system), "R": factor * system.R})
        driver = _driver(sheet, made, told)
        nis = []
        for u, z in zip(told.commands, told.measurements, strict=True):
            before = driver.predict(u)
            stage = driver.correct(z)
            v = z - told.H @ before.after_x
            nis.append(float(v @ np.linalg.solve(told.H @ before.after_P @ told.H.T + told.R, v)))
            if factor == 1.0:
                P.append(float(stage.after_P[0, 0]))
        means[factor] = float(np.mean(nis))
    sigma = np.sqrt(P)
    settled = int(np.argmax(np.abs(sigma - sigma[-1]) < 0.01 * sigma[-1]))
    numbers = f"{sigma[-1]:.3f} m, {means[1.0]:.2f}, {means[0.1]:.2f}".split(", ")
    converged, one, small = (number.replace(".", ",") for number in numbers)
    sheet.passed(
        "converge", "P converge", f"σ de la position : {converged} après {settled} pas, puis constant."
    )
    sheet.passed("nis", "le NIS dit si R est juste",
                 f"NIS moyen {one} avec le bon R, {small} avec R dix fois trop petit.")  # fmt: skip


def _driver(sheet: Sheet, made: Any, system: System) -> Driver:
    for style in ("vecteurs", "colonnes"):
        try:
            driver = Driver(made, sheet.call, system, style)
            trial = Driver(made, sheet.call, system, style)
            trial.predict(system.commands[0])
            stage = trial.correct(system.measurements[0])
        except Stumble:
            continue
        if stage.after_x.shape == (2,) and stage.after_P.shape == (2, 2):
            return driver
    return Driver(made, sheet.call, system, "nombres")
