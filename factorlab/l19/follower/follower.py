"""The loop: look, read, believe, steer, drive on; twenty times a second."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower.controller import Pid, PidMemory
from factorlab.l19.follower.curves import track
from factorlab.l19.follower.estimator import LOST_SIGMA, START_SIGMA, Localiser, mixed_rate
from factorlab.l19.follower.eye import Detector, Sighting, aheads, read, sight
from factorlab.l19.follower.robot import PERIOD_S, Drivetrain, along_arc, between, view
from factorlab.l19.follower.settings import FollowerSettings
from vision3d.lines import LineReading

__all__ = ["OFF_M", "Follower", "Reading", "Step"]

Array = NDArray[np.float64]
START_M = 0.5  # along a line that is not closed
OFF_M = 0.10  # from the line: it has left the image
LIMIT_RAD_S = 4.0  # turn rate
PATIENCE_S = 0.25  # that a robot without a map keeps its last command for
AGREED = 3  # images in a row that show the line again
MOMENTS = 15  # of an exposure, at most
REMEMBERED = 22  # periods that a shutter may reach back


@dataclass(frozen=True, slots=True)
class Reading:
    """What the detector saw: columns (px) of the line in the bottom and middle rows, NaN without a line.

    `used` tells whether the estimate believed it; `reason` is why there is no line.
    """

    found: bool
    bottom_px: float
    middle_px: float
    confidence: float
    used: bool
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One period of 50 ms.

    Attributes
    ----------
    t_s : since the start
    image : (40, 60) uint8, what the camera saw
    pose : (3,) x m, y m, heading rad: where the robot was
    estimate : (3,) where it believed to be
    cov : (3, 3) of that, in the robot's own axes: along, to the left, heading
    odometry : (3,) where wheels and gyro alone would put it
    offset_m : how far to the left of the line its centre was
    reading : what the detector saw
    command : (speed m/s, turn rate rad/s)
    lost : it does not know where the line is and stands still, or is more than `OFF_M` from it
    arrived : it is at the end of the line and stands still
    """

    t_s: float
    image: NDArray[np.uint8]
    pose: Array
    estimate: Array
    cov: Array
    odometry: Array
    offset_m: float
    reading: Reading
    command: tuple[float, float]
    lost: bool
    arrived: bool


