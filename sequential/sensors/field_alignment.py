"""The rotation from a magnetometer's frame to that of the inertial sensors beside it.

An ellipsoid is the same for every rotation of the calibrated readings, so that norms cannot show how the
magnetometer lies on its board.  A gyro can: over a turn that it measures, the field in its frame turns by the
opposite.  An accelerometer can too: at rest the angle between gravity and the field is the same everywhere.
Neither can tell left-handed axes from a field that points the other way; right-handed ones are taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, UnderConstrainedError
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply, rotation_matrix
from sequential.manifold.so3 import skew
from sequential.sensors.ellipsoid import MagnetometerFit, check_field
from sequential.sensors.finding import Finding
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.recording import ImuRecording

__all__ = ["FieldAlignment", "align_field"]

Array = NDArray[np.float64]
# residuals (K, r) and their derivatives (K, r, p) for an orthogonal matrix and, with gravity, the dip's sine
Problem = Callable[[Array, float], tuple[Array, Array]]
TURN, LEAST_TURN, LONGEST = np.radians(40.0), np.radians(10.0), 1.0  # of a window; s
FEWEST = 30
AT_REST = 0.03  # | |a| - g | over g
BIWEIGHT, TO_SIGMA = 4.685, 1.4826
STEPS, SETTLED = 50, 1e-9
APART = np.radians(4.0)
AGREES = np.radians(7.0)
KNOWN = np.radians(5.0)


@dataclass(frozen=True, slots=True, eq=False)
class FieldAlignment:
    """The aligned calibration, and the rotation that aligned it.

    Parameters
    ----------
    fit : with matrix = rotation @ the symmetric one
    rotation : (3, 3) body_R_mag
    cov : (3, 3) of a small rotation on its right, rad²
    residual : root mean square of what is left, rad of the field's direction
    using : "gyro" or "accel"
    dip : angle of the field below the horizontal (accel), rad; None with the gyro
    """

    fit: MagnetometerFit
    rotation: Array
    cov: Array
    residual: float
    using: str
    dip: float | None = None

    @property
    def angle(self) -> float:
        """Smallest angle between a magnetometer axis and the body axis nearest to it, at worst, rad."""
        return float(np.arccos(np.clip(np.abs(self.rotation).max(axis=1).min(), -1.0, 1.0)))


def align_field(fit: MagnetometerFit, recording: ImuRecording, using: str = "gyro") -> FieldAlignment:
    """Turn a calibrated magnetometer into the frame of the gyro or of the accelerometer.

    Parameters
    ----------
    recording : the one that the fit was made from, or another of the same board

    Raises
    ------
    MissingStreamError, DataError, UnderConstrainedError
        where the sensor is missing, or the motion leaves a rotation free.
    """
    if using not in {"gyro", "accel"}:
        raise DataError(f"align_field: using is {using!r}; it is 'gyro' or 'accel'")
    if fit.planar:
        raise UnderConstrainedError(
            "a planar turn shows no rotation out of its plane: turn in every direction to align it"
        )
    recording.require("mag", using)
    problem, starts = (_by_gyro if using == "gyro" else _by_gravity)(fit, recording)
    found = min((_solved(problem, start, few=True) for start in starts), key=lambda one: one[2])
    rotation, dip, cost, information = _solved(problem, found[0], found[1])
    cov: Array = np.asarray(np.linalg.inv(information)[:3, :3] * cost**2)
    if not np.sqrt(np.linalg.eigvalsh(cov)[-1]) < KNOWN:
        raise UnderConstrainedError(
            f"the motion of recording {recording.name!r} leaves the magnetometer's rotation free by "
            f"{np.degrees(np.sqrt(np.linalg.eigvalsh(cov)[-1])):.0f}°: turn about every axis"
        )
    if cost > AGREES:
        raise DataError(
            f"recording {recording.name!r}: magnetometer and {using} disagree by {np.degrees(cost):.0f}° "
            "however they are turned: the motion is too quick for it"
            + ("; align with the gyro" if using == "accel" else ", or stamps or units are wrong")
        )
    aligned = _turned(fit, rotation, cov, using)
    below = None if using == "gyro" else -dip
    return FieldAlignment(aligned, rotation, cov, cost, using, below)


def _unit_field(fit: MagnetometerFit, recording: ImuRecording) -> tuple[NDArray[np.int64], Array]:
    """Rows with a magnetometer sample, and calibrated directions there."""
    assert recording.mag is not None  # noqa: S101 - require() has looked
    rows = np.flatnonzero(np.isfinite(recording.mag).all(axis=1))
    rows = rows[np.r_[True, (np.diff(recording.mag[rows], axis=0) != 0).any(axis=1)]]
    vectors = fit.calibration.apply(recording.mag[rows]) / fit.field
    near = np.abs(np.linalg.norm(vectors, axis=1) - 1) < max(0.05, 4 * fit.fit.sigma)
    return rows[near], vectors[near] / np.linalg.norm(vectors[near], axis=1)[:, None]


def _by_gyro(fit: MagnetometerFit, recording: ImuRecording) -> tuple[Problem, list[Array]]:
    """Windows over which the gyro turns: R m1 = before_R_after' R m0."""
    rows, field = _unit_field(fit, recording)
    gyro, dt = recording.gyro, np.diff(recording.seconds, append=recording.seconds[-1])
    assert gyro is not None  # noqa: S101 - require() has looked
    # samples whose gyro reading is the mean of both ends of the interval
    step = np.vstack([(gyro[1:] + gyro[:-1]) / 2, gyro[-1:]]) * dt[:, None]
    angle = np.concatenate([[0.0], np.cumsum(np.linalg.norm(step, axis=1))])
    first, last, k = [], [], 0
    while k < len(rows) - 1:
        # on to where the gyro has turned by TURN, but not for longer than LONGEST
        end = int(np.searchsorted(angle[rows], angle[rows[k]] + TURN))
        late = int(np.searchsorted(recording.seconds[rows], recording.seconds[rows[k]] + LONGEST))
        end = min(max(end, k + 1), max(late, k + 1), len(rows) - 1)
        if angle[rows[end]] - angle[rows[k]] > LEAST_TURN:
            first.append(k)
            last.append(end)
        k = end
    if len(first) < FEWEST:
        raise UnderConstrainedError(
            f"recording {recording.name!r} has {len(first)} turns of {np.degrees(LEAST_TURN):.0f}° or more, "
            f"{FEWEST} are needed to align the magnetometer with the gyro"
        )
    turned = _turns(step, rows[first], rows[last])
    before, after = field[first], field[last]

    def problem(rotation: Array, _: float) -> tuple[Array, Array]:
        residuals = after @ rotation.T - np.einsum("kji,kj->ki", turned, before @ rotation.T)
        slope = -rotation @ _hats(after) + np.swapaxes(turned, 1, 2) @ (rotation @ _hats(before))
        return residuals, slope

    return problem, _cube()


