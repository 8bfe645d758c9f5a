"""The whole way from sightings to a map: start, gate, solve, with an IMU or without.

    found = map_markers(sightings)                                   # poses of markers and camera
    found = map_markers(sightings, Inertial(imu, body_T_camera))     # … and velocity, biases, the vertical

Without an IMU the world is the reference marker; with one its z points up, its origin is the reference
marker, and its heading is that of the first solution.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.gating import Gated
from factorlab.marker_map.vision import VisionMap, vision_map
from sequential.errors import DataError
from sequential.manifold import SE3
from sequential.noise import ImuNoise
from vision3d.markers.sightings import MarkerSightings

if TYPE_CHECKING:
    from factorlab.graph.marker_map import MapCovariance, MapSolved
    from sequential.sensors.recording import ImuRecording

__all__ = ["USUAL", "Inertial", "MarkerMap", "finish", "map_markers"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
USUAL = ImuNoise(gyro_density=1e-3, accel_density=1e-2, gyro_bias_walk=1e-4, accel_bias_walk=1e-3)
"""A consumer's MEMS in a hand, with room for vibration: five to ten times what data sheets say."""


@dataclass(frozen=True, eq=False)
class Inertial:
    """An IMU beside the camera; its axes are the body's.

    Parameters
    ----------
    imu : stamps on its own clock
    body_T_camera : (7,), Kalibr's T_cam_imu inverted
    noise : densities
    offset_s : IMU time is camera time plus this (Kalibr's timeshift_cam_imu)
    gravity : m/s²
    bias_sigmas : of the accelerometer (m/s²) and the gyro (rad/s) about zero
    """

    imu: ImuRecording
    body_T_camera: Array
    noise: ImuNoise = USUAL
    offset_s: float = 0.0
    gravity: float = 9.81
    bias_sigmas: tuple[float, float] = (0.5, 0.05)


@dataclass(frozen=True, eq=False)
class MarkerMap:
    """What was found; rows of markers are those of `sightings.ids`, of frames those of `frames`.

    Parameters
    ----------
    sightings : as given, on the IMU's clock where there is one
    body_T_camera : (7,), the identity without an IMU
    reference : row of the marker that holds the gauge
    placed : (M,) markers in the map
    poses : (M, 7) world_T_marker, NaN where not placed
    marker_covs : (M, 6, 6) relative to the reference
    frames : (F,) rows of `sightings.t` with a pose
    trajectory : (F, 7) world_T_body
    frame_covs : (F, 6, 6), or (F, 15, 15): pose, velocity in the world, accelerometer and gyro bias
    velocities, biases : (F, 3) and (F, 6), or None
    gated : which sightings were taken, and what was rejected
    chi2 : (S,) squared norm of the whitened errors of each sighting that was taken, NaN for others
    scale : factor on the variances of corners, 1 where they fit as they claim
    gravity : m/s², length of gravity where it is left free; None without an IMU
    size : by the IMU, size asked for over size given, and its standard deviation
    decided : frames whose pose only motion could tell from its mirror image
    """

    sightings: MarkerSightings
    body_T_camera: Array
    reference: int
    placed: NDArray[np.bool_]
    poses: Array
    marker_covs: Array
    frames: Ints
    trajectory: Array
    frame_covs: Array
    velocities: Array | None
    biases: Array | None
    gated: Gated
    chi2: Array
    scale: float
    gravity: float | None
    decided: int
    iterations: int
    cost: float
    joint: Array = field(repr=False, default_factory=lambda: np.zeros((0, 0)))
    inertial: Inertial | None = None
    size: tuple[float, float] | None = None

    @property
    def t(self) -> Ints:
        """(F,) ns of the trajectory."""
        return self.sightings.t[self.frames]

    @property
    def ids(self) -> Ints:
        """Numbers of the markers in the map."""
        return self.sightings.ids[self.placed]

    @property
    def flat(self) -> bool:
        """Whether all markers of the map lie in one plane (a hundredth of their extent)."""
        corners = self.corners().reshape(-1, 3)
        if len(corners) < 8:
            return True
        spread = np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)
        return bool(spread[2] < 0.01 * spread[0])

    def misses(self) -> Array:
        """(S, 4, 2) px, projected less measured corners of every sighting; NaN where it has no pose."""
        from factorlab.graph.marker_rows import CornerRows

        rows = np.full(len(self.sightings.t), -1)
        rows[self.frames] = np.arange(len(self.frames))
        known = (rows[self.sightings.frame] >= 0) & self.placed[self.sightings.marker]
        some = self.sightings.keep(known)
        corners = CornerRows.of(some, self.body_T_camera)
        inside = corners.in_camera(self.trajectory[rows[some.frame]], self.poses[some.marker])
        miss = np.full((len(self.sightings), 4, 2), np.nan)
        miss[known] = some.camera.project(inside) - some.corners
        return miss

    def corners(self) -> Array:
        """(P, 4, 3) corners of the placed markers in the world, m."""
        from vision3d.markers import marker_corners
        from vision3d.rigid import transform

        rows = np.flatnonzero(self.placed)
        sizes = self.sightings.size_m
        return np.array([transform(self.poses[k], marker_corners(float(sizes[k]))) for k in rows]).reshape(
            -1, 4, 3
        )


