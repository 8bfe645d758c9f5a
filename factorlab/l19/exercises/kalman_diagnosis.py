"""Comparing what a student's filter did with the right one and with the wrong ones that have names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from factorlab.l19.exercises.finding import Cause, shown
from factorlab.l19.exercises.kalman_driver import Drive, Stage
from factorlab.l19.exercises.kalman_mutants import PREDICTED_COV, PREDICTED_STATE, Update, updates
from factorlab.l19.exercises.kalman_systems import Array, System
from factorlab.l19.exercises.signatures import imported

__all__ = [
    "ARGUMENTS",
    "ELEMENTWISE",
    "close",
    "correction_causes",
    "example_lines",
    "predicted_cause",
    "right_after",
]

ELEMENTWISE = Cause(
    "produit élément par élément", "en NumPy `*` multiplie case par case ; le produit de matrices s'écrit @."
)
RTOL = 1e-6
ARGUMENTS = ("F", "B", "H", "Q", "R", "x0", "P0")


def close(got: Array, wanted: Array) -> bool:
    """Equal to 1e-6."""
    return np.shape(got) == np.shape(wanted) and bool(np.allclose(got, wanted, rtol=RTOL, atol=1e-9))


def right_after(system: System, stage: Stage) -> tuple[Array, Array]:
    """Where the call should have led from the state that it began with."""
    s = system
    if stage.kind == "predire":
        pushed = 0.0 if s.B is None else s.B @ stage.given
        return s.F @ stage.x + pushed, s.F @ stage.P @ s.F.T + s.Q
    return Update(())(s, stage.x, stage.P, stage.given)


def predicted_cause(drives: list[Drive], part: str) -> Cause | None:
    """The named mistake that gives the student's prediction of x, or of P, in every drive."""
    pairs = [(d.system, s) for d in drives for s in d.of("predire")]
    got = [s.after_x if part == "x" else s.after_P for _, s in pairs]
    if any(
        g.shape != (s.x.shape if part == "x" else s.P.shape) for g, (_, s) in zip(got, pairs, strict=True)
    ):
        return ELEMENTWISE
    family: Mapping[Cause, Callable[..., Array]] = PREDICTED_STATE if part == "x" else PREDICTED_COV
    for cause, wrong in family.items():
        made = [
            _tried(wrong, system, s.x, s.given) if part == "x" else _tried(wrong, system, s.P)
            for system, s in pairs
        ]
        if _agree(got, made):
            return cause
    return None


def correction_causes(drives: list[Drive]) -> tuple[Cause, ...] | None:
    """The named mistakes, one or two, that give the student's corrections in every drive; () where right."""
    pairs = [(d.system, s) for d in drives for s in d.of("corriger")]
    if not pairs:
        return None
    if any(s.after_x.shape != s.x.shape or s.after_P.shape != s.P.shape for _, s in pairs):
        return (ELEMENTWISE,)
    for wrong in updates():
        made = [_tried(wrong, system, s.x, s.P, s.given) for system, s in pairs]
        if not any(isinstance(m, tuple) for m in made):
            continue
        both = [(m[0], m[1]) if isinstance(m, tuple) else (None, None) for m in made]
        if _agree([s.after_x for _, s in pairs], [x for x, _ in both]) and _agree(
            [s.after_P for _, s in pairs], [P for _, P in both]
        ):
            return wrong.causes
    return None


def _tried(wrong: Callable[..., Any], *args: Any) -> Any:
    try:
        with np.errstate(all="ignore"):
            return wrong(*args)
    except (ValueError, np.linalg.LinAlgError):
        return None


def _agree(got: list[Array], made: list[Any]) -> bool:
    """Wherever the student's call came back, the wrong filter gives the same numbers."""
    return all(m is not None and close(g, m) for g, m in zip(got, made, strict=True))


def example_lines(system: System, style: str, module: str, upto: str) -> str:
    """The small example as Python lines; it ends after the first `predire` or `corriger`."""
    rows = [
        "import numpy as np",
        imported(module, "Kalman"),
        *(
            f"{name} = {'None' if value is None else f'np.array({_typed(value)})'}"
            for name, value in zip(
                ["F", "B", "H", "Q", "R", "x0", "P0"], system.arguments(style), strict=True
            )
        ),
        "kf = Kalman(F, B, H, Q, R, x0, P0)",
        f"kf.predire({_handed(system.commands[0], style)})",
    ]
    if upto == "corriger":
        rows.append(f"r = kf.corriger({_handed(system.measurements[0], style)})")
    return "\n".join(rows)


def _handed(vector: Array, style: str) -> str:
    if style == "nombres" and len(vector) == 1:
        return shown(float(vector[0]))
    return f"np.array({_typed(vector[:, None] if style == 'colonnes' else vector)})"


def _typed(value: Array) -> str:
    """As shown, with a point in the first number: an array of floats."""
    if value.ndim > 1:
        return f"[{', '.join(_typed(row) for row in value)}]"
    return f"[{', '.join(f'{x:.4g}' if '.' in f'{x:.4g}' else f'{x:.4g}.' for x in value)}]"
