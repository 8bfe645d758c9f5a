"""Figures of calibration on the real recordings: positions, turns, and whether intervals hold what they say.

`python imu_calibration.py [--json]`.  Needs FACTORLAB_DATA.  Allan deviations and field sensors have their
own scripts, whose figures stand here too.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from time import process_time

import allan_figures
import field_figures
import numpy as np
from measure.figures import Figure, publish, say

from sequential.noise import ImuNoise
from sequential.readers import read_imu
from sequential.sensors import (
    AccelerometerFit,
    AffineCalibration,
    GyroBetweenDwells,
    GyroFit,
    ImuCalibration,
    ImuErrors,
    ImuRecording,
    Move,
    MultiPosition,
    Verification,
    find_dwells,
    simulate_imu,
    verify,
    waypoints,
)

SIMULATED = 60  # recordings of 20 positions
ACCEL = np.array([[1.03, 0.0, 0.0], [0.012, 0.98, 0.0], [-0.008, 0.015, 1.01]])
GYRO = np.array([[1.02, 0.01, -0.006], [-0.012, 0.985, 0.009], [0.004, -0.011, 1.015]])
OFFSET, BIAS = np.array([0.3, -0.2, 0.5]), np.array([0.02, -0.035, 0.01])


def recording(name: str) -> ImuRecording:
    """A file of the folder `imu`."""
    folder = os.environ.get("FACTORLAB_DATA")
    if not folder:
        sys.exit("set FACTORLAB_DATA to the folder of the recordings")
    return read_imu(Path(folder) / "imu" / name)


def calibrated(imu: ImuRecording) -> tuple[AccelerometerFit, GyroFit]:
    """Both sensors of a multi-position recording."""
    dwells = find_dwells(imu)
    accel = MultiPosition().calibrate(dwells)
    return accel, GyroBetweenDwells().calibrate(imu, dwells, accel.calibration, used=accel.used)


def positions(name: str, accel: AccelerometerFit, must: float) -> dict[str, Figure]:
    """Every dwell predicted from the others."""
    before = float(np.sqrt(np.mean(accel.before**2)))
    said = f"{len(accel.used)} dwells, {int((~accel.used).sum())} left out; nominal constants {before:.3f}"
    row = Figure(accel.leave_one_out_rms, "m/s²", said, must, must / 2)
    return {f"{name}_leave_one_dwell_out": row}


def moves(name: str, gyro: GyroFit) -> dict[str, Figure]:
    """Gravity over moves that the gyro's fit has not seen."""
    chosen = gyro.used & gyro.whole
    before = float(np.degrees(np.sqrt(np.mean(gyro.before[chosen] ** 2))))
    said = f"{int(chosen.sum())} moves; nominal constants {before:.2f}°"
    return {f"{name}_leave_one_move_out": Figure(float(np.degrees(gyro.leave_one_out_rms)), "°", said)}


def turn(trial: Verification, nominal: Verification) -> dict[str, Figure]:
    """The hand's turn about x: by the gyro, by gravity, and by the name of the file."""
    ours, plain = (longest(one) for one in (trial, nominal))
    gyro, gravity = np.degrees(ours.by_gyro), np.degrees(ours.by_gravity)
    missed, plainly = np.degrees(ours.off), np.degrees(plain.off)
    about_x = float(np.degrees(ours.rates[0]))
    return {
        "mpu6050_turn_gyro_less_gravity": Figure(
            float(abs(gyro - gravity)), "°", f"gyro {gyro:.2f}°, gravity {gravity:.2f}°", 1.0, 0.5
        ),
        "mpu6050_turn_gravity_arrives_off": Figure(
            float(missed), "°", f"after the turn; uncalibrated gyro {plainly:.2f}°", 1.0, 0.5
        ),
        "mpu6050_turn_less_90": Figure(
            float(gravity - 90.0),
            "°",
            f"what the hand turned beyond 90°; about x by the gyro {about_x:.2f}°",
        ),
    }


def longest(trial: Verification) -> Move:
    """The move of the largest angle."""
    return max(trial.moves, key=lambda move: move.by_gravity)


def coverage() -> dict[str, Figure]:
    """Share of simulated constants that lie within two standard deviations of the truth."""
    rng = np.random.default_rng(4)
    errors = ImuErrors(
        noise=ImuNoise(1e-4, 2e-3, 0.0, 0.0),
        accel_matrix=np.linalg.inv(ACCEL),
        accel_bias=OFFSET,
        gyro_matrix=np.linalg.inv(GYRO),
        gyro_bias=BIAS,
    )
    inside: dict[str, list[bool]] = {"accel": [], "gyro": []}
    for _ in range(SIMULATED):
        q = rng.standard_normal((20, 4))
        imu, _ = simulate_imu(waypoints(q, 1.6, 1.0), rng, errors=errors, field=None)
        accel, gyro = calibrated(imu)
        for name, fit, matrix, offset in (("accel", accel, ACCEL, OFFSET), ("gyro", gyro, GYRO, BIAS)):
            found = fit.calibration
            error = np.concatenate([(found.matrix - matrix).ravel(), found.offset - offset])
            sigma = np.sqrt(np.diag(found.cov))
            inside[name] += (np.abs(error) < 2 * sigma)[sigma > 1e-9].tolist()
    return {
        f"{name}_constants_within_2_sigma": Figure(
            float(np.mean(row)),
            "",
            f"{len(row)} constants, {SIMULATED} recordings; 0.954",
            0.90,
            0.93,
            "higher",
        )
        for name, row in inside.items()
    }


def other_scripts() -> dict[str, Figure]:
    """Figures of the Allan deviations and of the field sensors."""
    say("field sensors")
    found = field_figures.figures()
    say("Allan deviations")
    return found | allan_figures.figures()


def main() -> int:
    """Measure and publish."""
    say("MPU-6050")
    began = process_time()
    accel, gyro = calibrated(recording("mpu6050/example_data_calibration.csv"))
    seconds = process_time() - began
    figures = positions("mpu6050", accel, 0.02) | moves("mpu6050", gyro)
    bundle = ImuCalibration(accel.calibration, gyro.calibration)
    unturned = ImuCalibration(accel.calibration, AffineCalibration.identity("gyro", "rad/s"))
    turned = recording("mpu6050/imu_90_x_rot.csv")
    trial = verify(bundle, turned)
    figures |= turn(trial, verify(unturned, turned))
    for name in ("imu_90_x_rot", "imu_static_test", "example_data_tinit_calc"):
        rms = verify(bundle, recording(f"mpu6050/{name}.csv")).rms
        figures[f"mpu6050_{name}_g"] = Figure(float(rms or 0.0), "m/s²", "||mean| - g| of another recording")
    say("IMU-TK")
    accel, gyro = calibrated(recording("imu_tk/xsens.npz"))
    figures |= positions("imu_tk", accel, 0.005) | moves("imu_tk", gyro)
    figures["mpu6050_seconds"] = Figure(seconds, "s", "read, find dwells, fit and cross-validate, CPU")
    say("simulated recordings")
    return publish(figures | coverage() | other_scripts())


if __name__ == "__main__":
    sys.exit(main())
