"""Which motions a recording holds, and which are missing for a calibration.

The rotation between camera and IMU shows in turns about two axes at least: about a single one, they could be
turned against each other without anybody noticing.  The lever arm shows in turns too: along an axis that all
turns go about it stays hidden.  The offset of the clocks shows where turns begin and end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import UnderConstrainedError
from sequential.manifold import SO3
from sequential.manifold.quaternion import rotation_matrix
from vision3d.inertial.result import CamImuCalibration

__all__ = ["Excitation", "axis_words", "check_turns", "excitation_of", "missing_motion", "require_observable"]

Array = NDArray[np.float64]
SPAN_S = 0.5  # over which turns are taken from frames, whose noise is that of single poses
LEAST_RATE = np.radians(3.0)  # rad/s, RMS about the busiest axis
LEAST_SECOND = np.radians(1.5)  # and about the next
LEAST_SHARE = 0.04
AXES = ("x (nodding)", "y (panning)", "z (rolling)")
GIVEN_UP = (np.radians(2.0), 0.1, 0.02)  # σ of rotation rad, translation m, offset s that are no result
RECIPE = (
    "turn the rig to and fro by 20 to 30° about each of the camera's three axes (nod, pan, roll), about one "
    "turn a second, and shake it a little along each, the whole board in view"
)


@dataclass(frozen=True, eq=False)
class Excitation:
    """How much a recording moves, in the camera's axes.

    Parameters
    ----------
    rate : (3,) RMS of the rate of turning about x, y, z, rad/s
    rate_moments : (3, 3) mean of rate rateᵀ
    angular_acceleration : RMS, rad/s²
    acceleration : (3,) RMS of the acceleration along the board's axes, m/s²
    """

    rate: Array
    rate_moments: Array
    angular_acceleration: float
    acceleration: Array

    @property
    def principal(self) -> tuple[Array, Array]:
        """RMS rates (3,), falling, and the axes (3, 3) in columns that they are about."""
        values, vectors = np.linalg.eigh(self.rate_moments)
        return np.sqrt(np.maximum(values[::-1], 0.0)), vectors[:, ::-1]


def axis_words(axis: Array) -> str:
    """The camera's axis that a direction is nearest to."""
    return AXES[int(np.argmax(np.abs(axis)))]


def check_turns(t: Array, board_q_camera: Array) -> None:
    """Raise where the frames show too little turning to begin with.

    Raises
    ------
    UnderConstrainedError
        naming the axes about which turns are missing.
    """
    later = np.searchsorted(t, t + SPAN_S)
    kept = later < len(t)
    kept[kept] &= t[later[kept]] - t[kept] < 2.0 * SPAN_S
    if not kept.any():
        return
    begin, end = np.flatnonzero(kept), later[kept]
    rates = SO3().local(board_q_camera[begin], board_q_camera[end]) / (t[end] - t[begin])[:, None]
    # a few frames whose board was read the wrong way round do not make a motion
    sizes = np.linalg.norm(rates, axis=1)
    rates = rates[sizes <= 4.0 * max(float(np.median(sizes)), 1e-9)]
    moments = rates.T @ rates / max(len(rates), 1)
    found = Excitation(np.sqrt(np.diagonal(moments)), moments, 0.0, np.zeros(3))
    size, axes = found.principal
    if size[0] < LEAST_RATE:
        raise UnderConstrainedError(
            f"the rig hardly turns (RMS {np.degrees(size[0]):.1f} °/s about its busiest axis), so that "
            f"neither rotation, translation nor the offset of the clocks can be told; {RECIPE}"
        )
    if size[1] < max(LEAST_SECOND, LEAST_SHARE * size[0]):
        others = [name for name in AXES if name != axis_words(axes[:, 0])]
        raise UnderConstrainedError(
            f"the rig turns about one axis only, the camera's {axis_words(axes[:, 0])}: rotation about it "
            f"and translation along it stay unknown; turn it about {' and '.join(others)} as well"
        )


def excitation_of(found: CamImuCalibration) -> Excitation:
    """Motion of the estimated trajectory, at the IMU's samples."""
    state = found.adjusted.state
    t = found.problem.imu.t
    _, rate, _, _, acceleration = state.motion(t)
    turned = rate @ rotation_matrix(state.camera_T_imu[:4]).T
    step = np.diff(t)
    smooth = step < 3.0 * np.median(step)
    jerk = (np.diff(rate, axis=0) / step[:, None])[smooth]
    return Excitation(
        np.sqrt(np.mean(turned**2, axis=0)),
        turned.T @ turned / len(t),
        float(np.sqrt(np.mean(np.sum(jerk**2, axis=1)))),
        np.sqrt(np.mean(acceleration**2, axis=0)),
    )


def missing_motion(found: CamImuCalibration, excitation: Excitation) -> str:
    """What to do for the least sure of rotation, translation and offset, in words."""
    size, axes = excitation.principal
    if size[2] < 0.3 * size[0]:
        return f"turn it more about the camera's {axis_words(axes[:, 2])}"
    if float(np.linalg.norm(excitation.acceleration)) < 0.3 and size[0] < np.radians(20.0):
        return "move faster: turn it to and fro about once a second"
    return "record longer, turning to and fro about all three axes"


def require_observable(found: CamImuCalibration) -> None:
    """Raise where the covariance says that something was not found.

    Raises
    ------
    UnderConstrainedError
        naming it, how sure it is, and the motion that is missing.
    """
    worst = (float(found.rotation_std.max()), float(found.translation_std.max()), found.time_offset_std_s)
    names = (
        f"rotation (σ {np.degrees(worst[0]):.2g}°)",
        f"translation (σ {1e3 * worst[1]:.3g} mm)",
        f"offset of the clocks (σ {1e3 * worst[2]:.3g} ms)",
    )
    free = [name for name, value, limit in zip(names, worst, GIVEN_UP, strict=True) if not value < limit]
    if free:
        moved = excitation_of(found)
        rates = ", ".join(
            f"{np.degrees(value):.1f} about {name}" for value, name in zip(moved.rate, AXES, strict=True)
        )
        raise UnderConstrainedError(
            f"the motion does not determine {' and '.join(free)}; {missing_motion(found, moved)} (RMS °/s "
            f"now: {rates})"
        )
