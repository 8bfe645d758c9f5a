"""Noise that a reading shares with the step that led to it.

Where both are stirred by the same cause (a gust that pushes the vehicle and its anemometer), E[w vᵀ] = C.
The part of v that w explains, e with v = L e + v', becomes a part of the state, and v' is independent: every
filter, form and smoother then takes the model as it is, and the smoothers stay exact, which corrected gains
(Bar-Shalom, Li, Kirubarajan 2001, section 8.3) are not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, NotPositiveDefiniteError, ShapeError
from sequential.manifold import Product, Vector
from sequential.model import Gaussian, StateSpace
from sequential.models.declared import LinearSensor
from sequential.models.linear import LinearProcess

__all__ = ["correlated_noise"]

Array = NDArray[np.float64]
NOTHING = 1e-12  # directions of CᵀQ⁻¹C below this share of R are rounding


def correlated_noise(model: StateSpace, cross_cov: Mapping[str, ArrayLike]) -> StateSpace:
    """The same model with readings whose noise is correlated with that of the step that leads to them.

    Parameters
    ----------
    model : of a `LinearProcess` with constant matrices and `LinearSensor`s, on vectors
    cross_cov : by sensor, (n, m) covariance of a step's noise with the noise of a reading at its end

    Returns
    -------
    StateSpace
        on a product of "state", as before, and "shared", what each reading has in common with its step;
        `run.part("state")` gives the estimates.

    Raises
    ------
    ModelError
        where the model is not of that kind.
    ShapeError, NotPositiveDefiniteError
        where the covariances do not fit together: [[Q, C], [Cᵀ, R]] must be positive definite in R.
    """
    process = _require_constant(model)
    n = model.manifold.dim
    Q = np.asarray(process.Q, dtype=np.float64)
    if unknown := [name for name in cross_cov if name not in model.sensors]:
        raise ModelError(f"there is no sensor {unknown[0]!r}; the model has {', '.join(model.sensors)}")
    crossed = {
        name: _shared(model, name, np.asarray(C, dtype=np.float64), Q) for name, C in cross_cov.items()
    }
    sizes = {name: L.shape[1] for name, (L, _) in crossed.items()}
    extra = sum(sizes.values())
    if not extra:
        return model
    F, noise, cov = (np.zeros((n + extra, n + extra)) for _ in range(3))
    F[:n, :n] = np.asarray(process.F)
    noise[:n, :n], noise[n:, n:] = Q, np.eye(extra)
    cov[:n, :n], cov[n:, n:] = model.prior.cov, np.eye(extra)
    sensors, at = {}, n
    for name, sensor in model.sensors.items():
        assert isinstance(sensor, LinearSensor)  # noqa: S101 - looked at above
        m = sensor.manifold.dim
        matrix = np.hstack([np.asarray(sensor.matrix), np.zeros((m, extra))])
        own = sensor
        if name in crossed:
            L, link = crossed[name]
            span = slice(at, at + L.shape[1])
            matrix[:, span] = L
            noise[:n, span], noise[span, :n] = link, link.T
            own = replace(sensor, noise_cov=np.asarray(sensor.noise_cov) - L @ L.T)
            at = span.stop
        sensors[name] = replace(own, matrix=matrix)
    B = (
        None
        if process.B is None
        else np.vstack([np.asarray(process.B), np.zeros((extra, np.shape(process.B)[1]))])
    )
    mean = np.concatenate([model.prior.mean, np.zeros(extra)])
    return replace(
        model,
        manifold=Product(state=Vector(n), shared=Vector(extra)),
        prior=Gaussian(mean, cov),
        process=LinearProcess(F, noise, B),
        sensors=sensors,
    )


def _require_constant(model: StateSpace) -> LinearProcess:
    process = model.process
    if not isinstance(process, LinearProcess) or process.rows:
        raise ModelError(
            f"correlated noise is declared for each step of a LinearProcess with constant F and Q; this is "
            f"{'a tabulated one' if isinstance(process, LinearProcess) else type(process).__name__}"
        )
    other = [name for name, sensor in model.sensors.items() if not isinstance(sensor, LinearSensor)]
    if other:
        raise ModelError(f"correlated noise takes LinearSensors, and {other[0]!r} is none")
    return process


def _shared(model: StateSpace, name: str, C: Array, Q: Array) -> tuple[Array, Array]:
    """L (m, r) and the covariance (n, r) of w and e, with v = L e + v' and e of unit variance."""
    R = np.asarray(model.sensors[name].noise_cov, dtype=np.float64)
    C = C[:, None] if C.ndim == 1 else C
    if C.shape != (len(Q), len(R)):
        raise ShapeError(
            f"cross_cov[{name!r}] has shape {C.shape}; state and reading need {(len(Q), len(R))}"
        )
    inverse = np.linalg.pinv(Q, hermitian=True)
    if not np.allclose(Q @ inverse @ C, C, atol=1e-9 * max(np.abs(C).max(), 1e-300)):
        raise NotPositiveDefiniteError(
            f"cross_cov[{name!r}] couples the readings with directions that the process noise Q does not stir"
        )
    explained = C.T @ inverse @ C
    rest = np.linalg.eigvalsh(R - explained)
    if rest[0] <= NOTHING * np.trace(R):
        raise NotPositiveDefiniteError(
            f"cross_cov[{name!r}] explains more of the readings' noise than there is: R - CᵀQ⁻¹C has the "
            f"eigenvalue {rest[0]:.3g}; |C| is at most sqrt(Q R)"
        )
    values, vectors = np.linalg.eigh(explained)
    kept = values > NOTHING * np.trace(R)
    L = vectors[:, kept] * np.sqrt(values[kept])
    return L, C @ vectors[:, kept] / np.sqrt(values[kept])
