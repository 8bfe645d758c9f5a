"""The starry night without its map: the twenty points are to be found, from a first pose that is known.

The problem begins at the first picture with many points.  Before it lie seven seconds with one point in sight
and six with none, in which no estimator of a map could do better than add up velocities.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from factorlab.datasets.dataset import Truth
from factorlab.datasets.slam import SlamDataset
from factorlab.datasets.starry_night import PRIOR_SIGMAS, StarryNight, read_starry_night
from sequential.manifold import SE3, Vector
from sequential.noise import diagonal
from sequential.slam import Factors, SlamProblem
from sequential.slam.models import Between, Prior, StereoProjection

__all__ = ["load_starry_night_slam"]

BEGIN_WITH = 10  # points in sight where the problem begins
ESTIMATORS = ("ekf_slam", "isam2", "isam2_final", "fixed_lag", "batch")


def load_starry_night_slam(data: Path | None) -> SlamDataset:
    """Poses, and points in their order of the file; the truth scores both."""
    night = read_starry_night(data)
    seen = np.bincount(night.picture, minlength=len(night.t))
    first = int(np.argmax(seen >= BEGIN_WITH))
    kept = night.picture >= first
    t = night.t[first:]
    truth = Truth(t, night.world_T_body[first:, 4:], None, night.world_T_body[first:, :4])
    return SlamDataset(
        name="starry_night",
        title="Barfoot's starry night: stereo and an IMU among twenty points of unknown place",
        problem=SlamProblem(
            {"x": SE3(), "l": Vector(3)},
            (_start(night, first), _steps(night, first), _sight(night, first)),
            t=t,
        ),
        truth=truth,
        landmarks={i: place for i, place in enumerate(night.points) if (night.point[kept] == i).any()},
        axes=3,
        notes=(
            f"{kept.sum()} sightings in {len(t)} pictures, from the first one with {BEGIN_WITH} points on",
            "start: the recorded pose there; nothing else of the truth is used, and nothing is aligned",
            "which point is seen is known; noise as the file states it, white and independent",
        ),
        default_estimators=ESTIMATORS,
    )


def _start(night: StarryNight, first: int) -> Factors:
    """Where the first pose is."""
    return Factors(
        Prior(SE3()), ("x",), [[0]], night.world_T_body[first][None], diagonal(PRIOR_SIGMAS), name="start"
    )


def _steps(night: StarryNight, first: int) -> Factors:
    """Each twist held until the next picture, with the noise that the known map's filter has."""
    dt = np.diff(night.t[first:]) * 1e-9
    z = SE3().retract(SE3().identity(), night.twist[first:-1] * dt[:, None])
    interval = float(np.mean(np.diff(night.t))) * 1e-9
    cov = dt[:, None, None] * np.diag(night.twist_var * interval)
    k = np.arange(len(dt))
    return Factors(Between(SE3()), ("x", "x"), np.column_stack([k, k + 1]), z, cov, name="twist")


def _sight(night: StarryNight, first: int) -> Factors:
    """Pixels of points by their row in the file."""
    kept = night.picture >= first
    model = StereoProjection(night.intrinsics, night.baseline, tuple(night.body_T_camera))
    index = np.column_stack([night.picture[kept] - first, night.point[kept]])
    return Factors(model, ("x", "l"), index, night.pixels[kept], night.pixel_var, name="stereo")
