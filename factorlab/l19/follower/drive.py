"""A whole drive, as arrays, and what is said of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower.eye import Detector
from factorlab.l19.follower.follower import Follower
from factorlab.l19.follower.settings import FollowerSettings

__all__ = ["Drive", "simulate"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Drive:
    """Every step of a drive.

    Attributes
    ----------
    settings : with which it began
    line : (M, 2) m
    t_s : (N,)
    poses, estimates, odometry : (N, 3) x m, y m, heading rad: the truth, the filter, wheels and gyro alone
    covs : (N, 3, 3) of the estimates, in the robot's own axes
    offsets_m : (N,) how far to the left of the line the robot was
    columns : (N, 2) px of the line in the bottom and middle rows, NaN where it was not found
    used, lost, arrived : (N,) as in `Step`
    commands : (N, 2) speed m/s and turn rate rad/s
    images : (N, 40, 60) uint8, (0, 40, 60) where they were not kept
    """

    settings: FollowerSettings
    line: Array
    t_s: Array
    poses: Array
    estimates: Array
    odometry: Array
    covs: Array
    offsets_m: Array
    columns: Array
    used: Flags
    lost: Flags
    arrived: Flags
    commands: Array
    images: NDArray[np.uint8]

    @property
    def rms_m(self) -> float:
        """Lateral distance from the line, root mean square, m."""
        return float(np.sqrt(np.mean(self.offsets_m**2)))

    @property
    def kept(self) -> bool:
        """Whether it never lost the line."""
        return not self.lost.any()

    @property
    def driven_m(self) -> float:
        """Length of the way."""
        return float(np.linalg.norm(np.diff(self.poses[:, :2], axis=0), axis=1).sum())

    @property
    def errors(self) -> Array:
        """(N, 3) of the estimates, in their own axes: along m, to the left m, heading rad."""
        away = self.poses - self.estimates
        c, s = np.cos(self.estimates[:, 2]), np.sin(self.estimates[:, 2])
        turned = away[:, 2] - 2 * np.pi * np.round(away[:, 2] / (2 * np.pi))
        return np.column_stack([c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0], turned])

    @property
    def nees(self) -> Array:
        """(N,) normalised estimation error squared; 3 on average where the covariance is honest."""
        errors = self.errors
        whitened = np.linalg.solve(self.covs, errors[..., None])[..., 0]
        return np.asarray(np.sum(errors * whitened, axis=1))


def simulate(
    settings: FollowerSettings | None = None,
    steps: int = 500,
    *,
    detect: Detector | None = None,
    keep_images: bool = False,
    until_lost: bool = False,
) -> Drive:
    """Drive along the line.

    Parameters
    ----------
    steps : of 50 ms
    detect : a detector of your own, as for `Follower`
    keep_images : all of what the camera saw, 2.4 kB a step
    until_lost : end with the first step at which the line is lost
    """
    follower = Follower(settings, detect)
    made = []
    for _ in range(steps):
        made.append(follower.step())
        if until_lost and made[-1].lost:
            break
    readings = [step.reading for step in made]
    images = [step.image for step in made] if keep_images else np.zeros((0, *made[0].image.shape), np.uint8)
    return Drive(
        settings=follower.settings,
        line=follower.line,
        t_s=np.array([step.t_s for step in made]),
        poses=np.array([step.pose for step in made]),
        estimates=np.array([step.estimate for step in made]),
        odometry=np.array([step.odometry for step in made]),
        covs=np.array([step.cov for step in made]),
        offsets_m=np.array([step.offset_m for step in made]),
        columns=np.array([(reading.bottom_px, reading.middle_px) for reading in readings]),
        used=np.array([reading.used for reading in readings]),
        lost=np.array([step.lost for step in made]),
        arrived=np.array([step.arrived for step in made]),
        commands=np.array([step.command for step in made]),
        images=np.asarray(images),
    )
