"""Where a Kalman filter settles: the covariances and the gain that no longer change from step to step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.directions import in_words, invariant_kernel
from sequential.errors import ModelError, ShapeError, SolverError
from sequential.model import Functions, StateSpace, evaluate

__all__ = ["SteadyState", "alpha_beta", "steady_state"]

Array = NDArray[np.float64]

ON_THE_CIRCLE = 1e-7  # |λ| closer to one than this neither grows nor decays


@dataclass(frozen=True, slots=True, eq=False)
class SteadyState:
    """A filter that has settled, for readings of all its sensors at once, one set at every step.

    `gain` and `matrix` have the sensors' rows one below the other, in the order of `StateSpace.sensors`.
    """

    predicted_cov: Array  # (d, d) before the readings
    cov: Array  # (d, d) after them
    gain: Array  # (d, m) of the update
    innovation_cov: Array  # (m, m)
    transition: Array  # (d, d) F of one step
    process_cov: Array  # (d, d) Q of one step
    matrix: Array  # (m, d) H
    settles: float  # steps in which what is left of a wrong start falls to 1/e

    def predictor_gain(self, cross_cov: ArrayLike | None = None) -> Array:
        """(d, m) gain of the one-step predictor: (F P Hᵀ + S) (H P Hᵀ + R)⁻¹."""
        crossed = self.transition @ self.predicted_cov @ self.matrix.T
        if cross_cov is not None:
            crossed = crossed + np.asarray(cross_cov, dtype=np.float64)
        return np.asarray(np.linalg.solve(self.innovation_cov, crossed.T).T)


def steady_state(model: StateSpace, dt: float, *, cross_cov: ArrayLike | None = None) -> SteadyState:
    """Solve the discrete algebraic Riccati equation of a linear, time-invariant model.

    Parameters
    ----------
    dt : s, from one set of readings to the next
    cross_cov : (d, m) covariance S of the noise of a step with the noise of the readings at its beginning

    Returns
    -------
    SteadyState

    Raises
    ------
    NonlinearModelError
        where the model is not linear.
    ModelError
        where it changes with time, where a direction that does not decay is never seen, or where one is that
        no noise disturbs, which is learnt for ever; the message names the direction.
    SolverError
        where the equation could not be solved to rounding.

    Notes
    -----
    P = F P Fᵀ + Q - (F P Hᵀ + S)(H P Hᵀ + R)⁻¹(F P Hᵀ + S)ᵀ, solved in units of the prior (Anderson and Moore
    1979, Optimal filtering, section 4.4; scipy.linalg.solve_discrete_are).
    """
    F, Q, H, R = time_invariant(model, dt)
    d, m = len(F), len(H)
    S = np.zeros((d, m)) if cross_cov is None else np.atleast_2d(np.asarray(cross_cov, dtype=np.float64))
    if S.shape != (d, m):
        raise ShapeError(f"cross_cov must have shape ({d}, {m}), got {S.shape}")
    # In units of the prior and of the sensors' noises: nothing below depends on metres or millimetres.
    units = np.sqrt(np.diag(model.prior.cov))
    lower = np.linalg.cholesky(R)
    own_F, own_Q = F * units / units[:, None], Q / np.outer(units, units)
    own_H, own_S = np.linalg.solve(lower, H * units), np.linalg.solve(lower, S.T).T / units[:, None]
    _require_steady(model, own_F - own_S @ own_H, own_Q - own_S @ own_S.T, own_H)
    P = _riccati(own_F, own_Q, own_H, own_S) * np.outer(units, units)
    innovation = H @ P @ H.T + R
    gain = np.linalg.solve(innovation, H @ P).T
    kept = np.eye(d) - gain @ H
    cov = kept @ P @ kept.T + gain @ R @ gain.T
    predictor = np.linalg.solve(innovation, (F @ P @ H.T + S).T).T
    radius = float(np.abs(np.linalg.eigvals(F - predictor @ H)).max(initial=0.0))
    settles = -1.0 / math.log(radius) if 0.0 < radius < 1.0 else 0.0
    return SteadyState(P, (cov + cov.T) / 2, gain, innovation, F, Q, H, settles)


def time_invariant(model: StateSpace, dt: float) -> tuple[Array, Array, Array, Array]:
    """F, Q (d, d), H (m, d) and R (m, m) of a linear model whose steps all take dt seconds.

    Raises
    ------
    NonlinearModelError, ModelError
    """
    from sequential.filters.kalman import require_linear

    require_linear(model)
    if not (math.isfinite(dt) and dt > 0):
        raise ModelError(f"dt is {dt}; a step takes a positive number of seconds")
    if not model.sensors:
        raise ModelError("a model without sensors has no steady state to settle in: nothing is ever read")
    process, n = model.process, model.manifold.size
    f, x = model.process_functions, model.prior.mean
    if getattr(process, "rows", 0):
        raise ModelError(f"the {type(process).__name__} is a table of steps, so there is no steady state")
    if f.jacobian is None:
        F = _differenced(f, model, dt)
    else:
        F = _same_for_all(f, f.jacobian, x, dt, n, f"{type(process).__name__}'s transition")
    Q = np.zeros((n, n))
    if f.noise is not None:
        Q = _same_for_all(f, f.noise, x, dt, n, f"{type(process).__name__}'s noise")
    rows, noises = [], []
    for name, sensor in model.sensors.items():
        rows.append(_observed(model, name))
        noises.append(np.asarray(sensor.noise_cov))
    R = np.zeros((sum(map(len, rows)),) * 2)
    at = 0
    for noise in noises:
        R[at : at + len(noise), at : at + len(noise)] = noise
        at += len(noise)
    return F, (Q + Q.T) / 2, np.concatenate(rows), R


def _same_for_all(f: Functions, raw: Any, x: Array, dt: float, n: int, what: str) -> Array:
    """A matrix (n, n) that must not depend on the input."""
    first = evaluate(raw, x, np.zeros(max(f.inputs, 1)), dt, f.params, n * n)
    if f.inputs:
        for driven in (np.ones(f.inputs), np.linspace(-0.7, 1.3, f.inputs)):
            other = evaluate(raw, x, driven, dt, f.params, n * n)
            if not np.array_equal(first, other):
                raise ModelError(
                    f"{what} changes with the input, so it has no steady state; filter it instead"
                )
    return first.reshape(n, n)


def _differenced(f: Functions, model: StateSpace, dt: float) -> Array:
    """F column by column: exact for a linear step."""
    n, u = model.manifold.size, np.zeros(max(f.inputs, 1))
    still = evaluate(f.value, np.zeros(n), u, dt, f.params, n)
    return np.stack([evaluate(f.value, e, u, dt, f.params, n) - still for e in np.eye(n)], axis=1)


def _observed(model: StateSpace, name: str) -> Array:
    """H (m, d) of one sensor."""
    f, m, n = model.sensor_functions[name], model.sensors[name].manifold.dim, model.manifold.size
    if f.inputs:
        raise ModelError(
            f"sensor {name!r} changes with its context, so there is no steady state; filter instead"
        )
    u = np.zeros(1)
    if f.jacobian is not None:
        return evaluate(f.jacobian, model.prior.mean, u, 0.0, f.params, m * n).reshape(m, n)
    still = evaluate(f.value, np.zeros(n), u, 0.0, f.params, m)
    return np.stack([evaluate(f.value, e, u, 0.0, f.params, m) - still for e in np.eye(n)], axis=1)


def _require_steady(model: StateSpace, F: Array, Q: Array, H: Array) -> None:
    """A stabilising solution exists: detectable, and no undisturbed mode on the unit circle."""
    hidden = invariant_kernel(F, H)
    grows = _mode(hidden.T @ F @ hidden, hidden, lambda size: size >= 1.0 - ON_THE_CIRCLE)
    if grows is not None:
        raise ModelError(
            f"no sensor ever sees {_named(model, grows)}, which does not decay by itself, so its "
            "variance never settles; add a sensor that sees it, or take it out of the state"
        )
    values, vectors = np.linalg.eigh(Q)
    root = vectors * np.sqrt(np.clip(values, 0.0, None))
    still = invariant_kernel(F.T, root.T)
    learnt = _mode(still.T @ F.T @ still, still, lambda size: np.abs(size - 1.0) < ON_THE_CIRCLE)
    if learnt is not None:
        raise ModelError(
            f"no process noise ever disturbs {_named(model, learnt)}, so it is learnt for ever and its gain "
            "tends to zero; give it noise, or keep the filter that varies with time"
        )


def _mode(block: Array, basis: Array, wanted: Any) -> Array | None:
    """A direction in a subspace whose eigenvalue has a wanted size, or None."""
    if not len(block):
        return None
    values, vectors = np.linalg.eig(block)
    chosen = np.flatnonzero(wanted(np.abs(values)))
    if not len(chosen):
        return None
    direction = vectors[:, chosen[0]]
    return np.asarray(basis @ (direction / direction[np.argmax(np.abs(direction))]).real)


def _named(model: StateSpace, direction: Array) -> str:
    words = in_words(model.manifold, direction)
    return f"{words} (in standard deviations of the prior)" if " " in words else words


def _riccati(F: Array, Q: Array, H: Array, S: Array) -> Array:
    """The predicted covariance with R = 1, polished by steps of the recursion itself."""
    from scipy.linalg import solve_discrete_are

    failed = "the Riccati equation could not be solved; are the noises many orders of magnitude apart?"
    try:
        P: Array = solve_discrete_are(F.T, H.T, Q, np.eye(len(H)), s=S)
    except (np.linalg.LinAlgError, ValueError) as fault:
        raise SolverError(f"{failed} ({fault})") from fault
    before = P
    for _ in range(3):
        before = P
        crossed = F @ P @ H.T + S
        gain = np.linalg.solve(H @ P @ H.T + np.eye(len(H)), crossed.T).T
        kept = F - gain @ H
        P = kept @ P @ kept.T + Q + gain @ gain.T - gain @ S.T - S @ gain.T
        P = (P + P.T) / 2
    if not np.abs(P - before).max() <= 1e-8 * np.abs(P).max():
        raise SolverError(failed)
    return P


def alpha_beta(tracking_index: float) -> tuple[float, float]:
    """The gains α and β·(1/T) of position and velocity, for one acceleration per step (DWNA).

    Parameters
    ----------
    tracking_index : λ = T² σ_w / σ_v: how far the acceleration throws the target in one step, in units of the
        noise of a reading

    Notes
    -----
    r = (4 + λ - √(8λ + λ²)) / 4, α = 1 - r², β = 2 (2 - α) - 4 √(1 - α) (Kalata 1984).

    >>> tuple(round(gain, 12) for gain in alpha_beta(0.1))
    (0.36, 0.08)
    """
    if not tracking_index > 0:
        raise ModelError(f"a tracking index is positive, got {tracking_index}")
    r = (4.0 + tracking_index - math.sqrt(8.0 * tracking_index + tracking_index**2)) / 4.0
    alpha = 1.0 - r * r
    return alpha, 2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha)
