"""Up to which noise, and which blur, the robot keeps the line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower.drive import simulate
from factorlab.l19.follower.settings import FollowerSettings
from sequential.errors import ModelError

__all__ = ["ENOUGH", "Sweep", "sweep"]

Array = NDArray[np.float64]
ENOUGH = 0.95  # of the seeds


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """How many drives kept the line, by noise and blur.

    Attributes
    ----------
    noises : (A,) grey levels
    blurs : (B,) s
    kept : (A, B) share of the seeds with which the line was never lost
    rms_m : (A, B) lateral distance over all drives, until the line was lost
    seeds : how many drives each share is taken from
    steps : of each drive
    """

    noises: Array
    blurs: Array
    kept: Array
    rms_m: Array
    seeds: int
    steps: int

    def noise_limit(self, blur: int = 0) -> float:
        """The largest noise up to which `ENOUGH` of the seeds kept the line; NaN for none."""
        return _last(self.noises, self.kept[:, blur])

    def blur_limit(self, noise: int = 0) -> float:
        """The longest exposure, s, up to which `ENOUGH` of the seeds kept the line; NaN for none."""
        return _last(self.blurs, self.kept[noise])

    def rows(self) -> list[dict[str, float]]:
        """A row a cell, for tables and JSON."""
        return [
            {
                "noise": float(noise),
                "blur_s": float(blur),
                "kept": float(self.kept[i, j]),
                "rms_m": float(self.rms_m[i, j]),
            }
            for i, noise in enumerate(self.noises)
            for j, blur in enumerate(self.blurs)
        ]


def _last(levels: Array, kept: Array) -> float:
    held = np.cumprod(kept >= ENOUGH).astype(bool)
    return float(levels[held][-1]) if held.any() else float("nan")


def sweep(
    noises: Iterable[float],
    blurs: Iterable[float] = (0.0,),
    seeds: int = 20,
    settings: FollowerSettings | None = None,
    steps: int = 500,
) -> Sweep:
    """Drive with every noise, every exposure and every seed, each until the line is lost.

    Parameters
    ----------
    noises : grey levels, increasing
    blurs : s, increasing
    seeds : drives for each pair, whose seeds count up from that of the settings
    settings : everything else

    Raises
    ------
    ModelError
        where levels do not increase, or there is nothing to drive.
    """
    own = settings or FollowerSettings()
    grid = np.array([*noises], dtype=np.float64), np.array([*blurs], dtype=np.float64)
    if not all(len(levels) and (np.diff(levels) > 0).all() for levels in grid) or seeds < 1:
        raise ModelError(
            "a sweep takes increasing noises, increasing blurs and a seed or more; "
            f"got {grid[0].tolist()}, {grid[1].tolist()} and {seeds} seeds"
        )
    kept, rms = np.zeros((2, len(grid[0]), len(grid[1])))
    for i, noise in enumerate(grid[0].tolist()):
        for j, blur in enumerate(grid[1].tolist()):
            drives = [
                simulate(replace(own, noise=noise, blur_s=blur, seed=own.seed + k), steps, until_lost=True)
                for k in range(seeds)
            ]
            kept[i, j] = np.mean([drive.kept for drive in drives])
            rms[i, j] = np.sqrt(np.mean(np.concatenate([drive.offsets_m for drive in drives]) ** 2))
    return Sweep(*grid, kept, rms, seeds, steps)
