"""K3, where a file offers it: an angle folded into ]-π, π], alone, in an innovation, or in a filter.

Recognised are a function that folds (`replier(angle)`), one that compares two angles
(`innovation(z, prevu)`), and a filter of headings with the arguments of `Kalman` (`KalmanAngle`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.kalman_driver import Driver, NoStateError
from factorlab.l19.exercises.kalman_systems import System
from factorlab.l19.exercises.signatures import imported, signature_fault

__all__ = ["FILTERS", "FOLDS", "INNOVATIONS", "check"]

FOLDS = ("replier", "replier_angle", "normaliser_angle", "wrap", "wrap_angle", "wrap_to_pi")
INNOVATIONS = ("innovation", "innovation_angle", "difference_angle", "ecart_angle")
FILTERS = ("KalmanAngle", "EKF", "KalmanEtendu")
TITLE = "l'angle est replié dans ]-π, π]"
FOLD = "repliez la différence : (a + π) % (2π) - π, ou atan2(sin a, cos a)."
UNWRAPPED = Cause("angle pas replié", f"de 179° à -179° il y a 2°, et non -358° ; {FOLD}")
ANGLES = np.array([0.3, 3.5, -3.5, 7.0, -7.0, 20.0, -100.0, 200.0])


def _folded(a: Any) -> Any:
    return np.arctan2(np.sin(a), np.cos(a))


WRONG: dict[Cause, Callable[[Any], Any]] = {
    UNWRAPPED: lambda a: a,
    Cause("replié dans [0, 2π[", f"une petite erreur négative devient presque un tour ; {FOLD}"): lambda a: (
        a % (2 * np.pi)
    ),
    Cause("replié d'un seul tour", f"un seul if ne suffit pas au-delà de 3π : while, ou {FOLD}"): lambda a: (
        np.where(a > np.pi, a - 2 * np.pi, np.where(a < -np.pi, a + 2 * np.pi, a))
    ),
    Cause("replié d'un seul côté", f"les angles sous -π aussi ; {FOLD}"): lambda a: np.where(
        a > np.pi, a - 2 * np.pi * np.ceil((a - np.pi) / (2 * np.pi)), a
    ),
    Cause("degrés au lieu de radians", "les angles du cours sont en radians : 2π, et non 360."): lambda a: (
        (a + 180) % 360 - 180
    ),
    Cause("replié dans [-π/2, π/2]", "atan perd le côté : atan2(sin a, cos a)."): lambda a: np.arctan(
        np.tan(a)
    ),
}


def check(sheet: Sheet) -> None:
    """Every check of K3 on the names of a file."""
    for names, judge in ((FOLDS, _check_fold), (INNOVATIONS, _check_innovation), (FILTERS, _check_filter)):
        name = next((one for one in names if callable(sheet.names.get(one))), None)
        if name is not None:
            judge(sheet, name, sheet.names[name])


def _check_fold(sheet: Sheet, name: str, function: Callable[..., Any]) -> None:
    title = f"{name} : {TITLE}"
    try:
        got = np.array([float(np.squeeze(sheet.call(function, float(a)))) for a in ANGLES])
    except Stumble as stumble:
        sheet.stumbled(name, title, stumble.fault)
        return
    except (TypeError, ValueError):
        sheet.wrong(name, title, f"`{name}` ne rend pas un nombre.")
        return
    if np.allclose(got, _folded(ANGLES), atol=1e-9):
        sheet.passed(name, title)
        return
    cause = next((c for c, f in WRONG.items() if np.allclose(got, f(ANGLES), atol=1e-9)), None)
    at = int(np.argmax(np.abs(got - _folded(ANGLES))))
    sheet.wrong(
        name, title, "L'angle rendu n'est pas entre -π et π, ou n'est plus le même.", cause,
        expected=f"{name}({shown(ANGLES[at])}) = {shown(_folded(ANGLES[at]))}", got=shown(got[at]),
        example=f"{imported(sheet.module, name)}\n{name}({shown(ANGLES[at])})",
    )  # fmt: skip


def _check_innovation(sheet: Sheet, name: str, function: Callable[..., Any]) -> None:
    title = f"{name} : {TITLE}"
    z, foreseen = np.radians([-179.0, 179.0, 10.0]), np.radians([179.0, -179.0, 30.0])
    wanted = _folded(z - foreseen)
    try:
        got = np.array([
            float(np.ravel(sheet.call(function, a, b))[0])
            for a, b in zip(z.tolist(), foreseen.tolist(), strict=True)
        ])  # fmt: skip
    except Stumble as stumble:
        sheet.stumbled(name, title, stumble.fault)
        return
    except (TypeError, ValueError):
        sheet.wrong(name, title, f"`{name}` ne rend pas un nombre.")
        return
    if np.allclose(got, wanted, atol=1e-9):
        sheet.passed(name, title)
        return
    known = {
        UNWRAPPED: z - foreseen,
        Cause("signe de l'innovation", "la mesure moins la prévision : replier(z - prevu)."): -wanted,
        Cause("valeur absolue", "l'innovation a un signe : replier(z - prevu)."): np.abs(wanted),
        Cause("replié dans [0, 2π[", FOLD): (z - foreseen) % (2 * np.pi),
    }
    cause = next((c for c, value in known.items() if np.allclose(got, value, atol=1e-9)), None)
    said = "Une mesure de -179° pour une prévision de 179°, c'est 2° plus loin."
    sheet.wrong(name, title, said, cause, expected="2°", got=f"{shown(float(np.degrees(got[0])))}°",
                example=f"import numpy as np\n{imported(sheet.module, name)}\n"
                        f"np.degrees({name}(np.radians(-179), np.radians(179)))")  # fmt: skip


def _check_filter(sheet: Sheet, name: str, made: Any) -> None:
    """A heading near 180°, measured on the other side: the state stays near 180°."""
    title = f"{name} : {TITLE}"
    if signature_fault(made, ("F", "B", "H", "Q", "R", "x0", "P0")):
        said = (
            f"`{name}` n'a pas les arguments de Kalman (F, B, H, Q, R, x0, P0) : elle n'est pas jugée ; une "
            "fonction `innovation(z, prevu)` le serait."
        )
        sheet.remark(name, title, said)
        return
    one, start = np.array([[1.0]]), np.radians([179.0])
    system = System(one, one, one, 0.0 * one, one, start, one, np.zeros((1, 1)), np.radians([[-179.0]]))
    try:
        driver = Driver(made, sheet.call, system, "vecteurs")
        driver.predict(system.commands[0])
        stage = driver.correct(system.measurements[0])
        heading = float(np.squeeze(stage.after_x))
    except Stumble as stumble:
        sheet.stumbled(name, title, stumble.fault)
        return
    except (NoStateError, TypeError, ValueError):
        sheet.remark(
            name, title, f"Je ne trouve pas l'état de `{name}` (self.x, self.P) : elle n'est pas jugée."
        )
        return
    if abs(_folded(heading - np.pi)) < 1e-6:
        sheet.passed(name, title)
        return
    cause = UNWRAPPED if abs(_folded(heading)) < 1e-6 else None
    said = "Un cap de 179°, mesuré à -179° avec autant de confiance, est corrigé à 180°."
    sheet.wrong(name, title, said, cause, expected="180°", got=f"{float(np.degrees(heading)):.1f}°")
