"""A planar vehicle as BetweenFactorPose2, with ranges, bearings, positions and poses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.keys import L, S, X
from factorlab.graph.marginals import chain_marginals
from factorlab.graph.native import NativeGraph, joint_blocks, native_process, noise_model
from factorlab.graph.solve import certain_move
from sequential.compile import compiled
from sequential.manifold import SE2, Manifold, Product, Vector
from sequential.model import StateSpace
from sequential.models import PoseReading, Position, Range, RangeBearing, Unicycle
from sequential.timeline import Problem

__all__ = ["PlanarGraph"]

Array = NDArray[np.float64]


class PlanarGraph(NativeGraph):
    """Pose2 X(k); landmarks L(i) held by equality; a range bias as one double S(0)."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        manifold = problem.model.manifold
        self.pose, self.bias = layout(manifold)
        self.makers = [sensor_factor(s) for s in problem.model.sensors.values()]
        self.landmarks = landmarks(problem)
        self.delta, self.noise = odometry(problem)

    def keys(self, k: int) -> list[int]:
        """The pose."""
        return [X(k)]

    def shared_keys(self) -> list[int]:
        """The range bias, and every landmark."""
        bias = [] if self.bias is None else [S(0)]
        return bias + [L(i) for i in range(len(self.landmarks))]

    def insert(self, values: Any, k: int, x: Array) -> None:
        """One variable."""
        values.insert(X(k), gtsam.Pose2(*x[self.pose : self.pose + 3]))

    def insert_shared(self, values: Any, x: Array) -> None:
        """Bias and landmarks."""
        if self.bias is not None:
            values.insert(S(0), float(x[self.bias]))
        for i, place in enumerate(self.landmarks):
            values.insert(L(i), place)

    def prior_factors(self) -> list[Any]:
        """Prior of the first pose and of the bias; equalities for the landmarks."""
        prior, p = self.problem.model.prior, self.pose
        pose = gtsam.Pose2(*prior.mean[p : p + 3])
        factors = [gtsam.PriorFactorPose2(X(0), pose, noise_model(prior.cov[p : p + 3, p : p + 3]))]
        if self.bias is not None:
            variance = prior.cov[self.bias : self.bias + 1, self.bias : self.bias + 1]
            factors.append(gtsam.PriorFactorDouble(S(0), float(prior.mean[self.bias]), noise_model(variance)))
        return factors + [
            gtsam.NonlinearEqualityPoint2(L(i), place) for i, place in enumerate(self.landmarks)
        ]

    def move(self, k: int, x: Array) -> tuple[list[Any], Array]:
        """Composed odometry, with the covariance that it has gathered."""
        p = self.pose
        delta = gtsam.Pose2(*self.delta[k])
        arrived = gtsam.Pose2(*x[p : p + 3]).compose(delta)
        after = x.copy()
        after[p : p + 3] = arrived.x(), arrived.y(), arrived.theta()
        return [gtsam.BetweenFactorPose2(X(k - 1), X(k), delta, noise_model(self.noise[k]))], after

    def reading_factors(self, k: int) -> list[Any]:
        """Range, range-bearing and position factors."""
        plan = self.problem.schedule
        return [
            self.makers[plan.sensor[r]](k, plan.z[r], int(plan.context[r, 0]))
            for r in range(plan.reading_ptr[k], plan.reading_ptr[k + 1])
        ]

    def read(self, source: Any, k: int) -> Array:
        """State (n,) from `Values` or an incremental engine."""
        x = np.array(self.problem.model.prior.mean)
        values = hasattr(source, "atPose2")
        pose = source.atPose2(X(k)) if values else source.calculateEstimatePose2(X(k))
        x[self.pose : self.pose + 3] = pose.x(), pose.y(), pose.theta()
        if self.bias is not None:
            x[self.bias] = source.atDouble(S(0)) if values else source.calculateEstimateDouble(S(0))
        return x

    def covariance(self, source: Any, k: int, x: Array) -> Array:
        """Pose and bias together; Pose2's chart is ours."""
        if self.bias is None:
            return np.ascontiguousarray(source.marginalCovariance(X(k)))
        joint = joint_blocks(source, [X(k), S(0)])
        order = [*range(self.pose, self.pose + 3), self.bias]
        inverse = np.argsort(order)
        return joint[np.ix_(inverse, inverse)]

    def covariances(self, graph: Any, values: Any, mean: Array) -> Array:
        """The factors are exactly our rows, so that a bias common to all nodes need not cost a query each."""
        if self.bias is None:
            return super().covariances(graph, values, mean)
        return chain_marginals(self.problem, mean)


def layout(manifold: Manifold) -> tuple[int, int | None]:
    """Where the pose and the range bias stand in the state."""
    if isinstance(manifold, SE2):
        return 0, None
    pose = manifold.storage(next(n for n, m in manifold.parts.items() if isinstance(m, SE2))).start  # type: ignore[attr-defined]
    bias = [n for n, m in manifold.parts.items() if isinstance(m, Vector)]  # type: ignore[attr-defined]
    return pose, manifold.storage(bias[0]).start if bias else None  # type: ignore[attr-defined]


