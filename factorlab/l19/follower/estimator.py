"""Where the robot believes to be: an extended Kalman filter on wheels, gyro, and the line on its map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import sequential as sq
from factorlab.l19.follower.curves import Track
from factorlab.l19.follower.eye import Sighting
from factorlab.l19.follower.robot import PERIOD_S, TRACK_M
from factorlab.l19.follower.settings import FollowerSettings

__all__ = ["START_SIGMA", "Localiser", "mixed_rate"]

Array = NDArray[np.float64]
START_SIGMA = np.array([0.01, 0.01, np.radians(2.0)])  # m, m, rad
LOST_SIGMA = np.array([0.05, 0.03, np.radians(10.0)])
GATE = 0.9999
LEAST = 1e-4  # m/s and rad/s: no sensor is perfect


def line_ahead(x: Any, c: Any) -> Any:
    """How far to the left (2,) the line is, at two distances in front of a robot at x = (x, y, heading).

    For each four numbers of c: ahead m, then a place on the line and its direction; the line is straight near
    it.  The last two of c (10,) are weights, 1/m: one over the standard deviations of the distances.
    """
    cos, sin = np.cos(x[2]), np.sin(x[2])
    out = np.zeros(2)
    for i in range(2):
        ahead, px, py, angle = c[4 * i], c[4 * i + 1], c[4 * i + 2], c[4 * i + 3]
        nx, ny = -np.sin(angle), np.cos(angle)
        gap = nx * (px - x[0] - ahead * cos) + ny * (py - x[1] - ahead * sin)
        out[i] = gap / (ny * cos - nx * sin) * c[8 + i]
    return out


def mixed_rate(wheels: Array, gyro: float, settings: FollowerSettings) -> tuple[float, float]:
    """The turn rate from both wheels' speeds and the gyro, weighted by their variances, and its σ, rad/s."""
    by_wheels = (wheels[1] - wheels[0]) / TRACK_M
    wheel_variance = 2.0 * max(settings.wheel_noise, LEAST) ** 2 / TRACK_M**2
    gyro_variance = max(settings.gyro_noise, LEAST) ** 2
    share = wheel_variance / (wheel_variance + gyro_variance)
    rate = by_wheels + share * (gyro - by_wheels)
    return rate, float(np.sqrt(share * gyro_variance))


def robot_model(settings: FollowerSettings) -> sq.StateSpace:
    """The pose, moved by measured speed and turn rate, corrected by the line."""
    speed = max(settings.wheel_noise, LEAST) / np.sqrt(2.0)
    _, rate = mixed_rate(np.zeros(2), 0.0, settings)
    root = np.sqrt(PERIOD_S)  # a white error of each reading, as a density
    return sq.StateSpace(
        manifold=sq.SE2(),
        prior=sq.Gaussian(np.zeros(3), START_SIGMA**2),
        process=sq.Unicycle(along=speed * root, across=0.0, heading=rate * root),
        sensors={"line": sq.Sensor(line_ahead, np.ones(2), gate=GATE, context=10)},
        input="odometry",
    )


class Localiser:
    """The filter in the loop: settings and a map; the belief goes in and comes out."""

    def __init__(self, settings: FollowerSettings, track: Track) -> None:
        self.settings, self.track = settings, track
        self.online = sq.Online(sq.ExtendedKalmanFilter(), robot_model(settings))

    def start(self, pose: Array, sigmas: Array = START_SIGMA, t_s: float = 0.0) -> sq.Belief:
        """A belief about a pose, (x, y, heading)."""
        return self.online.belief(sq.Gaussian(pose, sigmas**2), t_s)

    def moved(self, belief: sq.Belief, wheels: Array, gyro: float) -> sq.Belief:
        """After one period, from what wheels (2,) m/s and gyro rad/s read."""
        rate, _ = mixed_rate(wheels, gyro, self.settings)
        return self.online.predict(belief, PERIOD_S, np.array([0.5 * (wheels[0] + wheels[1]), rate]))

    def seen(self, belief: sq.Belief, s_m: float, sighting: Sighting) -> tuple[sq.Belief, bool]:
        """After a sighting of the line, and whether it fitted the map (Mahalanobis gate)."""
        context = self.context(belief.mean, s_m, sighting.ahead, 1.0 / sighting.sigma)
        if context is None:
            return belief, False
        belief, innovation = self.online.update(belief, "line", sighting.left / sighting.sigma, context)
        return belief, innovation.accepted

    def context(self, pose: Array, s_m: float, ahead: Array, weights: Array) -> Array | None:
        """(10,) the map where both rows should show it, and weights; None where it is not in front."""
        crossings = self.track.crossings(pose, ahead, s_m)
        if crossings is None:
            return None
        context = np.empty(10)
        context[:8].reshape(2, 4)[:, 0], context[:8].reshape(2, 4)[:, 1:] = ahead, crossings
        context[8:] = weights
        return context

    def expected(self, pose: Array, s_m: float, ahead: Array) -> Array | None:
        """(2,) how far to the left the line should be; None where it is not in front."""
        context = self.context(pose, s_m, ahead, np.ones(2))
        return None if context is None else line_ahead(pose, context)
