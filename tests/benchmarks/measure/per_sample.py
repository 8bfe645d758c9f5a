"""What one predict and one update cost when they are called from Python, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from filterpy.kalman import KalmanFilter as Peer

import sequential as sq

from .figures import Figure

__all__ = ["figures", "works"]

COUNT = 500  # samples in one piece of work, a millisecond: shorter than what a scheduler gives in one go
DT = 0.1
LANDMARKS = np.array([[8.0, 1.0], [-3.0, 7.0], [-4.0, -6.0], [5.0, -7.0]])


def linear(axes: int) -> sq.StateSpace:
    """Constant velocity along some axes, whose positions are read."""
    matrix = np.hstack([np.eye(axes), np.zeros((axes, axes))])
    return sq.StateSpace(
        sq.Vector(2 * axes),
        sq.Gaussian(np.zeros(2 * axes), np.eye(2 * axes)),
        sq.ConstantVelocity(0.1, axes=axes),
        {"position": sq.LinearSensor(matrix, 0.25 * np.eye(axes))},
    )


def unicycle() -> sq.StateSpace:
    """A planar vehicle that sees landmarks by range and bearing."""
    return sq.StateSpace(
        sq.SE2(),
        sq.Gaussian([1.0, -1.0, 0.5], sq.diagonal([0.3, 0.3, 0.1])),
        sq.Unicycle(0.02, 0.02, 0.02, slip=0.02, turn_slip=0.02),
        {"landmark": sq.RangeBearing(LANDMARKS, sq.diagonal([0.1, 0.03]))},
        input="odometry",
    )


def stepping(
    estimator: Any, model: sq.StateSpace, name: str, values: Any, u: Any = None
) -> Callable[[], Any]:
    """COUNT samples through `step`, beliefs handed on from one to the next."""
    online, readings = sq.Online(estimator, model), list(values)
    context = None if u is None else np.zeros(1)

    def work() -> Any:
        belief = online.start()
        for z in readings:
            belief, _ = online.step(belief, DT, name, z, u, context)
        return belief

    return work


def apart(estimator: Any, model: sq.StateSpace, name: str, values: Any, u: Any = None) -> Callable[[], Any]:
    """The same by `predict` and `update`: two calls a sample."""
    online, readings = sq.Online(estimator, model), list(values)
    context = None if u is None else np.zeros(1)

    def work() -> Any:
        belief = online.start()
        for z in readings:
            belief, _ = online.update(online.predict(belief, DT, u), name, z, context)
        return belief

    return work


def filterpy(values: Any) -> Callable[[], Any]:
    """filterpy's KalmanFilter on the model of two states."""
    model, readings = linear(1), list(values)
    peer = Peer(dim_x=2, dim_z=1)
    peer.F, peer.H = np.array([[1.0, DT], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    peer.Q = 0.01 * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]])
    peer.R = np.array(model.sensors["position"].noise_cov)

    def work() -> Any:
        peer.x, peer.P = np.zeros((2, 1)), np.eye(2)
        for z in readings:
            peer.predict()
            peer.update(z)
        return peer

    return work


def works(rng: np.random.Generator) -> dict[str, Callable[[], Any]]:
    """Pieces of work of COUNT samples each, by name."""
    seen = np.column_stack([rng.normal(7.0, 0.1, COUNT), rng.normal(0.0, 0.03, COUNT)])
    u, one, two = np.array([0.0, 0.0]), rng.normal(size=(COUNT, 1)), rng.normal(size=(COUNT, 2))
    kalman, extended = sq.KalmanFilter(), sq.ExtendedKalmanFilter()
    return {
        "per_sample_linear_2": stepping(kalman, linear(1), "position", one),
        "per_sample_linear_4": stepping(kalman, linear(2), "position", two),
        "per_sample_unicycle": stepping(extended, unicycle(), "landmark", seen, u),
        "per_sample_linear_2_apart": apart(kalman, linear(1), "position", one),
        "per_sample_linear_4_apart": apart(kalman, linear(2), "position", two),
        "per_sample_unicycle_apart": apart(extended, unicycle(), "landmark", seen, u),
        "filterpy": filterpy(one),
    }


def interleaved(pieces: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Median CPU seconds of each piece of work, in turn: other processes do not count."""
    times: dict[str, list[float]] = {name: [] for name in pieces}
    for work in pieces.values():
        work()
    for _ in range(rounds):
        for name, work in pieces.items():
            began = process_time()
            work()
            times[name].append(process_time() - began)
    return {name: median(values) for name, values in times.items()}


def figures(rounds: int = 61) -> Mapping[str, Figure]:
    """Microseconds for one predict and one update, in one call or apart, beside filterpy in the same run."""
    seconds = interleaved(works(np.random.default_rng(1)), rounds)
    micros = {name: value / COUNT * 1e6 for name, value in seconds.items()}
    peer = f"filterpy, 2 states: {micros.pop('filterpy'):.1f}"
    bars = {"linear": (5.0, 1.0), "unicycle": (10.0, 3.0)}
    return {name: Figure(value, "µs", peer, *bars[name.split("_")[2]]) for name, value in micros.items()}