def odometry(problem: Problem) -> tuple[Array, Array]:
    """Composed motion (K, 3) and its covariance (K, 3, 3) between nodes: the same from any pose."""
    from sequential.kernels.walking import walk

    whole, manifold = compiled(problem.model), problem.model.manifold
    at, nodes, d = layout(manifold)[0], len(problem.t), manifold.dim
    start = np.tile(manifold.identity(), (nodes, 1))
    arrived = np.empty_like(start)
    transition, noise = np.empty((nodes, d, d)), np.empty((nodes, d, d))
    walk(whole.tables, problem.schedule, start, arrived, transition, noise)
    noise = noise[:, at : at + 3, at : at + 3]
    certain = np.flatnonzero(np.linalg.eigvalsh(noise[1:])[:, 0] <= 0)
    if len(certain):
        raise certain_move(problem, int(certain[0]) + 1)
    return arrived[:, at : at + 3], noise


def landmarks(problem: Problem) -> list[Array]:
    """The landmark table of the sensors; they share one."""
    for sensor in problem.model.sensors.values():
        if isinstance(sensor, Range | RangeBearing):
            return list(np.asarray(sensor.landmarks))
    return []


def sensor_factor(sensor: Any) -> Callable[[int, Array, int], Any] | None:
    """Maker of the native factor of a sensor, or None where it has none."""
    # GTSAM has no factor with a gate, for a range that is off by a scale, or for a sensor of unknown place.
    if any(getattr(sensor, name, None) is not None for name in ("gate", "scale", "mount")):
        return None
    if isinstance(sensor, Range):
        model = noise_model(sensor.noise_cov, sensor.loss)
        if sensor.bias is None:
            return lambda k, z, i: gtsam.RangeFactor2D(X(k), L(i), z[0], model)
        centre = gtsam.Pose2()
        return lambda k, z, i: gtsam.RangeFactorWithTransformBias2D(X(k), L(i), S(0), z[0], model, centre)
    if isinstance(sensor, RangeBearing):
        # GTSAM wants the bearing first.
        model = noise_model(np.asarray(sensor.noise_cov)[::-1, ::-1], sensor.loss)
        return lambda k, z, i: gtsam.BearingRangeFactor2D(X(k), L(i), gtsam.Rot2(z[1]), z[0], model)
    return absolute_factor(sensor)


def absolute_factor(sensor: Any) -> Callable[[int, Array, int], Any] | None:
    """Maker of a prior of the pose or of its place; a reading's mount is taken off, and its noise carried."""
    if isinstance(sensor, Position) and sensor.axes == 2 and not (sensor.arm or np.any(sensor.lever_arm)):
        model = noise_model(sensor.noise_cov, sensor.loss)
        return lambda k, z, i: gtsam.PoseTranslationPrior2D(X(k), gtsam.Pose2(z[0], z[1], 0.0), model)  # noqa: ARG005
    if isinstance(sensor, PoseReading) and sensor.planar:
        mount = gtsam.Pose2(*sensor.fixed_mount)  # type: ignore[attr-defined]
        adjoint, back = mount.AdjointMap(), mount.inverse()
        model = noise_model(adjoint @ np.asarray(sensor.noise_cov) @ adjoint.T, sensor.loss)
        return lambda k, z, i: gtsam.PriorFactorPose2(X(k), gtsam.Pose2(*z[:3]).compose(back), model)  # noqa: ARG005
    return None


def one_table(problem: Problem) -> bool:
    """Whether all sensors speak of the same landmarks."""
    tables = [
        np.asarray(s.landmarks) for s in problem.model.sensors.values() if isinstance(s, Range | RangeBearing)
    ]
    return all(t.shape == tables[0].shape and np.array_equal(t, tables[0]) for t in tables)


@native_process.register
def _(process: Unicycle, problem: Problem) -> NativeGraph | None:
    model = problem.model
    fits = type(process) is Unicycle and known_layout(model) and one_table(problem) and not correlated(model)
    native = fits and all(sensor_factor(s) is not None for s in model.sensors.values())
    return PlanarGraph(problem) if native else None


def known_layout(model: StateSpace) -> bool:
    """Whether the state is one pose, with one static number beside it or none."""
    if isinstance(model.manifold, SE2):
        return not model.static
    if not isinstance(model.manifold, Product):
        return False
    poses = [name for name, part in model.manifold.parts.items() if isinstance(part, SE2)]
    others = [name for name in model.manifold.parts if name not in poses]
    single = all(model.manifold.parts[name] == Vector(1) for name in others)
    return len(poses) == 1 and len(others) <= 1 and single and list(model.static) == others


def correlated(model: StateSpace) -> bool:
    """Whether the prior ties the pose to the bias, which separate native priors cannot say."""
    cov = model.prior.cov
    if len(cov) == 3:
        return False
    pose, bias = layout(model.manifold)
    return bool(np.abs(cov[pose : pose + 3, bias]).max() > 0)