class Follower:
    """A robot on a line, simulated: `step()` drives it on by one period.

    Parameters
    ----------
    settings : may be exchanged while it drives, with `change`
    detect : instead of the settings' detector, a function of an image (40, 60) that gives the line's columns
        in the rows `BOTTOM` and `MIDDLE`, px, or None where it sees none
    """

    def __init__(self, settings: FollowerSettings | None = None, detect: Detector | None = None) -> None:
        self.settings, self.detect = settings or FollowerSettings(), detect
        self.reset()

    @property
    def line(self) -> Array:
        """(N, 2) m, the middle of the line."""
        return self.track.points

    def reset(self) -> None:
        """Back to the start, with the same noise again."""
        own = self.settings
        self.rng = np.random.default_rng(own.seed)
        self.track = track(own.curve, own.seed)
        self.localiser = Localiser(own, self.track)
        start = 0.0 if self.track.closed else START_M
        begin = self.track.at(start)
        aside = START_SIGMA * self.rng.standard_normal(3)
        c, s = np.cos(begin[2]), np.sin(begin[2])
        offset = np.array([c * aside[0] - s * aside[1], s * aside[0] + c * aside[1], aside[2]])
        self.pose: Array = begin + offset
        self.belief = self.localiser.start(begin)
        self.odometry = begin.copy()
        self.drivetrain, self.pid = Drivetrain(), PidMemory()
        self.past: deque[tuple[Array, Drivetrain]] = deque(maxlen=REMEMBERED)
        self.true_s = self.believed_s = start
        self.trail = deque([self.odometry], maxlen=REMEMBERED)
        self.count, self.unseen, self.agreed = 0, 0, 0
        self.command, self.lost = (0.0, 0.0), False

    def change(self, settings: FollowerSettings) -> None:
        """Drive on under other settings; another curve or seed begins anew."""
        anew = (settings.curve, settings.seed) != (self.settings.curve, self.settings.seed)
        self.settings = settings
        if anew:
            self.reset()
        else:
            self.localiser = Localiser(settings, self.track)

    def step(self) -> Step:
        """Look, decide, and drive on; what is returned is as it was when the image was taken."""
        own = self.settings
        poses = self._exposure()
        image = view().image(self.track.line, poses, rng=self.rng, noise=own.noise)
        seen = read(image, self.detect or own.detector)
        self.true_s, offset = self.track.nearest(self.pose, self.true_s)
        sighting = self._sighting(seen) if seen.found else None
        used = self._believe(sighting)
        arrived = not self.track.closed and self.true_s > self.track.length_m - 0.5
        self.unseen = 0 if used else self.unseen + 1
        self._judge(offset)
        self.command = (0.0, 0.0) if self.lost or arrived else self._steer(sighting if used else None)
        (bottom, _), (middle, _) = seen.bottom_px, seen.middle_px
        reading = Reading(seen.found, bottom, middle, seen.confidence, used, seen.reason)
        step = Step(
            self.count * PERIOD_S, image, self.pose, np.array(self.belief.mean), np.array(self.belief.cov),
            self.odometry, offset, reading, self.command, self.lost, arrived,
        )  # fmt: skip
        self._drive()
        return step

    def _exposure(self) -> Array:
        """(k, 3) where the robot was while the shutter was open, which closes now."""
        shutter = self.settings.blur_s
        if shutter <= 0.0:
            return np.atleast_2d(self.pose)
        count = int(min(max(np.ceil(shutter / 0.004), 5), MOMENTS))
        poses = []
        for age in (np.arange(count) + 0.5) / count * shutter:
            back = min(int(age / PERIOD_S), len(self.past) - 1)
            if back < 0:
                poses.append(self.pose)
                continue
            begin, wheels = self.past[-1 - back]
            driven = max((back + 1) * PERIOD_S - age, 0.0)
            poses.append(along_arc(begin, wheels.speed_m_s * driven, wheels.rate_rad_s * driven))
        return np.array(poses)

    def _sighting(self, seen: LineReading) -> Sighting:
        """In metres, at the end of the exposure."""
        age = 0.5 * self.settings.blur_s / PERIOD_S
        whole = min(int(age), len(self.trail) - 1)
        later = self.trail[-1 - whole]
        before = self.trail[max(-2 - whole, -len(self.trail))]
        return sight(seen, between(later + min(age - whole, 1.0) * (before - later), self.trail[-1]))

    def _believe(self, sighting: Sighting | None) -> bool:
        """Correct the estimate by what was seen; False where nothing was, or it does not fit the map."""
        self.believed_s, _ = self.track.nearest(self.belief.mean, self.believed_s)
        if sighting is None:
            return False
        belief, used = self.localiser.seen(self.belief, self.believed_s, sighting)
        if not used and self.lost:
            wide = self.localiser.start(np.array(self.belief.mean), LOST_SIGMA)
            belief, used = self.localiser.seen(wide.at(self.belief.t), self.believed_s, sighting)
        self.belief = belief if used else self.belief
        return used

    def _judge(self, offset: float) -> None:
        """Whether the robot knows where the line is, and is near it."""
        self.agreed = self.agreed + 1 if self.unseen == 0 else 0
        patience = max(self.settings.bridging_s, PATIENCE_S)
        if self.unseen * PERIOD_S > patience or abs(offset) > OFF_M:
            self.lost = True
            self.pid = PidMemory()
        elif self.agreed >= AGREED:
            self.lost = False

    def _steer(self, sighting: Sighting | None) -> tuple[float, float]:
        """Speed and turn rate, from where the line is or should be."""
        own = self.settings
        share = np.array([1.0 - own.look_ahead, own.look_ahead])
        if own.bridging_s > 0.0:
            left = self.localiser.expected(self.belief.mean, self.believed_s, aheads())
        else:
            left = None if sighting is None else sighting.left
        if left is None:
            return own.speed_m_s, self.command[1]
        pid = Pid(own.kp, own.ki, own.kd, LIMIT_RAD_S)
        self.pid, rate = pid.step(self.pid, float(share @ left), PERIOD_S)
        return own.speed_m_s, rate

    def _drive(self) -> None:
        """One period on: the robot, its sensors, and what follows from them alone."""
        own = self.settings
        self.past.append((self.pose, self.drivetrain.after(*self.command)))
        self.drivetrain = self.past[-1][1]
        speed, rate = self.drivetrain.speed_m_s, self.drivetrain.rate_rad_s
        self.pose = along_arc(self.pose, speed * PERIOD_S, rate * PERIOD_S)
        noise = self.rng.standard_normal(3)
        wheels = np.array([self.drivetrain.left, self.drivetrain.right]) + own.wheel_noise * noise[:2]
        gyro = rate + own.gyro_noise * noise[2]
        self.belief = self.localiser.moved(self.belief, wheels, gyro)
        turned, _ = mixed_rate(wheels, gyro, own)
        self.odometry = along_arc(self.odometry, 0.5 * (wheels[0] + wheels[1]) * PERIOD_S, turned * PERIOD_S)
        self.trail.append(self.odometry)
        self.count += 1