def _turns(step: Array, first: NDArray[np.int64], last: NDArray[np.int64]) -> Array:
    """Rotations (K, 3, 3) over the samples first <= k < last, all windows at once."""
    q = np.tile([1.0, 0.0, 0.0, 0.0], (len(first), 1))
    for k in range(int((last - first).max())):
        inside = first + k < last
        small = np.where(inside[:, None], step[np.minimum(first + k, len(step) - 1)], 0.0)
        q = quaternion_multiply(q, quaternion_exp(small))
    return np.array([rotation_matrix(one) for one in q])


def _by_gravity(fit: MagnetometerFit, recording: ImuRecording) -> tuple[Problem, list[Array]]:
    """Samples near rest: up' R m is the same everywhere."""
    rows, field = _unit_field(fit, recording)
    accel = recording.accel
    assert accel is not None  # noqa: S101 - require() has looked
    norm = np.linalg.norm(accel[rows], axis=1)
    still = np.flatnonzero(np.abs(norm / STANDARD_GRAVITY - 1) < AT_REST)
    # a long rest is one direction, and must not outvote the others
    chosen = still[_apart(accel[rows[still]] / norm[still, None], field[still])] if len(still) else still
    if len(chosen) < FEWEST:
        raise UnderConstrainedError(
            f"recording {recording.name!r} holds {len(chosen)} samples where the accelerometer reads g to "
            f"{100 * AT_REST:.0f} %, {FEWEST} are needed: turn slowly, and check the unit"
        )
    up, m = accel[rows[chosen]] / norm[chosen, None], field[chosen]

    def problem(rotation: Array, dip: float) -> tuple[Array, Array]:
        sine = np.clip(np.einsum("ki,ki->k", up, m @ rotation.T), -0.999, 0.999)
        # as an angle: a sine would draw the dip towards 90°, where it hardly changes
        residuals = np.arcsin(sine) - dip
        slope = np.einsum("ki,kij->kj", up, -rotation @ _hats(m)) / np.sqrt(1 - sine**2)[:, None]
        return residuals[:, None], np.column_stack([slope, -np.ones(len(up))])[:, None, :]

    return problem, _cube()