def map_markers(
    sightings: MarkerSightings, inertial: Inertial | None = None, *, reference: int | None = None
) -> MarkerMap:
    """Build the map.

    Parameters
    ----------
    sightings : of one camera
    inertial : an IMU on the same body, or None
    reference : number of the marker at the origin; by default the one that most others hang on

    Raises
    ------
    DataError
        where no marker was seen, the reference among them, or camera and IMU have no time in common.
    UnderConstrainedError, NotConvergedError
    """
    root = _checked(sightings, reference)
    if inertial is not None:
        sightings = sightings.shifted(inertial.offset_s)
    mount = SE3().identity() if inertial is None else np.asarray(inertial.body_T_camera, dtype=np.float64)
    seen = vision_map(sightings, mount, root, _turns(sightings, inertial))
    if inertial is not None:
        from factorlab.marker_map.with_imu import with_imu

        return with_imu(seen, inertial)
    from factorlab.graph.marker_map import MapState

    graph = seen.graph(seen.gated.taken, robust=False)
    solved = graph.solve(MapState(seen.poses[seen.frames], seen.markers[seen.rows]))
    return finish(seen, solved, graph.covariance(solved.state))


def _checked(sightings: MarkerSightings, reference: int | None) -> int | None:
    if not len(sightings):
        raise DataError("no marker was seen in any frame; check the dictionary and the light")
    if reference is None:
        return None
    if reference not in sightings.ids:
        seen = ", ".join(map(str, sightings.ids))
        raise DataError(f"marker {reference} was not seen, so it cannot be the reference; seen were {seen}")
    return int(np.searchsorted(sightings.ids, reference))


def _turns(sightings: MarkerSightings, inertial: Inertial | None) -> Array | None:
    """(F-1, 3) turns of the body from frame to frame by the gyro; NaN where it paused."""
    if inertial is None:
        return None
    from factorlab.marker_map.inertial_start import deltas
    from factorlab.marker_map.segments import cut_at_frames
    from sequential.manifold import quaternion_log

    told = deltas(cut_at_frames(inertial.imu, sightings.t), np.zeros(6))
    turns = np.full((len(told.turn), 3), np.nan)
    known = np.isfinite(told.turn[:, 0])
    turns[known] = quaternion_log(told.turn[known])
    return turns


def finish(
    seen: VisionMap,
    solved: MapSolved,
    cov: MapCovariance,
    inertial: Inertial | None = None,
    gravity: float | None = None,
    size: tuple[float, float] | None = None,
) -> MarkerMap:
    """Everything under the numbers of the sightings."""
    count, rows = len(seen.sightings.ids), seen.rows
    poses, covs = np.full((count, 7), np.nan), np.full((count, 6, 6), np.nan)
    poses[rows] = solved.state.markers
    covs[rows] = np.array([cov.marker(k) for k in range(len(rows))])
    placed = np.zeros(count, dtype=np.bool_)
    placed[rows] = True
    chi2 = np.where(seen.gated.taken, seen.chi2(), np.nan)
    state = solved.state
    return MarkerMap(
        seen.sightings, seen.mount, seen.reference, placed, poses, covs, seen.frames, state.frames,
        cov.frames, state.velocities, state.biases, seen.gated, chi2, seen.scale, gravity, seen.decided,
        seen.iterations, solved.cost, cov.markers, inertial, size,
    )  # fmt: skip
