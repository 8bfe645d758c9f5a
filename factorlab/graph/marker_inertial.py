"""What an IMU says between frames: one native `CombinedImuFactor` a frame, linearised by GTSAM all at once.

The factors never meet a Python factor: their rows are read out and solved together with the corners' in
`factorlab.graph.marker_map`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.factors.inertial import combined_parameters, pose3
from factorlab.graph.keys import B, V, X
from sequential.models import Strapdown
from sequential.noise import ImuNoise

__all__ = ["InertialLinks", "Segment"]

Array = NDArray[np.float64]
BEFORE = [*range(9), *range(18, 24)]  # columns of pose, velocity and bias of the earlier frame
AFTER = [*range(9, 18), *range(24, 30)]


@dataclass(frozen=True, eq=False)
class Segment:
    """Samples between two frames: specific force (n, 3) m/s², rate (n, 3) rad/s, each held for dt (n,) s."""

    accel: Array
    gyro: Array
    dt: Array

    @property
    def seconds(self) -> float:
        """From one frame to the next."""
        return float(self.dt.sum())

    def turned(self, bias: Array) -> Array:
        """Forces (n, 3) as seen from the attitude at the start of each piece, where GTSAM holds them.

        A body that turns by ω dt meets its mean force half way: without this the integration is of first
        order in dt, an error of ½ ω dt g that a bias of the accelerometer would swallow.
        """
        half = 0.5 * self.dt[:, None] * (self.gyro - bias[3:])
        forces: Array = self.accel + np.cross(half, self.accel - bias[:3])
        return forces


@dataclass(frozen=True, eq=False)
class InertialLinks:
    """Factors from frame to frame.

    Parameters
    ----------
    segments : (K-1) each from a frame to the next; None where the IMU paused: only the biases walk on then
    seconds : (K-1,) between the frames
    noise : densities of the IMU; none may be zero
    gravity : m/s², along -z of the world
    """

    segments: Sequence[Segment | None]
    seconds: Array
    noise: ImuNoise
    gravity: float = 9.81
    _linked: list[int] = field(init=False)

    def __post_init__(self) -> None:
        linked = [k for k, segment in enumerate(self.segments) if segment is not None]
        object.__setattr__(self, "_linked", linked)

    def about(self, biases: Array) -> Any:
        """The native graph, preintegrated about biases (K, 6): accelerometer, gyro."""
        parameters = combined_parameters(Strapdown(self.noise, (0.0, 0.0, -self.gravity)))
        graph = gtsam.NonlinearFactorGraph()
        for k in self._linked:
            segment = self.segments[k]
            assert segment is not None  # noqa: S101 - those that are None are not linked
            pim = gtsam.PreintegratedCombinedMeasurements(parameters, _bias(biases[k]))
            integrate = pim.integrateMeasurement
            forces = segment.turned(biases[k])
            for force, rate, dt in zip(forces, segment.gyro, segment.dt.tolist(), strict=True):
                integrate(force, rate, dt)
            graph.add(gtsam.CombinedImuFactor(X(k), V(k), X(k + 1), V(k + 1), B(k), B(k + 1), pim))
        return graph

    def cost(self, graph: Any, poses: Array, velocities: Array, biases: Array) -> float:
        """Half the sum of squares of everything between frames."""
        values = _values(poses, velocities, biases)
        walked = self._walk(biases)
        return float(graph.error(values)) + 0.5 * float(np.sum(walked**2))

    def rows(self, graph: Any, poses: Array, velocities: Array, biases: Array) -> tuple[Array, Array, Array]:
        """Whitened errors (K-1, 15) and Jacobians (K-1, 15, 15) by the frame before and after.

        A frame's step is that of its pose (6), velocity in the world (3), accelerometer and gyro bias (6).
        """
        count = len(self.segments)
        error, before, after = np.zeros((count, 15)), np.zeros((count, 15, 15)), np.zeros((count, 15, 15))
        linear = graph.linearize(_values(poses, velocities, biases))
        if self._linked:
            rows = np.stack([linear.at(i).augmentedJacobian() for i in range(linear.size())])
            before[self._linked], after[self._linked] = rows[:, :, BEFORE], rows[:, :, AFTER]
            error[self._linked] = -rows[:, :, 30]
        weight = 1.0 / self._walk_sigmas()
        apart = [k for k in range(count) if self.segments[k] is None]
        error[:, 9:][apart] = self._walk(biases)[apart]
        for k in apart:
            before[k, 9:, 9:], after[k, 9:, 9:] = -np.diag(weight[k]), np.diag(weight[k])
        return error, before, after

    def _walk_sigmas(self) -> Array:
        """(K-1, 6) how far biases walk from frame to frame."""
        walk = np.repeat([self.noise.accel_bias_walk, self.noise.gyro_bias_walk], 3)
        sigmas: Array = walk * np.sqrt(self.seconds)[:, None]
        return sigmas

    def _walk(self, biases: Array) -> Array:
        """(K-1, 6) whitened walk of the biases where no factor says it, else zero."""
        white = np.diff(biases, axis=0) / self._walk_sigmas()
        white[self._linked] = 0.0
        return white


def _bias(row: Array) -> Any:
    return gtsam.imuBias.ConstantBias(row[:3], row[3:])


def _values(poses: Array, velocities: Array, biases: Array) -> Any:
    values = gtsam.Values()
    for k, (pose, velocity, bias) in enumerate(zip(poses, velocities, biases, strict=True)):
        values.insert(X(k), pose3(pose))
        values.insert(V(k), velocity)
        values.insert(B(k), _bias(bias))
    return values
