"""What `corriger` may return: forms in which a normalised innovation is right, wrong ones with names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from factorlab.l19.exercises.finding import Cause
from factorlab.l19.exercises.kalman_driver import Stage
from factorlab.l19.exercises.kalman_systems import Array, System

__all__ = ["NIS", "Parts", "misread", "read_innovation"]

NIS = "le NIS, νᵀ S⁻¹ ν"


class Parts:
    """The innovation of a stage, its covariance, and the same after the correction."""

    def __init__(self, system: System, stage: Stage) -> None:
        s = system
        self.system = s
        self.v = stage.given - s.H @ stage.x
        self.S = s.H @ stage.P @ s.H.T + s.R
        self.after_v = stage.given - s.H @ stage.after_x
        self.after_S = s.H @ stage.after_P @ s.H.T + s.R
        self.nis = float(self.v @ np.linalg.solve(self.S, self.v))


def _same(value: Array, wanted: Any) -> bool:
    wanted = np.ravel(wanted)
    return value.size == wanted.size and bool(np.allclose(value, wanted, rtol=1e-6, atol=1e-9))


RIGHT: dict[str, Callable[[Array, Parts], bool]] = {
    NIS: lambda r, p: _same(r, p.nis),
    "le NIS par composante": lambda r, p: _same(r, p.nis / len(p.v)),
    "l'innovation divisée par son écart-type, ν/√S": lambda r, p: _same(r, p.v / np.sqrt(np.diag(p.S))),
    "l'innovation blanchie, S^(-1/2) ν": lambda r, p: r.size == len(p.v) and _same(r @ r[:, None], p.nis),
    "la racine du NIS": lambda r, p: _same(r, np.sqrt(p.nis)),
}
BARE = "l'innovation n'est pas normalisée"
DIVIDE = "divisez par ce que l'on attend d'elle : νᵀ S⁻¹ ν, avec S = H P Hᵀ + R calculée avant de corriger P."
WRONG: dict[Cause, Callable[[Parts], Any]] = {
    Cause(BARE, DIVIDE): lambda p: p.v,
    Cause(f"{BARE} (signe changé)", DIVIDE): lambda p: -p.v,
    Cause("NIS non normalisé (ν² au lieu de ν²/S)", DIVIDE): lambda p: p.v @ p.v,
    Cause("NIS avec la S d'après la correction", DIVIDE): lambda p: p.v @ np.linalg.solve(p.after_S, p.v),
    Cause("ν/√S avec la S d'après la correction", DIVIDE): lambda p: p.v / np.sqrt(np.diag(p.after_S)),
    Cause("innovation calculée après la correction", "ν = z - H x vient avant de changer x."): lambda p: (
        p.after_v @ np.linalg.solve(p.S, p.after_v)
    ),
    Cause("résidu d'après la correction", "ν = z - H x se calcule avant de changer x."): lambda p: p.after_v,
    Cause("résidu d'après la correction, divisé par √S", "ν = z - H x se calcule avant de changer x."):
        lambda p: p.after_v / np.sqrt(np.diag(p.S)),
    Cause("tout calculé après la correction", "ν et S se calculent avant de changer x et P."): lambda p: (
        p.after_v @ np.linalg.solve(p.after_S, p.after_v)
    ),
    Cause("ν/S au lieu de ν/√S", "S est une variance : divisez ν par √S, ou rendez ν²/S."): lambda p: (
        np.linalg.solve(p.S, p.v)
    ),
    Cause("normalisée par R seulement", "la prévision se trompe aussi : S = H P Hᵀ + R."): lambda p: (
        p.v @ np.linalg.solve(p.system.R, p.v)
    ),
    Cause("normalisée par √R seulement", "la prévision se trompe aussi : S = H P Hᵀ + R."): lambda p: (
        p.v / np.sqrt(np.diag(p.system.R))
    ),
    Cause("normalisée sans R", "S = H P Hᵀ + R : le bruit du capteur en fait partie."): lambda p: (
        p.v @ np.linalg.pinv(p.S - p.system.R) @ p.v
    ),
    Cause("NIS multiplié par S au lieu d'être divisé", DIVIDE): lambda p: p.v @ p.S @ p.v,
    Cause("S rendue au lieu du NIS", DIVIDE): lambda p: p.S,
}  # fmt: skip


def read_innovation(pairs: list[tuple[Any, Parts]]) -> str | None:
    """The right form that all returned values have, or None; an element of a tuple will do."""
    for form, right in RIGHT.items():
        for pick in _picks(pairs):
            if pick and all(right(r, p) for r, p in zip(pick, (p for _, p in pairs), strict=True)):
                return form
    for pick in _picks(pairs):
        signed = [-r for r in pick]
        form = "l'innovation divisée par son écart-type, ν/√S"
        if signed and all(RIGHT[form](r, p) for r, (_, p) in zip(signed, pairs, strict=True)):
            return f"{form}, au signe près"
    return None


def misread(pairs: list[tuple[Any, Parts]]) -> Cause | None:
    """The wrong form by its name, or None."""
    if all(r is None for r, _ in pairs):
        return Cause("return oublié", "terminez corriger par `return` suivi du NIS, νᵀ S⁻¹ ν.")
    for pick in _picks(pairs):
        for cause, form in WRONG.items():
            if pick and all(_same(r, form(p)) for r, (_, p) in zip(pick, pairs, strict=True)):
                return cause
    return None


def _picks(pairs: list[tuple[Any, Parts]]) -> list[list[Array]]:
    """The returned values as vectors; where they are tuples, each of their places in turn."""
    values = [r for r, _ in pairs]
    if values and all(isinstance(r, tuple) and len(r) == len(values[0]) for r in values):
        picks = [[r[k] for r in values] for k in range(len(values[0]))]
    else:
        picks = [values]
    return [found for found in map(_vectors, picks) if found]


def _vectors(values: list[Any]) -> list[Array]:
    try:
        return [np.ravel(np.asarray(r, float)) for r in values if r is not None]
    except (TypeError, ValueError):
        return []