def _apart(up: Array, field: Array) -> NDArray[np.int64]:
    """Rows at which either direction has turned by APART since the last row kept."""
    both, kept, limit = np.hstack([up, field]), [0], 2 * np.sin(APART / 2)
    for k in range(1, len(both)):
        off = both[k] - both[kept[-1]]
        if max(off[:3] @ off[:3], off[3:] @ off[3:]) > limit**2:
            kept.append(k)
    return np.array(kept)


def _hats(vectors: Array) -> Array:
    return np.array([skew(v) for v in vectors])


def _cube() -> list[Array]:
    """The 24 ways in which axes can be exchanged and reversed and stay right-handed."""
    every = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    return [one for one in every if np.linalg.det(one) > 0]


def _solved(
    problem: Problem, rotation: Array, dip: float = 0.0, *, few: bool = False
) -> tuple[Array, float, float, Array]:
    """Gauss-Newton with the biweight: rotation, sine of the dip, robust residual, information (p, p)."""
    information, scale = np.eye(3), np.inf
    for k in range(4 if few else STEPS):
        residuals, slope = problem(rotation, dip)
        size = np.linalg.norm(residuals, axis=1)
        scale = TO_SIGMA * float(np.median(size)) / np.sqrt(residuals.shape[1]) + 1e-12
        ratio = size / (BIWEIGHT * scale * np.sqrt(residuals.shape[1]))
        weight = np.where(ratio < 1, (1 - ratio**2) ** 2, 0.0) if k else np.ones(len(size))
        information = np.einsum("kri,k,krj->ij", slope, weight, slope)
        gradient = np.einsum("kri,k,kr->i", slope, weight, residuals)
        step = -np.linalg.solve(information + 1e-9 * np.trace(information) * np.eye(len(gradient)), gradient)
        rotation = rotation @ rotation_matrix(quaternion_exp(step[:3]))
        dip += float(step[3]) if len(step) > 3 else 0.0
        if np.abs(step).max() < SETTLED:
            break
    return rotation, dip, scale, information


def _turned(fit: MagnetometerFit, rotation: Array, cov: Array, using: str) -> MagnetometerFit:
    old = fit.calibration
    spread = np.zeros((12, 12))
    spread[:9, :9], spread[9:, 9:] = np.kron(rotation, np.eye(3)), np.eye(3)
    total = np.zeros((12, 12)) if old.cov is None else spread @ old.cov @ spread.T
    small = np.stack([(rotation @ skew(axis) @ old.matrix).ravel() for axis in np.eye(3)], axis=1)
    total[:9, :9] += small @ cov @ small.T
    calibration = replace(old, matrix=rotation @ old.matrix, cov=(total + total.T) / 2)
    sensor = {"gyro": "gyro", "accel": "accelerometer"}[using]
    note = Finding("note", f"aligned with the frame of the {sensor}")
    kept = tuple(one for one in fit.findings if "symmetric one" not in one.what)
    check = check_field(calibration, fit.field, fit.readings)
    return replace(fit, calibration=calibration, check=check, findings=(*kept, note))
