"""A body in space that follows its twist, or drifts, as BetweenFactorPose3, with sensors of its pose."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.factors.inertial import flat_pose
from factorlab.graph.factors.pose_sensors import Body, pose3, pose_factor, seen_landmarks
from factorlab.graph.keys import L, X
from factorlab.graph.native import NativeGraph, native_process, noise_model
from factorlab.graph.solve import certain_move
from sequential.compile import compiled
from sequential.driven_pose import DrivenPose
from sequential.manifold import SE3
from sequential.models import RandomWalk
from sequential.timeline import Problem

__all__ = ["SpatialGraph"]

Array = NDArray[np.float64]


class SpatialGraph(NativeGraph):
    """Pose3 X(k); landmarks L(i) held by equality, numbered through all sensors.

    For a batch.  On Barfoot's starry night GTSAM's iSAM2 (and the fixed lag on top of it) loses the camera in
    the first half minute: one Gauss-Newton step an update leaves it 0.3 m off after a second without points,
    and more steps, Dogleg, QR or priors in place of the equalities end in an indeterminate system.
    """

    incremental = False

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self.landmarks: list[Array] = []
        self.makers = []
        self.sizes = []
        for sensor in problem.model.sensors.values():
            self.makers.append(pose_factor(sensor, Body(first=len(self.landmarks))))
            self.landmarks += seen_landmarks(sensor)
            self.sizes.append(sensor.manifold.size)
        self.delta, self.noise = composed(problem)

    def keys(self, k: int) -> list[int]:
        """The pose."""
        return [X(k)]

    def shared_keys(self) -> list[int]:
        """Every landmark."""
        return [L(i) for i in range(len(self.landmarks))]

    def insert(self, values: Any, k: int, x: Array) -> None:
        """One variable."""
        values.insert(X(k), pose3(x))

    def insert_shared(self, values: Any, x: Array) -> None:
        """Landmarks."""
        for i, place in enumerate(self.landmarks):
            values.insert(L(i), place)

    def prior_factors(self) -> list[Any]:
        """Prior of the first pose; equalities for the landmarks."""
        prior = self.problem.model.prior
        first = gtsam.PriorFactorPose3(X(0), pose3(prior.mean), noise_model(prior.cov))
        return [first, *(gtsam.NonlinearEqualityPoint3(L(i), p) for i, p in enumerate(self.landmarks))]

    def move(self, k: int, x: Array) -> tuple[list[Any], Array]:
        """The composed step, with the covariance that it has gathered."""
        delta = pose3(self.delta[k])
        factor = gtsam.BetweenFactorPose3(X(k - 1), X(k), delta, noise_model(self.noise[k]))
        return [factor], flat_pose(pose3(x).compose(delta))

    def reading_factors(self, k: int) -> list[Any]:
        """Factors of whatever `pose_factor` knows."""
        plan, made = self.problem.schedule, []
        for r in range(plan.reading_ptr[k], plan.reading_ptr[k + 1]):
            sensor, which = plan.sensor[r], int(plan.context[r, 0])
            made.append(self.makers[sensor](k, plan.z[r, : self.sizes[sensor]], which))
        return made

    def read(self, source: Any, k: int) -> Array:
        """State (7,) from `Values` or an incremental engine."""
        pose = source.atPose3 if hasattr(source, "atPose3") else source.calculateEstimatePose3
        return flat_pose(pose(X(k)))

    def covariance(self, source: Any, k: int, x: Array) -> Array:
        """Pose3's chart is ours."""
        return np.ascontiguousarray(source.marginalCovariance(X(k)))


def composed(problem: Problem) -> tuple[Array, Array]:
    """Motion (K, 7) and its covariance (K, 6, 6) between nodes: the same from any pose."""
    from sequential.kernels.walking import walk

    manifold, nodes = SE3(), len(problem.t)
    start = np.tile(manifold.identity(), (nodes, 1))
    arrived = np.empty_like(start)
    transition, noise = np.empty((nodes, 6, 6)), np.empty((nodes, 6, 6))
    walk(compiled(problem.model).tables, problem.schedule, start, arrived, transition, noise)
    certain = np.flatnonzero(np.linalg.eigvalsh(noise[1:])[:, 0] <= 0)
    if len(certain):
        raise certain_move(problem, int(certain[0]) + 1)
    return arrived, noise


@native_process.register(DrivenPose)
@native_process.register(RandomWalk)
def _(process: DrivenPose | RandomWalk, problem: Problem) -> NativeGraph | None:
    if type(process) not in {DrivenPose, RandomWalk} or not isinstance(problem.model.manifold, SE3):
        return None
    native = SpatialGraph(problem)
    return native if all(native.makers) else None
