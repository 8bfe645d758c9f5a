"""A room with markers that a camera with an IMU walks through: exact truth, and what the sensors would say.

The motion is a sum of slow waves, so that rates and accelerations are derivatives and not differences.

>>> world = MarkerWorld.room(np.random.default_rng(0))  # doctest: +SKIP
>>> told = world.record(12.0, rng)  # doctest: +SKIP
>>> told.sightings, told.imu, told.truth  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import (
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_multiply,
    right_jacobian,
    rotate,
    rotation_matrix,
)
from sequential.noise import ImuNoise
from vision3d.rigid import compose, inverse, transform

if TYPE_CHECKING:
    from sequential.sensors.recording import ImuRecording
    from vision3d.camera import Camera
    from vision3d.markers.sightings import MarkerSightings

__all__ = ["MarkerWorld", "Recorded", "Truth"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
GRAVITY = 9.81
NOISE = ImuNoise(gyro_density=1e-3, accel_density=1e-2, gyro_bias_walk=5e-5, accel_bias_walk=5e-4)
BIAS_SIGMAS = (0.2, 0.02)
FACING = np.array(
    [[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]
)  # columns: right, down, ahead, in a world with z up
LYING = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])
SIDE = np.array([[0, 0, 1.0], [-1.0, 0, 0], [0, -1.0, 0]])  # on the wall to the right
MARGIN_PX, LEAST_PX, OBLIQUE = 4.0, 16.0, 0.2


@dataclass(frozen=True, eq=False)
class Truth:
    """At the frames: poses world_T_body (F, 7), velocities (F, 3), biases (F, 6); markers by number."""

    t: Ints
    poses: Array
    velocities: Array
    biases: Array
    markers: Mapping[int, Array]


@dataclass(frozen=True, eq=False)
class Recorded:
    """What the sensors say, and the truth."""

    sightings: MarkerSightings
    imu: ImuRecording
    truth: Truth


@dataclass(frozen=True, eq=False)
class MarkerWorld:
    """Camera, mount, markers and a motion.

    Parameters
    ----------
    camera : any lens
    body_T_camera : (7,) of the IMU's axes, in which the body is told
    size_m : side of every marker
    markers : world_T_marker (7,) by number
    reach : (6,) amplitudes of turns (rad) and of places (m); rates (6,) rad/s and phases (6,) of the waves
    """

    camera: Camera
    body_T_camera: Array
    size_m: float
    markers: Mapping[int, Array]
    reach: Array
    rates: Array
    phases: Array

    @classmethod
    def room(
        cls, rng: np.random.Generator, *, count: int = 8, flat: bool = False, swing: float = 1.0
    ) -> MarkerWorld:
        """Markers on a wall, a table and a second wall, or with `flat` on the one wall only."""
        from vision3d.camera import Camera

        camera = Camera("brown4", (520.0, 521.0, 321.0, 238.5), (-0.12, 0.05, 4e-4, -3e-4), (640, 480))
        mount = np.concatenate([quaternion_from_matrix(FACING), [0.06, 0.03, -0.02]])
        places = [
            (FACING, (-0.45, 1.35, 1.25)), (FACING, (0.1, 1.35, 0.85)), (FACING, (0.42, 1.35, 1.3)),
            (FACING, (-0.15, 1.35, 1.4)),
            *([(FACING, (-0.4, 1.35, 0.75)), (FACING, (0.45, 1.35, 0.7)), (FACING, (-0.75, 1.35, 1.0)),
               (FACING, (0.15, 1.35, 1.15))] if flat else
              [(LYING, (-0.3, 1.0, 0.6)), (LYING, (0.25, 0.95, 0.6)), (SIDE, (0.8, 1.0, 1.1)),
               (SIDE, (0.8, 0.9, 0.8))]),
        ]  # fmt: skip
        numbers = [3, 7, 12, 18, 21, 24, 30, 33]
        markers = {}
        for number, (turn, place) in zip(numbers[:count], places, strict=False):
            spun = quaternion_multiply(
                quaternion_from_matrix(turn), quaternion_exp(np.array([0.0, 0.0, rng.uniform(-0.4, 0.4)]))
            )
            markers[number] = np.concatenate([spun, place + rng.uniform(-0.03, 0.03, 3) * (0 if flat else 1)])
        reach = swing * np.array([0.16, 0.14, 0.25, 0.28, 0.22, 0.16])
        rates = 2 * np.pi * rng.uniform([0.35, 0.3, 0.3, 0.25, 0.2, 0.3], [0.6, 0.55, 0.5, 0.45, 0.4, 0.5])
        return cls(camera, mount, 0.12, MappingProxyType(markers), reach, rates, rng.uniform(0, 2 * np.pi, 6))

    def _waves(self, t: Array) -> tuple[Array, Array, Array]:
        angle = np.asarray(t, dtype=np.float64)[..., None] * self.rates + self.phases
        return (
            self.reach * np.sin(angle),
            self.reach * self.rates * np.cos(angle),
            -self.reach * self.rates**2 * np.sin(angle),
        )

    def poses(self, t: Array) -> Array:
        """world_T_body (..., 7) at times in seconds."""
        waves = self._waves(t)[0]
        turn = quaternion_exp(waves[..., :3])
        return np.concatenate([turn, waves[..., 3:] + np.array([0.0, 0.0, 1.05])], axis=-1)

    def velocities(self, t: Array) -> Array:
        """(..., 3) m/s in the world."""
        return self._waves(t)[1][..., 3:]

    def inertial(self, t: Array) -> tuple[Array, Array]:
        """Specific force (..., 3) and rate (..., 3) of the body, without noise and bias."""
        angle, speed, bend = self._waves(t)
        rate = np.einsum("...ij,...j->...i", right_jacobian(angle[..., :3]), speed[..., :3])
        attitude = rotation_matrix(quaternion_exp(angle[..., :3]))
        force = np.einsum("...ji,...j->...i", attitude, bend[..., 3:] + np.array([0.0, 0.0, GRAVITY]))
        return force, rate

    def record(
        self,
        seconds: float,
        rng: np.random.Generator,
        *,
        fps: float = 15.0,
        imu_rate: float = 100.0,
        sigma_px: float = 0.15,
        noise: ImuNoise = NOISE,
        seen: float = 1.0,
    ) -> Recorded:
        """Corners with noise, and an IMU with noise and biases; `seen` is the share of sightings kept."""
        from vision3d.markers import Marker
        from vision3d.markers.sightings import MarkerSightings

        t = np.arange(round(seconds * fps) + 1) / fps
        cov = sigma_px**2 * (np.eye(8) + 0.1 * np.ones((8, 8)))
        root = np.linalg.cholesky(cov)
        frames = []
        for moment, pose in zip(t, self.poses(t), strict=True):
            markers = [
                Marker(
                    number, corners + (root @ rng.standard_normal(8)).reshape(4, 2), np.array(sigma_px), cov
                )
                for number, corners in self.visible(pose)
                if rng.uniform() < seen
            ]
            frames.append((round(moment * 1e9), markers))
        imu, biases = self.imu(t, imu_rate, noise, rng)
        truth = Truth(
            np.round(t * 1e9).astype(np.int64), self.poses(t), self.velocities(t), biases, self.markers
        )
        return Recorded(MarkerSightings.from_frames(self.camera, self.size_m, frames), imu, truth)

    def visible(self, world_T_body: Array) -> Iterator[tuple[int, Array]]:
        """Numbers and exact corners (4, 2) of the markers that a pose sees whole."""
        from vision3d.markers import marker_corners

        camera_T_world = inverse(compose(world_T_body, self.body_T_camera))
        for number, world_T_marker in self.markers.items():
            pose = compose(camera_T_world, world_T_marker)
            sight = pose[4:] / np.linalg.norm(pose[4:])
            if rotate(pose[:4], np.array([0.0, 0.0, 1.0])) @ sight < OBLIQUE:
                continue
            corners = self.camera.project(transform(pose, marker_corners(self.size_m)))
            inside = np.isfinite(corners).all() and (corners > MARGIN_PX).all()
            inside = inside and (corners < np.array(self.camera.size) - 1 - MARGIN_PX).all()
            if inside and np.linalg.norm(np.diff(corners, axis=0), axis=1).min() > LEAST_PX:
                yield number, corners

    def imu(
        self, frames: Array, rate: float, noise: ImuNoise, rng: np.random.Generator
    ) -> tuple[ImuRecording, Array]:
        """The recording, a little longer than the frames, and its biases (F, 6) at them."""
        from sequential.sensors.recording import ImuRecording

        t = np.arange(-5, int(np.ceil(frames[-1] * rate)) + 6) / rate
        force, turn = self.inertial(t)
        dt = 1.0 / rate
        walk = np.sqrt(dt) * np.repeat([noise.accel_bias_walk, noise.gyro_bias_walk], 3)
        steps = rng.standard_normal((len(t), 6)) * walk
        steps[0] = rng.standard_normal(6) * np.repeat(BIAS_SIGMAS, 3)
        bias = np.cumsum(steps, axis=0)
        sigma = np.repeat([noise.accel_density, noise.gyro_density], 3) / np.sqrt(dt)
        read = np.hstack([force, turn]) + bias + rng.standard_normal((len(t), 6)) * sigma
        at = np.column_stack([np.interp(frames, t, bias[:, k]) for k in range(6)])
        stamps = np.round(t * 1e9).astype(np.int64)
        return ImuRecording(stamps, accel=read[:, :3], gyro=read[:, 3:], name="simulated"), at
