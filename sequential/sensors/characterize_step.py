"""How a sensor follows a step: latency, time constant, damping, bandwidth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from sequential.log import nanoseconds, numbers
from sequential.sensors.characterize_step_models import (
    Model,
    bandwidth,
    first_order,
    overshoot,
    rise_time,
    second_order,
)
from sequential.sensors.estimate import Estimate

__all__ = ["StepResponse", "step_response"]

Array = NDArray[np.float64]
FEWEST = 20
CLEAR = 20.0  # by so much a step must explain the readings better than a constant (BIC)


@dataclass(frozen=True, slots=True, eq=False)
class StepResponse:
    """A step of the input as the sensor showed it; intervals are 95 %.

    Parameters
    ----------
    order : 1 (delay and time constant) or 2 (delay, natural frequency, damping)
    before, size : level before the step, and its height, unit
    begins : s after the first stamp, when the output begins to move
    latency : s from the step of the input to there; None where that moment was not given
    time_constant : s to 63 % of the step after `begins`
    rise : s from 10 % to 90 %
    settled_90 : s from the step of the input (or from `begins`) to 90 %
    bandwidth : Hz, where the gain is 1/√2
    damping : ζ of the second order; None for the first
    overshoot : share of the step
    sigma : scatter about the fit
    resolved : whether the response takes longer than from one sample to the next
    t, fitted : (N,) s and the fitted curve
    """

    order: int
    before: Estimate
    size: Estimate
    begins: Estimate
    latency: Estimate | None
    time_constant: Estimate
    rise: Estimate
    settled_90: Estimate
    bandwidth: Estimate
    damping: Estimate | None
    overshoot: float
    sigma: float
    resolved: bool
    t: Array
    fitted: Array

    def to_json(self) -> dict[str, Any]:
        """Numbers by name, without the curve."""
        plain: dict[str, Any] = {"order": self.order, "overshoot": self.overshoot, "sigma": self.sigma}
        plain["resolved"] = self.resolved
        for name in (
            "before", "size", "begins", "latency", "time_constant", "rise", "settled_90", "bandwidth",
            "damping",
        ):  # fmt: skip
            value = getattr(self, name)
            plain[name] = None if value is None else value.to_json()
        return plain


def step_response(t: ArrayLike, values: ArrayLike, *, at: float | None = None) -> StepResponse:
    """Fit a delayed first- and second-order response to a recording of one step, and take the better one.

    Parameters
    ----------
    t : (N,) int64 ns, or floats in seconds, increasing
    values : (N,) one step from one level to another; NaN is left out
    at : s after the first stamp, when the input stepped; without it, latency is not known

    Raises
    ------
    ShapeError, DataError
        where no step stands out of the noise, or too little of it was recorded.

    Notes
    -----
    Least squares over delay, dynamics and (linear) levels; the order with the better Bayesian information
    criterion is taken; intervals by the delta method.  In noise, a fast second pole cannot be told from a
    delay, and counts as latency.  A response that is over within one sample is said to be so
    (`resolved`): then intervals are as wide as a sample.
    """
    stamps, x = nanoseconds(t), numbers(values, "the step")
    if stamps.ndim != 1 or x.shape != stamps.shape:
        raise ShapeError(f"a step needs stamps and readings of one shape (N,), got {stamps.shape}, {x.shape}")
    known = np.isfinite(x)
    time = (stamps - stamps[0]) * 1e-9
    if known.sum() < FEWEST:
        raise DataError(f"a step response needs {FEWEST} readings, got {int(known.sum())}")
    s, y = time[known], x[known]
    start = _guess(s, y)
    fits = [_fit(model, s, y, start) for model in (first_order, second_order)]
    best = min(fits, key=lambda fit: fit.bic)
    without = len(s) * np.log(max(float(y.var()), 1e-300)) + np.log(len(s))
    if not without - best.bic > CLEAR:
        raise DataError(
            "no step stands out of the noise; record from before the step until the reading has settled"
        )
    found = best.response(at, time)
    usual = float(np.median(np.diff(s)))
    return found if found.time_constant.value > usual else _unresolved(found, usual)


def _unresolved(found: StepResponse, interval: float) -> StepResponse:
    """A response that is over within a sample: it began and ended somewhere between two of them."""

    def widened(one: Estimate) -> Estimate:
        return Estimate(one.value, one.low - interval, one.high + interval)

    def upward(one: Estimate) -> Estimate:
        return Estimate(one.value, 0.0, max(one.high, interval))

    return replace(
        found,
        resolved=False,
        begins=widened(found.begins),
        latency=None if found.latency is None else widened(found.latency),
        time_constant=upward(found.time_constant),
        rise=upward(found.rise),
        settled_90=widened(found.settled_90),
        bandwidth=Estimate(
            found.bandwidth.value, 1.0 / (2.0 * np.pi * interval), float("inf")
        ),  # 1/(2πτ), τ below a sample
        damping=None,
        overshoot=0.0,
    )


def _guess(s: Array, y: Array) -> Array:
    """Start and time constant (s) from the crossings of 10 % and 63 %."""
    tenth = max(len(y) // 10, 3)
    first, last = float(np.median(y[:tenth])), float(np.median(y[-tenth:]))
    span = last - first
    share = (y - first) / span if span else np.zeros(len(y))
    smooth = np.convolve(share, np.ones(3) / 3.0, mode="same")
    smooth[[0, -1]] = share[[0, -1]]
    crossed = [int(np.argmax(smooth > level)) for level in (0.1, 0.63)]
    usual = float(np.median(np.diff(s)))
    return np.array([s[crossed[0]], max(s[crossed[1]] - s[crossed[0]], 0.5 * usual)])


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    model: Model
    parameters: Array  # (2,) or (3,): begin (s), time scale (s), damping
    levels: Array  # (2,) before, size
    cov: Array  # of both together
    sigma: float
    bic: float
    freedom: int

    def estimate(self, of: Callable[[Array], float]) -> Estimate:
        """A function of parameters and levels, its error by the delta method."""
        from scipy.special import stdtrit

        at = np.concatenate([self.parameters, self.levels])
        step = 1e-5 * np.sqrt(np.diag(self.cov)) + 1e-9 * np.abs(at) + 1e-15
        slope = np.array([(of(at + h) - of(at - h)) / (2.0 * h.sum()) for h in np.diag(step)])
        wide = float(stdtrit(self.freedom, 0.975)) * float(np.sqrt(slope @ self.cov @ slope))
        value = float(of(at))
        return Estimate(value, value - wide, value + wide)

    def response(self, at: float | None, time: Array) -> StepResponse:
        k, p = len(self.parameters), self.parameters
        since = 0.0 if at is None else at
        shape = self.model
        return StepResponse(
            order=k - 1,
            before=self.estimate(lambda q: q[k]),
            size=self.estimate(lambda q: q[k + 1]),
            begins=self.estimate(lambda q: q[0]),
            latency=None if at is None else self.estimate(lambda q: q[0] - since),
            time_constant=self.estimate(lambda q: rise_time(shape, q[:k], 0.0, 1.0 - np.exp(-1.0))),
            rise=self.estimate(lambda q: rise_time(shape, q[:k], 0.1, 0.9)),
            settled_90=self.estimate(
                lambda q: rise_time(shape, q[:k], 0.0, 0.9) + (q[0] - since if at is not None else 0.0)
            ),
            bandwidth=self.estimate(lambda q: bandwidth(q[:k])),
            damping=self.estimate(lambda q: q[2]) if k == 3 else None,
            overshoot=overshoot(p),
            sigma=self.sigma,
            resolved=True,
            t=time,
            fitted=self.levels[0] + self.levels[1] * shape(time, p),
        )


def _fit(model: Model, s: Array, y: Array, start: Array) -> _Fit:
    """Nonlinear parameters by a search in which the levels are always the best ones; covariance of all."""
    from scipy.optimize import least_squares

    second = model is second_order
    usual = float(np.median(np.diff(s)))

    def levels(p: Array) -> tuple[Array, Array]:
        design = np.column_stack([np.ones(len(s)), model(s, p)])
        found = np.linalg.lstsq(design, y, rcond=None)[0]
        return np.asarray(found), np.asarray(y - design @ found)

    def residual(z: Array) -> Array:
        return levels(np.concatenate([z[:1], np.exp(z[1:])]))[1]

    best = None
    for tau in start[1] * np.array([0.3, 1.0, 2.0]):
        for zeta in (0.4, 1.0) if second else (None,):
            z = [start[0], np.log(tau / 2.0 if second else tau), *([] if zeta is None else [np.log(zeta)])]
            low = [s[0], np.log(1e-2 * usual), *([] if zeta is None else [np.log(0.02)])]
            high = [s[-1], np.log(s[-1] - s[0]), *([] if zeta is None else [np.log(20.0)])]
            found = least_squares(residual, np.clip(z, low, high), bounds=(low, high), x_scale="jac")
            if best is None or found.cost < best.cost:
                best = found
    assert best is not None  # noqa: S101 - the loops run at least once
    p = np.concatenate([best.x[:1], np.exp(best.x[1:])])
    own, rest = levels(p)
    count = len(p) + 2
    sigma = float(np.sqrt(rest @ rest / max(len(s) - count, 1)))
    bic = len(s) * np.log(max(float(rest @ rest), 1e-300) / len(s)) + count * np.log(len(s))
    return _Fit(
        model, p, own, _covariance(model, s, p, own, sigma), sigma, float(bic), max(len(s) - count, 1)
    )


def _covariance(model: Model, s: Array, p: Array, levels: Array, sigma: float) -> Array:
    """(k + 2, k + 2) of parameters and levels; differences over a share of a time constant."""
    columns = []
    for k in range(len(p)):
        h = 1e-4 * p[1] if k < 2 else 1e-4 * p[2]
        step = np.zeros(len(p))
        step[k] = h
        columns.append(levels[1] * (model(s, p + step) - model(s, p - step)) / (2.0 * h))
    J = np.column_stack([*columns, np.ones(len(s)), model(s, p)])
    return sigma**2 * np.asarray(np.linalg.pinv(J.T @ J, hermitian=True))
