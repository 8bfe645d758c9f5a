"""KITTI drive with an inertial unit and GPS, as the gtsam wheel carries it.

Traps of the files, met here once: the first two IMU rows cover an unknown past (intervals of 46 534 s and
1.9 s), so the log starts at the second fix; an interval in the file lies *before* its stamp; the two bias
sigmas are per sample at 100 Hz, the others are densities; gravity was 9.8 when the data were made.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Dataset, require_file
from factorlab.datasets.wheel import gtsam_data
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.model import Gaussian, StateSpace
from sequential.models import Position, Strapdown, inertial_state
from sequential.noise import ImuNoise, diagonal
from sequential.tuning import Knob

__all__ = ["load_kitti"]

Array = NDArray[np.float64]

START = 1  # the fix at which the log begins; it is the prior's and is not applied again
RATE_HZ = 100.0
GRAVITY = (0.0, 0.0, -9.8)
GPS_SIGMA = float(np.sqrt(0.07))  # m; GTSAM's own example uses this variance
HEADING_BASE = 3.0  # m to drive before the motion gives a heading


class _Files(NamedTuple):
    imu: Array  # (N, 8) t, dt, accelerometer (3) m/s², gyro (3) rad/s
    gps: Array  # (M, 4) t, position (3) m
    sigmas: Array  # (5,) accelerometer, gyro, integration, accelerometer bias, gyro bias


ESTIMATORS = ("ekf", "iekf", "ukf", "ekf_rts", "ieks", "fixed_lag", "isam2", "isam2_final", "batch")


def load_kitti(use_every: int, data: Path | None) -> Dataset:
    """IMU at 100 Hz, fixes at 1 Hz of which one in `use_every` is used and the others score the result."""
    files = _read(data)
    gps = Stream(nanoseconds(files.gps[START + 1 :, 0]), files.gps[START + 1 :, 1:])
    imu = Stream(nanoseconds(files.imu[1:, 0]), files.imu[1:, 2:], covers="before")
    log, held_out = SensorLog({"imu": imu, "gps": gps}, "kitti").hold_out("gps", use_every)
    prior, start = _prior(files.gps), float(files.gps[START, 0])

    def build(values: Mapping[str, float]) -> StateSpace:
        noise = ImuNoise(
            values["gyro_density"],
            values["accel_density"],
            values["gyro_bias_walk"],
            values["accel_bias_walk"],
        )
        sensors = {"gps": Position(values["gps_sigma"] ** 2)}
        return StateSpace(inertial_state(), prior, Strapdown(noise, GRAVITY), sensors, "imu", start)

    knobs = _knobs(files.sigmas)
    return Dataset(
        name="kitti",
        title="KITTI drive, IMU at 100 Hz and GPS at 1 Hz",
        log=log,
        model=build({knob.name: knob.initial for knob in knobs}),
        held_out=held_out if len(held_out) else None,
        truth=None,
        axes=3,
        knobs=knobs,
        build=build,
        notes=(
            f"{len(imu)} IMU samples; {len(log['gps'])} of {len(gps)} fixes used, {len(held_out)} held out",
            "start: position and heading from the second fix and the first 3 m of motion",
            "held-out fixes carry the receiver's own noise (σ about 0.26 m as declared)",
        ),
        default_estimators=ESTIMATORS,
        lags=(0.0, 1.0, 5.0, 20.0),
    )


def _read(data: Path | None) -> _Files:
    folder = gtsam_data() if data is None else Path(data)
    remedy = "it comes with the gtsam wheel (pip install gtsam); data=… takes another folder"
    paths = [
        require_file(folder / name, "a file of the dataset kitti", remedy)
        for name in ("KittiEquivBiasedImu.txt", "KittiGps_converted.txt", "KittiEquivBiasedImu_metadata.txt")
    ]
    return _Files(
        np.loadtxt(paths[0], skiprows=1),
        np.loadtxt(paths[1], skiprows=1, delimiter=","),
        np.loadtxt(paths[2], skiprows=1)[6:11],
    )


def _knobs(sigmas: Array) -> tuple[Knob, ...]:
    """Noise as shipped; the per-sample bias sigmas become densities."""
    accel, gyro, _, accel_bias, gyro_bias = map(float, sigmas)
    per_sample = RATE_HZ**0.5
    return (
        Knob("accel_density", accel, "m/s²/√Hz"),
        Knob("gyro_density", gyro, "rad/s/√Hz"),
        Knob("accel_bias_walk", accel_bias * per_sample, "m/s³/√Hz"),
        Knob("gyro_bias_walk", gyro_bias * per_sample, "rad/s²/√Hz"),
        Knob("gps_sigma", GPS_SIGMA, "m"),
    )


def _prior(gps: Array) -> Gaussian:
    """Level, at the first used fix, heading and velocity along the first motion."""
    first = gps[START]
    driven = np.linalg.norm(gps[START + 1 :, 1:3] - first[1:3], axis=1)
    along = gps[START + 1 + int(np.argmax(driven >= HEADING_BASE)), 1:3] - first[1:3]
    yaw = float(np.arctan2(along[1], along[0]))
    velocity = (gps[START + 1, 1:] - first[1:]) / (gps[START + 1, 0] - first[0])
    nav = np.concatenate([[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)], first[1:], velocity])
    mean = inertial_state().pack(nav=nav, accel_bias=np.zeros(3), gyro_bias=np.zeros(3))
    # rotation (rad), position (m), velocity (m/s), accelerometer bias (m/s²), gyro bias (rad/s)
    sigmas = [0.05, 0.05, 0.2, 1, 1, 1, 2, 2, 2, 0.1, 0.1, 0.1, 5e-5, 5e-5, 5e-5]
    return Gaussian(mean, diagonal(sigmas))
