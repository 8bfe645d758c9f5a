"""Extended and unscented filters of other libraries on the unicycle."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .cases import DT, Planar, observe, observe_jacobian, step, step_jacobian
from .peers import Builder, stone_soup_states

__all__ = ["EXTENDED", "UNSCENTED"]


def wrapped(angle: Any) -> Any:
    """Into [-π, π)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def moved(x: np.ndarray, dt: float = DT) -> np.ndarray:
    """One step, as an array."""
    return np.array(step(x, dt))


def seen(x: np.ndarray) -> np.ndarray:
    """What is read, as an array."""
    return np.array(observe(x))


def residual(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A difference of readings."""
    return np.array([a[0] - b[0], wrapped(a[1] - b[1])])


def filterpy_extended(case: Planar, steps: int) -> Callable[[], np.ndarray]:
    """With the motion of the mean overridden, as its documentation asks."""
    from filterpy.kalman import ExtendedKalmanFilter

    class Unicycle(ExtendedKalmanFilter):
        def predict_x(self, u: float = 0.0) -> None:
            self.x = moved(self.x)

    peer = Unicycle(3, 2)
    peer.Q, peer.R = case.Q, case.R

    def work() -> np.ndarray:
        peer.x, peer.P = case.x0.copy(), case.P0.copy()
        for z in case.z[:steps]:
            peer.F = np.array(step_jacobian(peer.x, DT))
            peer.predict()
            peer.update(z, lambda x: np.array(observe_jacobian(x)), seen, residual=residual)
        return peer.x

    return work


def filterpy_unscented(case: Planar, steps: int) -> Callable[[], np.ndarray]:
    """The same sigma points, with a mean of bearings about the central one."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    def mean(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        central = points[0, 1]
        return np.array([weights @ points[:, 0], central + weights @ wrapped(points[:, 1] - central)])

    spread = MerweScaledSigmaPoints(3, 1.0, 2.0, 0.0)
    peer = UnscentedKalmanFilter(3, 2, DT, seen, moved, spread, z_mean_fn=mean, residual_z=residual)
    peer.Q, peer.R = case.Q, case.R

    def work() -> np.ndarray:
        peer.x, peer.P = case.x0.copy(), case.P0.copy()
        for z in case.z[:steps]:
            peer.predict()
            peer.update(z)
        return peer.x

    return work


def stone_soup_models(case: Planar) -> tuple[Any, Any]:  # noqa: C901 - two classes of small methods
    """The unicycle's motion and its sensor; functions take one state or a row of sigma points."""
    from stonesoup.models.base import GaussianModel
    from stonesoup.models.measurement.nonlinear import NonLinearGaussianMeasurement
    from stonesoup.models.transition.base import TransitionModel
    from stonesoup.types.angle import Bearing
    from stonesoup.types.array import CovarianceMatrix, StateVector, StateVectors

    def columns(state: Any) -> list[np.ndarray]:
        return list(np.asarray(state.state_vector, dtype=np.float64).T)

    def stacked(given: list[np.ndarray]) -> Any:
        return StateVector(given[0]) if len(given) == 1 else StateVectors(np.array(given).T)

    class Motion(GaussianModel, TransitionModel):
        ndim_state = 3

        def covar(self, **_: Any) -> Any:
            return CovarianceMatrix(case.Q)

        def function(self, state: Any, noise: Any = False, **_: Any) -> Any:
            return stacked([moved(x) for x in columns(state)])

        def jacobian(self, state: Any, **_: Any) -> np.ndarray:
            return np.array(step_jacobian(columns(state)[0], DT))

        def rvs(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

        def pdf(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

    class Sight(NonLinearGaussianMeasurement):
        ndim_meas = 2

        def function(self, state: Any, noise: Any = False, **_: Any) -> Any:
            given = [(r, Bearing(b)) for r, b in (observe(x) for x in columns(state))]
            if len(given) == 1:
                return StateVector(given[0])
            return StateVectors([[r for r, _ in given], [b for _, b in given]])

        def jacobian(self, state: Any, **_: Any) -> np.ndarray:
            return np.array(observe_jacobian(columns(state)[0]))

        def rvs(self, *_: Any, **__: Any) -> Any:
            raise NotImplementedError

    return Motion(), Sight(ndim_state=3, mapping=(0, 1, 2), noise_covar=case.R)


def stone_soup_extended(case: Planar, steps: int) -> Callable[[], np.ndarray]:
    """Its extended predictor and updater."""
    from stonesoup.predictor.kalman import ExtendedKalmanPredictor
    from stonesoup.updater.kalman import ExtendedKalmanUpdater

    motion, sight = stone_soup_models(case)
    return _last(case, steps, ExtendedKalmanPredictor(motion), ExtendedKalmanUpdater(sight))


def stone_soup_unscented(case: Planar, steps: int) -> Callable[[], np.ndarray]:
    """Its unscented predictor and updater, with the same spread."""
    from stonesoup.predictor.kalman import UnscentedKalmanPredictor
    from stonesoup.updater.kalman import UnscentedKalmanUpdater

    motion, sight = stone_soup_models(case)
    spread = {"alpha": 1.0, "beta": 2.0, "kappa": 0.0}
    pair = UnscentedKalmanPredictor(motion, **spread), UnscentedKalmanUpdater(sight, **spread)
    return _last(case, steps, *pair)


def _last(case: Planar, steps: int, predictor: Any, updater: Any) -> Callable[[], np.ndarray]:
    states = stone_soup_states(case.x0, case.P0, case.z[:steps], predictor, updater)
    return lambda: np.asarray(states()[-1].state_vector, dtype=np.float64).ravel()


# with the steps that each is given
EXTENDED: dict[str, tuple[Builder, int]] = {
    "filterpy": (filterpy_extended, 1000),
    "stone_soup": (stone_soup_extended, 200),
}
UNSCENTED: dict[str, tuple[Builder, int]] = {
    "filterpy": (filterpy_unscented, 500),
    "stone_soup": (stone_soup_unscented, 100),
}
