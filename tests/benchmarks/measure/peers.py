"""Linear filters and smoothers of other libraries on the cases of this benchmark.

Every builder imports its library itself and returns a piece of work whose result is the last filtered, or the
first smoothed, mean.  Some libraries are given fewer steps: theirs cost up to half a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from .cases import DT, Linear

__all__ = ["FILTERS", "SMOOTHERS", "Builder", "stone_soup_states"]

Builder = Callable[..., Callable[[], np.ndarray]]


def before_the_first_reading(case: Linear) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance after the first prediction, where most libraries begin."""
    return case.F @ case.x0, case.F @ case.P0 @ case.F.T + case.Q


def filterpy(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Predict and update in turn, as its users write it."""
    peer, z = _filterpy(case), case.z[0, :steps]

    def work() -> np.ndarray:
        peer.x, peer.P = case.x0.copy(), case.P0.copy()
        for reading in z:
            peer.predict()
            peer.update(reading)
        return peer.x

    return work


def filterpy_smoother(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Its `batch_filter` and `rts_smoother`."""
    peer, z = _filterpy(case), case.z[0, :steps]

    def work() -> np.ndarray:
        peer.x, peer.P = case.x0.copy(), case.P0.copy()
        mean, cov, _, _ = peer.batch_filter(z)
        return peer.rts_smoother(mean, cov)[0][0]

    return work


def _filterpy(case: Linear) -> Any:
    from filterpy.kalman import KalmanFilter

    peer = KalmanFilter(*case.sizes)
    peer.F, peer.H, peer.Q, peer.R = case.F, case.H, case.Q, case.R
    return peer


def statsmodels(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Compiled; with its shortcut to the steady state switched off."""
    peer = _statsmodels(case, steps, tolerance=0)
    return lambda: peer.filter().filtered_state[:, -1]


def statsmodels_steady(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """The same as it comes: the gain is frozen once the covariance has converged."""
    peer = _statsmodels(case, steps)
    return lambda: peer.filter().filtered_state[:, -1]


def statsmodels_smoother(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Filter and smoother in one."""
    peer = _statsmodels(case, steps, tolerance=0)
    return lambda: peer.smooth().smoothed_state[:, 0]


def _statsmodels(case: Linear, steps: int, **settings: Any) -> Any:
    from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

    n, m = case.sizes
    peer = KalmanSmoother(k_endog=m, k_states=n, k_posdef=n, **settings)
    matrices = {"transition": case.F, "design": case.H, "selection": np.eye(n)}
    for name, value in (matrices | {"state_cov": case.Q, "obs_cov": case.R}).items():
        peer[name] = value
    peer.bind(case.z[0, :steps].copy())
    peer.initialize_known(*before_the_first_reading(case))
    return peer


def pykalman(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Its whole-log filter."""
    peer, z = _pykalman(case), case.z[0, :steps]
    return lambda: np.asarray(peer.filter(z)[0][-1])


def pykalman_smoother(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Filter and smoother in one."""
    peer, z = _pykalman(case), case.z[0, :steps]
    return lambda: np.asarray(peer.smooth(z)[0][0])


def _pykalman(case: Linear) -> Any:
    from pykalman import KalmanFilter

    mean, cov = before_the_first_reading(case)
    return KalmanFilter(
        transition_matrices=case.F,
        observation_matrices=case.H,
        transition_covariance=case.Q,
        observation_covariance=case.R,
        initial_state_mean=mean,
        initial_state_covariance=cov,
    )


def simdkalman(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Made for many series; here it has one."""
    work = _simdkalman(case, case.z[:1, :steps], smoothed=False)
    return lambda: work().filtered.states.mean[0, -1]


def simdkalman_smoother(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Filter and smoother in one."""
    work = _simdkalman(case, case.z[:1, :steps], smoothed=True)
    return lambda: work().smoothed.states.mean[0, 0]


def simdkalman_series(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """All series at once; the last mean of the last one."""
    work = _simdkalman(case, case.z[:, :steps], smoothed=False)
    return lambda: work().filtered.states.mean[-1, -1]


def _simdkalman(case: Linear, z: np.ndarray, *, smoothed: bool) -> Callable[[], Any]:
    from simdkalman import KalmanFilter

    peer = KalmanFilter(
        state_transition=case.F,
        process_noise=case.Q,
        observation_model=case.H,
        observation_noise=case.R,
    )
    mean, cov = before_the_first_reading(case)
    given = z[:, :, 0] if z.shape[2] == 1 else z
    settings = {"filtered": not smoothed, "smoothed": smoothed, "observations": False}
    return lambda: peer.compute(given, 0, initial_value=mean, initial_covariance=cov, **settings)


def stone_soup(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Predictor and updater, one detection after the other."""
    states, _ = _stone_soup(case, steps)
    return lambda: np.asarray(states()[-1].state_vector, dtype=np.float64).ravel()


def stone_soup_smoother(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """The same, and its KalmanSmoother over the track."""
    from stonesoup.smoother.kalman import KalmanSmoother
    from stonesoup.types.track import Track

    states, motion = _stone_soup(case, steps)
    smoother = KalmanSmoother(transition_model=motion)
    return lambda: np.asarray(smoother.smooth(Track(states()))[0].state_vector, dtype=np.float64).ravel()


def _stone_soup(case: Linear, steps: int) -> tuple[Callable[[], list[Any]], Any]:
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import LinearGaussianTimeInvariantTransitionModel
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.updater.kalman import KalmanUpdater

    n, m = case.sizes
    motion = LinearGaussianTimeInvariantTransitionModel(transition_matrix=case.F, covariance_matrix=case.Q)
    sensor = LinearGaussian(ndim_state=n, mapping=tuple(range(m)), noise_covar=case.R)
    pair = KalmanPredictor(motion), KalmanUpdater(sensor)
    return stone_soup_states(case.x0, case.P0, case.z[0, :steps], *pair), motion


def stone_soup_states(
    mean: np.ndarray, cov: np.ndarray, z: np.ndarray, predictor: Any, updater: Any
) -> Callable[[], list[Any]]:
    """Every filtered state of a log."""
    from stonesoup.types.array import StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState

    began = datetime(2000, 1, 1)  # noqa: DTZ001 - its stamps have no zone

    def work() -> list[Any]:
        state, states = GaussianState(mean[:, None].copy(), cov.copy(), timestamp=began), []
        for k, reading in enumerate(z):
            stamp = began + timedelta(seconds=DT * (k + 1))
            ahead = predictor.predict(state, timestamp=stamp)
            seen = Detection(StateVector(reading), timestamp=stamp)
            state = updater.update(SingleHypothesis(ahead, seen))
            states.append(state)
        return states

    return work


def dynamax(case: Linear, steps: int) -> Callable[[], np.ndarray]:
    """Compiled by JAX, in double precision."""
    import jax
    from dynamax.linear_gaussian_ssm import lgssm_filter
    from dynamax.linear_gaussian_ssm.inference import make_lgssm_params

    jax.config.update("jax_enable_x64", True)
    params = make_lgssm_params(*before_the_first_reading(case), case.F, case.Q, case.H, case.R)
    made = jax.jit(lambda z: lgssm_filter(params, z).filtered_means)
    return lambda: np.asarray(made(case.z[0, :steps]))[-1]


# with the steps that each is given
FILTERS: dict[str, tuple[Builder, int]] = {
    "filterpy": (filterpy, 1000),
    "statsmodels": (statsmodels, 5000),
    "statsmodels_steady": (statsmodels_steady, 5000),
    "pykalman": (pykalman, 500),
    "simdkalman": (simdkalman, 1000),
    "stone_soup": (stone_soup, 200),
    "dynamax": (dynamax, 5000),
}
SMOOTHERS: dict[str, tuple[Builder, int]] = {
    "filterpy": (filterpy_smoother, 1000),
    "statsmodels": (statsmodels_smoother, 5000),
    "pykalman": (pykalman_smoother, 500),
    "simdkalman": (simdkalman_smoother, 1000),
    "stone_soup": (stone_soup_smoother, 200),
}
