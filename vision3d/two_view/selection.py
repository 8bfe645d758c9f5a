"""Which story two pictures tell: a motion in space, a plane, or a camera that only turned.

Torr's criterion for geometric models adds to the robust misfit what a model costs in points and parameters:
a plane explains the pairs on it as well as an essential matrix does, with two errors each instead of one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vision3d.camera import Array

__all__ = ["CHANCE_LOG10", "GRIC_MODELS", "Criterion", "choose_model", "gric", "log10_false_alarms"]

GRIC_MODELS = {"general": (3, 5), "planar": (2, 8), "pure rotation": (2, 3)}
"""Dimension of the manifold of pairs, and number of parameters: calibrated cameras, so five for E."""
PAIR_DIM = 4
MORE = {"general": (2, 1), "planar": (3, 2)}
"""Pairs that a model can always win beyond a simpler one, and coordinates of its errors."""
WITHIN_SIGMAS = 3.0
CHANCE_LOG10 = -2.0
"""Fewer models as good than one in a hundred, by chance: no accident."""


@dataclass(frozen=True, slots=True)
class Criterion:
    """Torr's criterion of each model, least is best, and the model that was chosen by it.

    Parameters
    ----------
    general, planar, rotation : the criterion of an essential matrix, a plane's homography, a rotation
    best : "general", "planar" or "pure rotation": the least of them, unless what it explains more than a
        simpler one is no more than chance brings
    """

    general: float
    planar: float
    rotation: float
    best: str


def choose_model(
    squared: dict[str, Array], sigma: float, threshold: float, size: tuple[int, int]
) -> Criterion:
    """The model of least criterion that explains more than a simpler one does by more than chance.

    Parameters
    ----------
    squared : (N,) squared Sampson distances, px², of "general", "planar" and "pure rotation"
    sigma, threshold : noise, and distance up to which a pair agrees with a line, px
    size : (width, height) of picture b
    """
    limit = min(threshold, WITHIN_SIGMAS * sigma) ** 2
    agree = {name: values < limit * (PAIR_DIM - GRIC_MODELS[name][0]) for name, values in squared.items()}
    some = np.any(list(agree.values()), axis=0)  # wrong matches prefer none
    values = {name: gric(one[some], name, sigma) for name, one in squared.items()}
    best = min(values, key=lambda name: values[name])
    for simple in sorted(values, key=lambda name: values[name]):
        if _simpler(simple, best):
            own = agree[simple]
            enough = gric(squared[simple][own], simple, sigma) < gric(squared[best][own], best, sigma)
            sample, dims = MORE[best]
            more, _ = log10_false_alarms(squared[best][~own], sample, 1, size, dims=dims)
            if own.any() and enough and more > CHANCE_LOG10:
                best = simple
    return Criterion(values["general"], values["planar"], values["pure rotation"], best)


def _simpler(one: str, other: str) -> bool:
    order = list(GRIC_MODELS)
    return order.index(one) > order.index(other)


def gric(squared: Array, model: str, sigma: float = 1.0) -> float:
    """Torr's criterion of a model with squared Sampson distances (N,), noise sigma in their unit.

    Sum of min(e²/σ², 2 (r - d)) + d N log r + k log(r N), with r = 4 the dimension of a pair.
    Torr 1998, "Geometric motion segmentation and model selection".
    """
    dim, parameters = GRIC_MODELS[model]
    misfit = np.minimum(squared / sigma**2, 2.0 * (PAIR_DIM - dim)).sum()
    n = max(len(squared), 1)
    return float(misfit + dim * n * np.log(PAIR_DIM) + parameters * np.log(PAIR_DIM * n))


def log10_false_alarms(
    squared_px: Array, sample: int, models: int, size: tuple[int, int], *, dims: int = 1
) -> tuple[float, int]:
    """How many models as good as this one chance would bring, log10, and with how many pairs.

    Were the pixels of b anywhere in their picture, a distance below e would have the probability of a band
    (dims = 1, to a line) or of a disc (dims = 2, to a point); the least expectation over all thresholds is
    given.  Below -2 or so chance is no explanation.  Moisan, Stival 2004, "A probabilistic criterion to
    detect rigid point matches between two images and estimate the fundamental matrix".

    Parameters
    ----------
    squared_px : (N,) squared distances, px²
    sample, models : pairs in a minimal sample, and models that one gives at most
    size : (width, height) of picture b
    """
    n = len(squared_px)
    if n <= sample:
        return np.inf, n
    width, height = size
    # Sampson's distance divides by the noise of both pictures, √2 times that of one
    error = np.sqrt(2.0 * np.maximum(np.sort(squared_px), 1e-12))
    if dims == 1:
        chance = 2.0 * error * np.hypot(width, height) / (width * height)
    else:
        chance = np.pi * error**2 / (width * height)
    k = np.arange(sample + 1, n + 1)
    log_chance = np.log10(np.clip(chance[sample:], 1e-12, 1.0))
    ways = _log10_choose(n, k) + _log10_choose(k, np.array(sample))
    expected = np.log10(models * (n - sample)) + ways + (k - sample) * log_chance
    best = int(np.argmin(expected))
    return float(expected[best]), int(k[best])


def _log10_choose(n: Any, k: Any) -> Any:
    from scipy.special import gammaln

    whole = np.asarray(n)
    return (gammaln(whole + 1.0) - gammaln(k + 1.0) - gammaln(whole - k + 1.0)) / np.log(10.0)
