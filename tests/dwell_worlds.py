"""Recordings of dwells whose constants are known; not a test."""

import numpy as np

from sequential.noise import ImuNoise
from sequential.sensors import ImuErrors, ImuRecording, simulate_imu, waypoints

GRAVITY = 9.80665
ACCEL_MATRIX = np.array([[1.03, 0.0, 0.0], [0.012, 0.98, 0.0], [-0.008, 0.015, 1.01]])  # what calibrates
ACCEL_OFFSET = np.array([0.3, -0.2, 0.5])
GYRO_MATRIX = np.array([[1.02, 0.01, -0.006], [-0.012, 0.985, 0.009], [0.004, -0.011, 1.015]])
GYRO_BIAS = np.array([0.02, -0.035, 0.01])
NOISE = ImuNoise(gyro_density=1e-4, accel_density=2e-3, gyro_bias_walk=0.0, accel_bias_walk=0.0)


def attitudes(count, rng):
    """World_q_body (K, 4), uniform over all rotations."""
    q = rng.standard_normal((count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def recorded(orientations, rng, *, dwell=2.0, travel=1.5, noise=NOISE, **kept):
    """A recording with the constants above, and its truth."""
    errors = ImuErrors(
        noise=noise,
        accel_matrix=np.linalg.inv(ACCEL_MATRIX),
        accel_bias=ACCEL_OFFSET,
        gyro_matrix=np.linalg.inv(GYRO_MATRIX),
        gyro_bias=GYRO_BIAS,
        **kept,
    )
    return simulate_imu(waypoints(orientations, dwell, travel), rng, errors=errors, field=None)


def mpu6050(folder, name):
    """A recording of the MPU-6050, by its data sheet's scales."""
    raw = np.loadtxt(folder / "imu" / "mpu6050" / f"{name}.csv", delimiter=",", skiprows=5)
    accel, gyro = raw[:, :3] / 16384 * GRAVITY, np.radians(raw[:, 3:] / 131)
    return ImuRecording(np.arange(len(raw)) * 0.01, accel, gyro, name=name)


def xsens(folder):
    """IMU-TK's recording, raw counts."""
    with np.load(folder / "imu" / "imu_tk" / "xsens.npz") as z:
        accel, gyro = z["acc"].astype(float), z["gyr"].astype(float)
        return ImuRecording(z["t"], accel, gyro, name="xsens", accel_unit="counts", gyro_unit="counts")
