"""Other people's attitude filters on a recording: quaternions (N, 4) in east-north-up, as they come.

ahrs's Madgwick has its x axis north and is turned by 90° about the vertical; imufusion 1.3.3 with its ENU
convention and ahrs's Mahony need no turn.  ahrs's Mahony takes k_I = 0.3 unless told otherwise, far too much.
"""

from __future__ import annotations

from collections.abc import Callable

import imufusion
import numpy as np
from ahrs.filters import Madgwick
from ahrs.filters import Mahony as AhrsMahony
from vqf import VQF, BasicVQF, offlineVQF

from sequential.attitude import attitude_from_angles, attitude_from_vectors
from sequential.manifold.quaternion import quaternion_multiply
from sequential.sensors import ImuRecording

__all__ = ["PEERS", "SLOW_PEERS", "Answer", "vqf_batch"]

Answer = dict[str, np.ndarray]  # "9d" and "6d", each (N, 4)
NORTH_WEST = attitude_from_angles([0.0, 0.0, np.pi / 2])


def vqf_batch(recording: ImuRecording) -> dict[str, np.ndarray]:
    """What is timed: VQF over a whole recording in one call."""
    return VQF(1.0 / recording.rate).updateBatch(recording.gyro, recording.accel, recording.mag)


def vqf(recording: ImuRecording) -> Answer:
    """VQF, causal, its own parameters."""
    found = vqf_batch(recording)
    return {"9d": found["quat9D"], "6d": found["quat6D"]}


def basic_vqf(recording: ImuRecording) -> Answer:
    """VQF without biases, rest and rejection."""
    found = BasicVQF(1.0 / recording.rate).updateBatch(recording.gyro, recording.accel, recording.mag)
    return {"9d": found["quat9D"], "6d": found["quat6D"]}


def offline_vqf(recording: ImuRecording) -> Answer:
    """VQF forward and backward."""
    found = offlineVQF(recording.gyro, recording.accel, recording.mag, 1.0 / recording.rate)
    return {"9d": found["quat9D"], "6d": found["quat6D"]}


def fusion(recording: ImuRecording) -> Answer:
    """x-io Fusion with the settings of its advanced example and its bias estimator."""
    return {"9d": _fusion(recording, magnetic=True), "6d": _fusion(recording, magnetic=False)}


def _fusion(recording: ImuRecording, *, magnetic: bool) -> np.ndarray:
    ahrs, bias = imufusion.Ahrs(), imufusion.Bias()
    settings = imufusion.AhrsSettings()
    settings.sample_rate, settings.convention = recording.rate, imufusion.CONVENTION_ENU
    settings.gyroscope_range, settings.rejection_timeout = 2000.0, 5.0
    settings.acceleration_rejection = settings.magnetic_rejection = 10.0
    ahrs.set_settings(settings)
    of_bias = imufusion.BiasSettings()
    of_bias.sample_rate = recording.rate
    bias.set_settings(of_bias)
    path = np.empty((len(recording), 4))
    gyro, accel = np.degrees(recording.gyro), recording.accel / 9.80665
    for k, (w, a, m) in enumerate(zip(gyro, accel, recording.mag, strict=True)):
        still = bias.update(w)
        if magnetic:
            ahrs.update(still, a, m)
        else:
            ahrs.update_no_magnetometer(still, a)
        path[k] = ahrs.get_quaternion()
    return path


def ahrs_madgwick(recording: ImuRecording) -> Answer:
    """ahrs's Madgwick with BROAD's best gain for all trials, β = 0.12."""
    given = {"gyr": recording.gyro, "acc": recording.accel, "frequency": recording.rate, "gain": 0.12}
    with_field = Madgwick(**given, mag=recording.mag).Q
    return {"9d": quaternion_multiply(NORTH_WEST, with_field), "6d": Madgwick(**given).Q}


def ahrs_mahony(recording: ImuRecording) -> Answer:
    """ahrs's Mahony with BROAD's best gains for all trials, 0.74 and 0.0012."""
    given = {
        "gyr": recording.gyro,
        "acc": recording.accel,
        "frequency": recording.rate,
        "k_P": 0.74,
        "k_I": 0.0012,
    }
    start = attitude_from_vectors(recording.accel[0], recording.mag[0])
    return {"9d": AhrsMahony(**given, mag=recording.mag, q0=start).Q, "6d": AhrsMahony(**given).Q}


Peer = Callable[[ImuRecording], Answer]
PEERS: dict[str, Peer] = {"vqf": vqf, "basic_vqf": basic_vqf, "offline_vqf": offline_vqf, "imufusion": fusion}
SLOW_PEERS: dict[str, Peer] = {"ahrs_madgwick": ahrs_madgwick, "ahrs_mahony": ahrs_mahony}  # 50 µs a sample
