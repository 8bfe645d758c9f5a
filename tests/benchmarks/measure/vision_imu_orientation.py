"""TP5: a marker's attitude at 15 Hz and a gyro at 100 Hz, fused; beside the camera alone and the gyro alone.

Readings three ways: Gaussian noise with a mirror image that comes first one time in ten, corners with noise
(the modes and odds that `marker_poses` gives them), and rendered pictures.  Bands of the NEES are of χ² for
as many independent runs; every run gives the value of its last node (filter) or its middle one (smoother).
Where corners are read a posterior is skewed, alike in neighbouring frames, which a smoother takes for
independent: its NEES is told there and not judged.
"""

from __future__ import annotations

import numpy as np
from vision_imu_worlds import (
    BIAS_SIGMA,
    NOISE,
    corner_readings,
    gyro_only,
    noisy_readings,
    off,
    rendered_readings,
    rms_deg,
    squared,
    turning,
)

import sequential as sq
from factorlab.markers.attitudes import fuse_attitude
from measure.figures import Figure, interleaved, say
from sequential.evaluate.consistency import chi2_band

__all__ = ["figures"]

WORLDS = {"noisy": (noisy_readings, 60), "corners": (corner_readings, 40), "rendered": (rendered_readings, 4)}
ESTIMATORS = {"filter": sq.ExtendedKalmanFilter(), "smoother": sq.IteratedSmoother()}
DISTANCE_M = 0.6  # of the marker whose corners are read: 44 px


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """RMSE over the better of the two alone, and NEES over three, world by world."""
    rows: dict[str, Figure] = {}
    for name, (make, runs) in WORLDS.items():
        say(f"vision and IMU, {name}")
        rows |= world_rows(name, make, max(2, runs // 10) if quick else runs)
    return rows | duration()


def world_rows(name, make, runs):
    """What the runs of one world say."""
    rmse: dict[str, list[float]] = {what: [] for what in ("camera", "gyro", *ESTIMATORS)}
    nees: dict[str, list[float]] = {what: [] for what in ESTIMATORS}
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        motion, gyro, _ = turning(rng)
        marker = make(motion, rng, **({"distance": DISTANCE_M} if make is corner_readings else {}))
        rmse["camera"].append(rms_deg(off(motion, marker.t, marker.context[:, :4])))
        rmse["gyro"].append(rms_deg(off(motion, *gyro_only(gyro, marker))))
        for what, estimator in ESTIMATORS.items():
            run = fuse_attitude(estimator, gyro, marker, NOISE, bias_sigma=BIAS_SIGMA)
            errors = off(motion, run.t, run.mean[:, :4])
            rmse[what].append(rms_deg(errors))
            nees[what].append(squared(run, errors)[-1 if what == "filter" else len(errors) // 2])
    means = {what: float(np.sqrt(np.mean(np.square(values)))) for what, values in rmse.items()}
    alone = min(means["camera"], means["gyro"])
    told = f"camera {means['camera']:.2f} deg, gyro {means['gyro']:.1f} deg alone; {runs} runs of 20 s"
    rows = {}
    for what in ESTIMATORS:
        rows[f"vision_imu_{name}_{what}_rmse_deg"] = Figure(means[what], "deg", told, alone, alone / 3.0)
    low, high = (bound / 3.0 for bound in chi2_band(3, runs))
    for what in ESTIMATORS:
        judged = name == "noisy" or (name == "corners" and what == "filter")  # four rendered runs say little
        value = float(np.mean(nees[what])) / 3.0
        node = "last" if what == "filter" else "middle"
        band = f"ANEES/3 of the {node} node; 95 % band of {runs} runs {low:.2f} to {high:.2f}"
        rows[f"vision_imu_{name}_{what}_nees"] = Figure(value, "1", band, high if judged else None)
        if judged:
            rows[f"vision_imu_{name}_{what}_nees_low"] = Figure(value, "1", band, low, better="higher")
    return rows


def duration() -> dict[str, Figure]:
    """Time of a whole recording: 2000 rates, 300 sightings, begun both ways."""
    rng = np.random.default_rng(0)
    motion, gyro, _ = turning(rng)
    marker = noisy_readings(motion, rng)
    works = {name: (lambda e=e: fuse_attitude(e, gyro, marker, NOISE)) for name, e in ESTIMATORS.items()}
    times = interleaved(works)
    return {
        f"vision_imu_{what}_ms": Figure(1e3 * value, "ms", "20 s of recording, begun both ways")
        for what, value in times.items()
    }
