"""The infrared curve v = a/(d + b) + c by least squares, right and wrong; calls that fit a signature."""

# ruff: noqa: ARG005 - the functions of a family take the same arguments, whether or not each reads all

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.exercises.finding import Cause

__all__ = ["DISTANCES", "FITS", "SIGMAS", "Array", "arguments_for", "fitted", "parameters_of", "volts"]

Array = NDArray[np.float64]
Triple = tuple[float, float, float]


def volts(d: Any, a: float, b: float, c: float) -> Any:
    """The reading at a distance."""
    return a / (np.asarray(d, float) + b) + c


def fitted(d: Array, v: Array, *, b: Sequence[float] | None = None, with_c: bool = True) -> Triple:
    """Least squares: for a given b, a and c are linear, so b alone is searched, finer and finer."""
    grid = np.array(b if b is not None else np.linspace(-0.9 * d.min(), 40, 200), float)
    centre = float(grid[0])
    for _ in range(1 if b is not None else 12):
        sums = [_linear(d, v, one, with_c)[1] for one in grid]
        best = int(np.argmin(sums))
        centre, width = float(grid[best]), (grid[1] - grid[0] if len(grid) > 1 else 0.0)
        if len(grid) > 1:
            grid = np.linspace(centre - width, centre + width, 21)
    (a, c), _ = _linear(d, v, centre, with_c)
    return a, float(centre), c


def _linear(d: Array, v: Array, b: float, with_c: bool) -> tuple[tuple[float, float], float]:  # noqa: FBT001
    columns = [1 / (d + b), np.ones_like(d)] if with_c else [1 / (d + b)]
    design = np.stack(columns, axis=1)
    found = np.linalg.lstsq(design, v, rcond=None)[0]
    rest = v - design @ found
    return (float(found[0]), float(found[1]) if with_c else 0.0), float(rest @ rest)


def _arranged(*places: int, sign: tuple[int, int, int] = (1, 1, 1)) -> Callable[[Array, Array], Triple]:
    """The right constants in another order, or with another sign."""

    def of(d: Array, v: Array) -> Triple:
        p = [one * s for one, s in zip(fitted(d, v), sign, strict=True)]
        return p[places[0]], p[places[1]], p[places[2]]

    return of


ORDER = "rendez les constantes dans l'ordre a, b, c."
FITS: dict[Cause, Callable[[Array, Array], Triple]] = {
    Cause("ordre des constantes", ORDER): _arranged(2, 0, 1),
    Cause("ordre des constantes (b avant a)", ORDER): _arranged(1, 0, 2),
    Cause("ordre des constantes (c avant b)", ORDER): _arranged(0, 2, 1),
    Cause("ordre des constantes (c, b, a)", ORDER): _arranged(2, 1, 0),
    Cause("ordre des constantes (b, c, a)", ORDER): _arranged(1, 2, 0),
    Cause("signe de b", "la courbe est a/(d + b) + c, et non a/(d - b) + c."): _arranged(
        0, 1, 2, sign=(1, -1, 1)
    ),
    Cause("signe de c", "la courbe est a/(d + b) + c, et non a/(d + b) - c."): _arranged(
        0, 1, 2, sign=(1, 1, -1)
    ),
    Cause("b oubliée dans l'ajustement", "trois constantes : v = a/(d + b) + c."): lambda d, v: fitted(
        d, v, b=[0.0]
    ),
    Cause("c oubliée dans l'ajustement", "trois constantes : v = a/(d + b) + c."): lambda d, v: fitted(
        d, v, with_c=False
    ),
    Cause("ajustement de a/d seulement", "trois constantes : v = a/(d + b) + c."): lambda d, v: fitted(
        d, v, b=[0.0], with_c=False
    ),
    Cause("d et v échangés", "ajuster(d, v) : v est la tension, v = a/(d + b) + c."): lambda d, v: fitted(
        v, d
    ),
}

INVERSE = "d = a/(v - c) - b."
DISTANCES: dict[Cause, Callable[[Array, float, float, float], Array]] = {
    Cause("b oubliée", INVERSE): lambda v, a, b, c: a / (v - c),
    Cause("signe de b", INVERSE): lambda v, a, b, c: a / (v - c) + b,
    Cause("c oubliée", INVERSE): lambda v, a, b, c: a / v - b,
    Cause("signe de c", INVERSE): lambda v, a, b, c: a / (v + c) - b,
    Cause("fraction renversée", INVERSE): lambda v, a, b, c: (v - c) / a - b,
    Cause("formule directe au lieu de son inverse", f"résolvez v = a/(d + b) + c pour d : {INVERSE}"): volts,
    Cause("parenthèses", INVERSE): lambda v, a, b, c: a / (v - c - b),
    Cause("a oubliée", INVERSE): lambda v, a, b, c: 1 / (v - c) - b,
    Cause("rapport sans b ni c", INVERSE): lambda v, a, b, c: a / v,
}

