"""From poses of a marker to readings of an attitude, and those together with a gyro.

>>> stream = attitude_readings(t, poses)  # doctest: +SKIP
>>> run = fuse_attitude(ExtendedKalmanFilter(), gyro, stream, noise)  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.manifold import SO3, Product, Vector
from sequential.model import Gaussian, StateSpace
from sequential.models import GyroAttitude, TwoModeOrientation, two_mode_readings
from sequential.noise import ImuNoise
from sequential.run import run

if TYPE_CHECKING:
    from sequential.history import Run
    from sequential.run import Estimator
    from vision3d.markers import MarkerPose

__all__ = ["attitude_readings", "fuse_attitude"]


def attitude_readings(t: ArrayLike, poses: Sequence[MarkerPose | None]) -> Stream:
    """Readings camera_q_marker of a `sequential.TwoModeOrientation`, one for each time with a pose.

    Parameters
    ----------
    t : (N,) seconds or int ns, of the frames
    poses : N of `vision3d.markers.marker_pose`; None where the marker was not seen

    Raises
    ------
    ShapeError, DataError
        where there is not one pose a time, or no pose at all.
    """
    stamps = np.atleast_1d(nanoseconds(t))
    if len(stamps) != len(poses):
        raise ShapeError(f"{len(poses)} poses need as many times, got {len(stamps)}")
    seen = [(stamp, pose) for stamp, pose in zip(stamps, poses, strict=True) if pose is not None]
    if not seen:
        raise DataError("the marker is in none of the frames; is it of this dictionary, and is it this one?")
    absent = np.full(4, np.nan)
    modes = [(pose.modes[0], pose.modes[-1]) for _, pose in seen]
    second = [b.camera_T_marker[:4] if b is not a else absent for a, b in modes]
    return two_mode_readings(
        np.array([stamp for stamp, _ in seen]),
        [a.camera_T_marker[:4] for a, _ in modes],
        second,
        [pose.odds for _, pose in seen],
        [a.cov[:3, :3] for a, _ in modes],
        [b.cov[:3, :3] for _, b in modes],
    )


def fuse_attitude(
    estimator: Estimator,
    gyro: Stream,
    marker: Stream,
    noise: ImuNoise,
    *,
    bias_sigma: float = 0.1,
    mount_sigma: float = 0.0,
    at: NDArray[np.int64] | None = None,
) -> Run:
    """Attitude of a body that carries a gyro and a marker (or a camera that sees one), and the gyro's bias.

    Begun once from each mode of the first sighting; the run with the higher likelihood is returned.

    Parameters
    ----------
    estimator : any filter, smoother or graph
    gyro : (N, 3) rad/s; samples are averaged in pairs, which makes their integration second order in dt
    marker : of `attitude_readings`; sightings before the gyro's first sample or after its last are left out
    noise : of the gyro
    bias_sigma : of the gyro's bias about zero before anything is known, rad/s
    mount_sigma : how far the marker's axes may be turned from the gyro's, rad; zero is not at all
    at : further times of estimates, ns

    Returns
    -------
    Run
        of a product state with the parts `attitude` and `gyro_bias`, and `mount` where it is sought.

    Raises
    ------
    DataError, ModelError, GapError
        where the two recordings do not overlap in time, among others.
    """
    marker = marker.select(_together(gyro, marker))
    first, others = marker.select(np.arange(1)), marker.select(np.arange(1, len(marker)))
    rates = Stream(gyro.t[:-1], 0.5 * (gyro.values[1:] + gyro.values[:-1]))
    log, known = SensorLog({"gyro": rates, "marker": others}), first.keys()[0]
    runs = []
    for q in (known[:4], known[4:8]):
        if q.any():
            model = _declare(first, q, noise, bias_sigma, mount_sigma)
            runs.append(run(estimator, model, log, at=at))
    return max(runs, key=lambda one: one.log_likelihood)


def _together(gyro: Stream, marker: Stream) -> NDArray[np.bool_]:
    """(N,) sightings while the gyro ran."""
    if gyro.values.shape[1] != 3 or marker.values.shape[1] != 4 or marker.noise_cov is None:
        raise ShapeError(
            "fuse_attitude takes a gyro's stream (N, 3) rad/s and one of attitude_readings, got "
            f"{gyro.values.shape} and {marker.values.shape}"
        )
    inside = np.zeros(len(marker), dtype=bool)
    if len(gyro) and len(marker):
        inside = (marker.t >= gyro.t[0]) & (marker.t <= gyro.t[-1])
    if len(gyro) < 2 or inside.sum() < 2:
        spans = [
            f"from {one.t[0] * 1e-9:.3f} to {one.t[-1] * 1e-9:.3f} s" if len(one) else "nothing"
            for one in (gyro, marker)
        ]
        raise DataError(
            f"the gyro covers {spans[0]} and the marker {spans[1]}: {int(inside.sum())} sightings "
            "fall within, 2 are needed; set both clocks to one origin "
            "(factorlab calibrate cam-imu finds the offset)"
        )
    return np.asarray(inside)


def _declare(
    first: Stream, q: NDArray[np.float64], noise: ImuNoise, bias_sigma: float, mount_sigma: float
) -> StateSpace:
    """Attitude and bias from a first sighting, with the marker's mount where it is unknown."""
    free = mount_sigma > 0.0
    mount = {"mount": SO3()} if free else {}
    state = Product(attitude=SO3(), gyro_bias=Vector(3), **mount)
    mean, cov = state.identity(), np.zeros((state.dim, state.dim))
    mean[:4] = q
    cov[np.arange(3, 6), np.arange(3, 6)] = bias_sigma**2
    seen = np.asarray(first.noise_cov)[0]
    cov[:3, :3] = seen
    if free:  # the first sighting says where the marker is, and that the body is so far off it
        cov[np.arange(6, 9), np.arange(6, 9)] = mount_sigma**2
        cov[:3, :3] += mount_sigma**2 * np.eye(3)
        cov[:3, 6:] = cov[6:, :3] = -(mount_sigma**2) * np.eye(3)
    sensor = TwoModeOrientation(seen, mount="mount" if free else None)
    return StateSpace(
        state, Gaussian(mean, cov), GyroAttitude(noise), {"marker": sensor}, "gyro",
        start=int(first.t[0]), static=tuple(mount), check=False,
    )  # fmt: skip
