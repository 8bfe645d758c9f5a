"""What a student begins with: the public recording, a model for `factorlab tune`, a filter to fill in."""

from __future__ import annotations

import numpy as np

from factorlab.l19.challenge.trials import Trial

__all__ = ["FILTER", "LOG", "MODEL", "TUNE", "starting_files"]

LOG, MODEL, FILTER = "mesures.csv", "modele.py", "mon_filtre.py"
TUNE = f"factorlab tune {LOG} --model {MODEL}:modele --method nis"


def starting_files(trial: Trial) -> dict[str, str]:
    """Three files by name, for one folder."""
    R = float(np.var(trial.z[trial.rest], ddof=1))
    return {LOG: _log(trial), MODEL: _model(R, float(trial.z[0]), trial), FILTER: STARTER}


def _log(trial: Trial) -> str:
    rows = [f"{t:.0f},{z!r}" for t, z in zip(trial.t.tolist(), trial.z.tolist(), strict=True)]
    return "\n".join(["t,thermometre", *rows]) + "\n"


def _model(R: float, first: float, trial: Trial) -> str:
    return f'''"""Le modèle du défi D1 : température et pente ; q est le bouton que l'on règle.

    {TUNE}
"""

import sequential as sq

R = {R:.6g}  # °C², variance de 30 s de palier (t = {trial.rest.start} à {trial.rest.stop} s)
T0 = {first:.6g}  # °C, la première mesure


def modele(q=1e-3):
    thermometre = sq.LinearSensor([[1.0, 0.0]], R, gate=0.999)  # portillon de Mahalanobis à 99,9 %
    return sq.StateSpace(
        manifold=sq.Vector(2),
        prior=sq.Gaussian([T0, 0.0], [1.0, 0.25]),
        process=sq.ConstantVelocity(q),
        sensors={{"thermometre": thermometre}},
    )
'''


STARTER = f'''"""Défi D1 : mon filtre.  Pour le noter :    factorlab l19 defi {FILTER}

`filtrer(t, z)` reçoit les instants t (s) et les mesures z (°C), deux tableaux de N nombres, et renvoie N
estimations, ou un tableau (N, 2) : l'estimation et son écart-type σ.  L'estimation à l'instant t[k] ne doit
regarder que z[0] … z[k].
"""

import numpy as np


def filtrer(t, z):
    """Un passe-bas, pour commencer : y ← y + a (z - y)."""
    a = 0.2
    y, sorties = z[0], []
    for mesure in z:
        y = y + a * (mesure - y)
        sorties.append(y)
    return np.array(sorties)
'''
