"""Challenge D3: EKF against UKF on a differential robot, on the same draws of strong or weak noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

import sequential as sq
from sequential.evaluate import AverageNees, anees, nees

__all__ = ["BLIND_S", "DT_S", "LANDMARKS_M", "LOST_M", "Contest", "contest", "robot"]

Array = NDArray[np.float64]
Noise = Literal["strong", "weak"]

LANDMARKS_M = np.array([[0.0, 0.0], [25.0, 0.0], [0.0, 25.0]])
DT_S, LENGTH_S, BLIND_S, JUDGED_S = 0.5, 45.0, 15.0, 10.0
SPEED_M_S, TURN_RAD_S = 1.0, 0.1
LOST_M = 3.0  # a run whose position error exceeds it in the last ten seconds is lost

# prior σ (m, m, rad), process densities (m, m, rad per √s), σ of range (m) and bearing (rad)
LEVELS = {
    "strong": ((0.2, 0.2, 0.7), (0.3, 0.1, 0.3), (0.05, 0.5)),
    "weak": ((0.1, 0.1, 0.05), (0.05, 0.02, 0.02), (0.3, 0.05)),
}


@dataclass(frozen=True, slots=True, eq=False)
class Contest:
    """What R draws say about each filter, by its name.

    Parameters
    ----------
    t : (K,) s, from the first landmark on
    error_m : (R, K) error of the position
    nees : (R, K) normalised estimation error squared of the pose, 3 expected
    """

    t: Array
    error_m: Mapping[str, Array]
    nees: Mapping[str, Array]

    @property
    def late(self) -> NDArray[np.bool_]:
        """(K,) the last ten seconds."""
        return np.asarray(self.t > self.t[-1] - JUDGED_S)

    def worst(self, name: str) -> Array:
        """(R,) largest position error of the last ten seconds, m."""
        return np.asarray(self.error_m[name][:, self.late].max(axis=1))

    def lost(self, name: str) -> float:
        """Share of the runs that ended lost."""
        return float(np.mean(self.worst(name) > LOST_M))

    def rmse(self, name: str) -> float:
        """Root mean square position error of the last ten seconds, all runs together, m."""
        return float(np.sqrt(np.mean(self.error_m[name][:, self.late] ** 2)))

    def anees(self, name: str) -> AverageNees:
        """NEES averaged over the runs at each time, beside its 95 % band."""
        return anees(list(self.nees[name]), 3)


def robot(noise: Noise = "strong", start: float | None = 0.0) -> sq.StateSpace:
    """A differential robot that sees the range and bearing of one of three landmarks at a time.

    Strong noise: heading known to 40° at the start, bearings to 29°, ranges to 5 cm.
    """
    prior, walk, sight = LEVELS[noise]
    return sq.StateSpace(
        manifold=sq.SE2(),
        prior=sq.Gaussian(np.array([2.0, 1.0, 0.5]), np.square(prior)),
        process=sq.Unicycle(along=walk[0], across=walk[1], heading=walk[2]),
        sensors={"landmarks": sq.RangeBearing(LANDMARKS_M, np.square(sight))},
        input="wheels",
        start=start,
    )


def contest(runs: int = 200, seed: int = 1, noise: Noise = "strong") -> Contest:
    """Draw and filter: fifteen seconds blind, then one landmark a second, for thirty seconds.

    Parameters
    ----------
    runs : how many draws, two or more
    seed : of the draws
    """
    model, t = robot(noise), np.arange(0.0, LENGTH_S, DT_S)
    wheels = np.tile([SPEED_M_S, TURN_RAD_S], (len(t), 1))
    sights = np.arange(int(BLIND_S / DT_S), len(t), int(1.0 / DT_S))
    which = (np.arange(len(sights)) % len(LANDMARKS_M))[:, None].astype(np.float64)
    rows = np.flatnonzero(t >= BLIND_S)
    filters = sq.ExtendedKalmanFilter(), sq.UnscentedKalmanFilter()
    errors: dict[str, list[Array]] = {one.name: [] for one in filters}
    squares: dict[str, list[Array]] = {one.name: [] for one in filters}
    for rng in np.random.default_rng(seed).spawn(runs):
        drive = sq.simulate(
            model, t, rng, inputs=wheels, readings={"landmarks": sights}, contexts={"landmarks": which}
        )
        for one in filters:
            run = sq.run(one, model, drive.log, at=t)
            errors[one.name].append(np.hypot(*(run.mean - drive.truth)[rows, :2].T))
            squares[one.name].append(nees(run, drive.truth)[rows])
    return Contest(
        t[rows],
        {name: np.array(one) for name, one in errors.items()},
        {name: np.array(one) for name, one in squares.items()},
    )
