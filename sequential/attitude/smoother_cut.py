"""A recording cut into the nodes of the attitude smoothers: gaps, rest, a first orientation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.attitude.smoother_chain import AttitudeChain, ChainSamples, integrate
from sequential.attitude.smoother_model import AttitudeModel
from sequential.errors import DataError, MissingStreamError
from sequential.sensors.recording import ImuRecording

__all__ = ["attitude_chain"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
GAP = 3.0  # median intervals without a sample
UNKNOWN = 0.3  # s of a gap after which the orientation is begun anew
START = 2.0  # s at the beginning whose mean gives the first orientation
STILL_RATE, STILL_RIPPLE, STILL_ACCEL = np.radians(2.5), np.radians(1.0), 0.25
STILL_GYRO_NOISE, STILL_ACCEL_NOISE = np.radians(2.5), 0.5  # standard deviations within a node
STILL_REACH = 0.5  # s on either side
STUCK_RATE = 0.5  # rad/s of turning in which a field must change


def attitude_chain(recording: ImuRecording, model: AttitudeModel, *, field: bool = True) -> AttitudeChain:
    """Cut a recording into nodes.

    Raises
    ------
    MissingStreamError, DataError
    """
    from sequential.attitude.smoother_nodes_kernel import LOST, RATE

    recording.require("gyro", "accel")
    gyro, accel = recording.gyro, recording.accel
    if gyro is None or accel is None:  # for the type checker: `require` has raised
        raise MissingStreamError("an attitude smoother needs gyro and accelerometer")
    if len(recording) < 2:
        raise DataError(f"recording {recording.name!r} holds one sample; there is no motion to smooth")
    dt, lost = _intervals(recording)
    mag = _field(recording) if field else None
    stride = max(1, round(model.interval / float(np.median(dt))))
    first = np.append(np.arange(0, len(dt), stride), len(dt)).astype(np.int64)
    samples = ChainSamples(dt, lost, gyro, accel, np.full(gyro.shape, np.nan) if mag is None else mag)
    nothing = np.zeros(3)
    nodes = integrate(samples, first, nothing)
    rest = _still(nodes)
    bias = nodes[rest, RATE : RATE + 3].mean(axis=0) if rest.any() else nothing
    reach = max(1, round(START / model.interval))
    fresh = np.full((len(nodes), 3, 3), np.nan)
    for k in np.flatnonzero(nodes[:-1, LOST] > UNKNOWN):
        fresh[k] = _start(nodes[k + 1 : k + 1 + reach])
    start = _start(nodes[:reach])
    return AttitudeChain(model, samples, first, nodes, nothing, rest, bias, start, fresh, mag is not None)


def _intervals(recording: ImuRecording) -> tuple[Array, Array]:
    """(N,) time that each sample is integrated over, and (N,) what a gap before it leaves unknown, s."""
    dt = recording.dt
    usual = float(np.median(dt))
    dt = np.concatenate([[usual], dt])
    gap = dt > GAP * usual
    return np.where(gap, usual, dt), np.where(gap, dt - usual, 0.0)


def _field(recording: ImuRecording) -> Array | None:
    """(N, 3) in units of the usual norm, NaN where there is no reading; None without a magnetometer.

    Raises
    ------
    DataError
        where the body turns and the field does not, or where there is none.
    """
    mag, turning = recording.mag, recording.gyro
    if mag is None or turning is None:
        return None
    norm = np.linalg.norm(mag, axis=1)
    known = np.isfinite(norm) & (norm > 0)
    if not known.any():
        if np.isnan(norm).all():
            return None
        msg = (
            f"mag of recording {recording.name!r} is zero throughout: the magnetometer did not answer; "
            "give the recording without it for a heading that starts at an arbitrary direction"
        )
        raise DataError(msg)
    if known.sum() > 2 and np.all(np.ptp(mag[known], axis=0) == 0) and np.ptp(turning) > STUCK_RATE:
        msg = (
            f"mag of recording {recording.name!r} never changes although the gyro turns: the magnetometer is "
            "stuck; give the recording without it for a heading that starts at an arbitrary direction"
        )
        raise DataError(msg)
    return np.where(known[:, None], mag / np.median(norm[known]), np.nan)


def _still(nodes: Array) -> Flags:
    """(K,) nodes amid others in which neither gyro nor accelerometer departs from its mean."""
    from sequential.attitude.smoother_nodes_kernel import ACCEL, ACCEL_VAR, GYRO_VAR, RATE, TIME

    reach = max(1, round(STILL_REACH / float(np.median(nodes[:, TIME]))))
    if len(nodes) < 2 * reach + 1:
        return np.zeros(len(nodes), dtype=np.bool_)
    rate, pull = _departure(nodes[:, RATE : RATE + 3], reach), _departure(nodes[:, ACCEL : ACCEL + 3], reach)
    mean = np.linalg.norm(_sliding(nodes[:, RATE : RATE + 3], reach), axis=1)
    calm = (mean < STILL_RATE) & (rate < STILL_RIPPLE) & (pull < STILL_ACCEL)
    calm &= (nodes[:, GYRO_VAR] < STILL_GYRO_NOISE**2) & (nodes[:, ACCEL_VAR] < STILL_ACCEL_NOISE**2)
    padded = np.pad(calm, reach, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    return np.ascontiguousarray(windows.all(axis=1))


def _sliding(values: Array, reach: int) -> Array:
    """(K, 3) mean over `reach` rows on either side, the outermost repeated."""
    padded = np.pad(values, ((reach + 1, reach), (0, 0)), mode="edge")
    padded[0] = 0.0
    total = np.cumsum(padded, axis=0)
    return (total[2 * reach + 1 :] - total[: -2 * reach - 1]) / (2 * reach + 1)


def _departure(values: Array, reach: int) -> Array:
    """(K,) distance of each row from the mean around it."""
    return np.asarray(np.linalg.norm(values - _sliding(values, reach), axis=1))


def _start(nodes: Array) -> Array:
    """(3, 3) rotation of the first node: up by the mean specific force, north by the mean field or any.

    The gyro turns what the nodes saw into the frame of the first, so that the body may be turning.
    """
    from sequential.attitude.smoother_nodes_kernel import FIELD, FIELD_TIME, PUSH, TURN

    up, north, turned = np.zeros(3), np.zeros(3), np.eye(3)
    for node in nodes:
        up += turned @ node[PUSH : PUSH + 3]
        if node[FIELD_TIME] > 0:
            north += turned @ node[FIELD : FIELD + 3]
        turned = turned @ node[TURN : TURN + 9].reshape(3, 3)
    size = float(np.linalg.norm(up))
    up = up / size if size > 0 else np.array([0.0, 0.0, 1.0])
    east = np.cross(north, up)
    if np.linalg.norm(east) < 1e-3:
        east = np.cross(np.eye(3)[np.argmin(np.abs(up))], up)
    east /= np.linalg.norm(east)
    return np.stack([east, np.cross(up, east), up])