SPREAD = "σ_d = |∂d/∂v| σ_v = a/(v - c)² σ_v, c'est-à-dire (d + b)²/a σ_v."
SIGMAS: dict[Cause, Callable[[Array, float, float, float, float], Array]] = {
    Cause("incertitude sans la dérivée", f"la tension bouge de σ_v, et la distance de {SPREAD}"): (
        lambda v, a, b, c, s: np.full_like(v, s)
    ),
    Cause("dérivée à l'envers", f"∂v/∂d est l'inverse de ce qu'il faut ; {SPREAD}"): (
        lambda v, a, b, c, s: (v - c) ** 2 / a * s
    ),
    Cause("carré oublié", SPREAD): lambda v, a, b, c, s: a / (v - c) * s,
    Cause("variance au lieu de l'écart-type", f"prenez la racine ; {SPREAD}"): lambda v, a, b, c, s: (
        (a / (v - c) ** 2 * s) ** 2
    ),
    Cause("signe de la dérivée", f"un écart-type est positif ; {SPREAD}"): lambda v, a, b, c, s: (
        -a / (v - c) ** 2 * s
    ),
    Cause("b oubliée dans la dérivée", SPREAD): lambda v, a, b, c, s: (a / (v - c) - b) ** 2 / a * s,
    Cause("c oubliée dans la dérivée", SPREAD): lambda v, a, b, c, s: a / v**2 * s,
    Cause("a oubliée dans la dérivée", SPREAD): lambda v, a, b, c, s: s / (v - c) ** 2,
    Cause("a au carré", SPREAD): lambda v, a, b, c, s: (a / (v - c)) ** 2 * s,
    Cause("σ_v oublié", SPREAD): lambda v, a, b, c, s: a / (v - c) ** 2,
    Cause("variance de la tension au lieu de σ_v", SPREAD): lambda v, a, b, c, s: a / (v - c) ** 2 * s**2,
    Cause("erreur relative gardée", f"σ_d n'est pas proportionnel à d ; {SPREAD}"): lambda v, a, b, c, s: (
        (a / (v - c) - b) / v * s
    ),
}


def parameters_of(returned: Any) -> Triple | None:
    """a, b and c of whatever `ajuster` gave back: a row, a dictionary, an object, curve_fit's pair."""
    if isinstance(returned, dict):
        low = {str(key).lower(): value for key, value in returned.items()}
        return _triple([low.get(name) for name in "abc"])
    if all(hasattr(returned, name) for name in "abc"):
        return _triple([getattr(returned, name) for name in "abc"])
    if isinstance(returned, tuple) and returned and np.size(_plain(returned[0])) == 3:
        return _triple(np.ravel(_plain(returned[0])).tolist())
    row = _plain(returned)
    return _triple(np.ravel(row).tolist()[:3]) if np.size(row) >= 3 else None


def _plain(value: Any) -> Any:
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        pass
    try:
        return np.array([float(one) for one in list(value)[:3]])
    except (TypeError, ValueError):
        return np.array([])


def _triple(values: Sequence[Any]) -> Triple | None:
    try:
        a, b, c = (float(np.squeeze(np.asarray(one, float))) for one in values)
    except (TypeError, ValueError):
        return None
    return a, b, c


SIGMA_WORDS = (
    "sig",
    "std",
    "ecart",
    "écart",
    "bruit",
    "s_v",
    "sv",
    "u_v",
    "uv",
    "dv",
    "noise",
    "err",
    "incert",
)
COV_WORDS = ("cov", "pcov")


def arguments_for(function: Callable[..., Any], returned: Any, triple: Triple, sigma_v: float) -> list[Any]:
    """What to hand to `distance` or `incertitude_distance` after v, by the names of their arguments.

    a, b, c by their names; σ of the reading by a name such as sigma_v; anything else is what `ajuster` gave.

    Raises
    ------
    LookupError
        where an argument could be anything.
    """
    rest = list(inspect.signature(function).parameters.values())[1:]
    handed: list[Any] = []
    for parameter in rest:
        name = parameter.name.lower()
        if parameter.kind == parameter.VAR_POSITIONAL:
            return [*handed, *triple]
        if parameter.kind in {parameter.VAR_KEYWORD, parameter.KEYWORD_ONLY}:
            continue
        if name in {"a", "b", "c"}:
            handed.append(triple["abc".index(name)])
        elif name.startswith(COV_WORDS):
            handed.append(_covariance(returned))
        elif name.startswith(SIGMA_WORDS):
            handed.append(sigma_v)
        elif parameter.default is not parameter.empty:
            break
        elif any(one is returned for one in handed):
            raise LookupError(parameter.name)
        else:
            handed.append(_constants(returned))
    return handed


def _constants(returned: Any) -> Any:
    """What `ajuster` gave; of curve_fit's pair, the constants."""
    pair = isinstance(returned, tuple) and len(returned) == 2 and np.size(_plain(returned[0])) == 3
    return returned[0] if pair else returned


def _covariance(returned: Any) -> Any:
    """Constants taken as known, so that the reading alone is uncertain."""
    return np.zeros((3, 3))
