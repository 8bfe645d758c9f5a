"""What one drive of the line follower depends on."""

from __future__ import annotations

from dataclasses import dataclass, fields

from factorlab.l19.follower.curves import CURVES
from sequential.errors import ModelError

__all__ = ["DETECTORS", "LIMITS", "FollowerSettings"]

DETECTORS = ("bands", "threshold", "find_line")
LIMITS = {
    "speed_m_s": (0.0, 1.0),
    "noise": (0.0, 255.0),
    "blur_s": (0.0, 1.0),
    "kp": (0.0, 200.0),
    "ki": (0.0, 200.0),
    "kd": (0.0, 50.0),
    "look_ahead": (0.0, 1.0),
    "wheel_noise": (0.0, 0.5),
    "gyro_noise": (0.0, 1.0),
    "bridging_s": (0.0, 5.0),
}


@dataclass(frozen=True, slots=True)
class FollowerSettings:
    """A curve, a robot, its sensors' noise and its controller's gains.

    Attributes
    ----------
    curve : name of the line, one of `CURVES`
    speed_m_s : that the robot is asked to keep
    noise : grey levels (0-255), standard deviation of the noise of every pixel
    blur_s : s, how long the shutter is open: the longer, the more the image is smeared, and the older it is
    kp, ki, kd : gains from the line's lateral distance (m) to the turn rate (rad/s): rad/s per m, per m s,
        and per m/s
    look_ahead : where the controller looks: 0 at the lowest rows of the image, 1 at its middle
    wheel_noise : m/s, standard deviation of each reading of a wheel's speed
    gyro_noise : rad/s, standard deviation of each reading of the gyro
    detector : "bands" (matched filter in two bands of rows), "threshold" (Otsu and the mean column of two
        rows, as a first try would be) or "find_line" (vision3d's, slower)
    bridging_s : s that the robot drives on by its estimate and its map when it does not see the line;
        0 for a robot that has no map in its loop
    seed : of all noise, of where the robot starts, and of the curve "hasard"
    """

    curve: str = "sinus"
    speed_m_s: float = 0.3
    noise: float = 0.0
    blur_s: float = 0.0
    kp: float = 18.0
    ki: float = 0.0
    kd: float = 0.0
    look_ahead: float = 0.5
    wheel_noise: float = 0.02
    gyro_noise: float = 0.02
    detector: str = "bands"
    bridging_s: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.curve not in CURVES:
            raise ModelError(f"there is no curve {self.curve!r}; there are {', '.join(CURVES)}")
        if self.detector not in DETECTORS:
            raise ModelError(f"there is no detector {self.detector!r}; there are {', '.join(DETECTORS)}")
        for one in fields(self):
            if one.name not in LIMITS:
                continue
            low, high = LIMITS[one.name]
            value = getattr(self, one.name)
            if not low <= value <= high:
                raise ModelError(f"{one.name} of the line follower must be {low:g} to {high:g}, got {value}")
