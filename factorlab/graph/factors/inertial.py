"""Strapdown inertial navigation as CombinedImuFactor, with sensors of the body, and parts beside it."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.factors.beside import known_layout, number_or_vector, one_of, others
from factorlab.graph.factors.pose_sensors import Body, pose3, pose_factor, seen_landmarks
from factorlab.graph.keys import B, L, V, X
from factorlab.graph.marginals import chain_marginals
from factorlab.graph.native import NativeGraph, joint_blocks, native_process, noise_model
from sequential.manifold import rotation_matrix
from sequential.models import Strapdown
from sequential.timeline import Problem

__all__ = ["InertialGraph", "pose3"]

Array = NDArray[np.float64]

# GTSAM inverts the covariance of a preintegration; without any integration noise a segment of one sample
# would make it singular.  This is 10 nm/√s.
LEAST_INTEGRATION = 1e-8
UNCORRELATED = 1e-9  # a correlation below this is rounding


class InertialGraph(NativeGraph):
    """Pose3 X(k), velocity V(k), bias B(k); one preintegration for each segment between nodes.

    Further parts are S(i) where they are static, else a variable of their own at each node; landmarks of
    cameras L(i), held by equality.

    A segment is preintegrated about the guess of its bias, so that the first-order bias correction of
    the factor (Forster et al. 2017, eq. 44) has little to do.
    """

    def __init__(self, problem: Problem, process: Strapdown) -> None:
        super().__init__(problem)
        plan = problem.schedule
        self.parameters = combined_parameters(process)
        self.pointer, self.dt = plan.step_ptr.tolist(), plan.step_dt.tolist()
        driven = plan.inputs[plan.step_input]
        self.accel, self.gyro = list(driven[:, :3]), list(driven[:, 3:6])
        self.others = others(problem.model, process)
        self.landmarks: list[Array] = []
        self.makers, self.sizes = [], []
        body = next(iter(problem.model.manifold.parts))  # type: ignore[attr-defined]
        keys = {o.name: o.key for o in self.others}
        for sensor in problem.model.sensors.values():
            place = Body(body, velocity=True, first=len(self.landmarks), others=keys)
            self.makers.append(pose_factor(sensor, place))
            self.landmarks += seen_landmarks(sensor)
            self.sizes.append(sensor.manifold.size)

    def keys(self, k: int) -> list[int]:
        """Pose, velocity, bias, and what walks beside them."""
        return [X(k), V(k), B(k), *(other.key(k) for other in self.others if not other.static)]

    def shared_keys(self) -> list[int]:
        """Static parts and landmarks."""
        return [o.key(0) for o in self.others if o.static] + [L(i) for i in range(len(self.landmarks))]

    def insert(self, values: Any, k: int, x: Array) -> None:
        """Three variables, and what walks beside them."""
        values.insert(X(k), pose3(x))
        values.insert(V(k), x[7:10])
        values.insert(B(k), constant_bias(x))
        for other in self.others:
            if not other.static:
                values.insert(other.key(k), number_or_vector(x[other.storage]))

    def insert_shared(self, values: Any, x: Array) -> None:
        """Static parts and landmarks."""
        for other in self.others:
            if other.static:
                values.insert(other.key(0), number_or_vector(x[other.storage]))
        for i, place in enumerate(self.landmarks):
            values.insert(L(i), place)

    def prior_factors(self) -> list[Any]:
        """One prior for each part, or one container of the whole where the parts are correlated."""
        fixed = [gtsam.NonlinearEqualityPoint3(L(i), place) for i, place in enumerate(self.landmarks)]
        prior = self.problem.model.prior
        pose, velocity, bias = X(0), V(0), B(0)
        # Position and velocity step along the body's axes here, along the world's in these factors.
        turn = to_world(prior.mean, len(prior.cov))
        turn[3:6, 3:6] = turn[6:9, 6:9]
        cov = turn @ prior.cov @ turn.T
        spans = (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 15), *(o.tangent for o in self.others))
        rest = prior.cov / np.sqrt(np.outer(np.diag(prior.cov), np.diag(prior.cov)))
        for s in spans:
            rest[s, s] = 0.0
        beside = []
        for o in self.others:
            model = noise_model(prior.cov[o.tangent, o.tangent])
            mean = number_or_vector(prior.mean[o.storage])
            beside.append(one_of("PriorFactor", o)(o.key(0), mean, model))
        if np.abs(rest).max() > UNCORRELATED:
            return [self._container(), *beside, *fixed]
        models = [noise_model(cov[s, s]) for s in spans[:4]]
        # PriorFactorPose3 measures along SE(3)'s exponential, where our position and rotation are apart.
        return [
            gtsam.PoseRotationPrior3D(pose, pose3(prior.mean).rotation(), models[0]),
            gtsam.PoseTranslationPrior3D(pose, prior.mean[4:7], models[1]),
            gtsam.PriorFactorVector(velocity, prior.mean[7:10], models[2]),
            gtsam.PriorFactorConstantBias(bias, constant_bias(prior.mean), models[3]),
            *beside,
            *fixed,
        ]

    def _container(self) -> Any:
        """The prior of 15 directions as rows about its mean, met by GTSAM's chart to first order."""
        prior, unit = self.problem.model.prior, gtsam.noiseModel.Unit.Create(15)
        values, span = gtsam.Values(), slice(0, 15)
        self.insert(values, 0, prior.mean)
        turn = to_world(prior.mean)
        root = np.linalg.inv(np.linalg.cholesky(turn @ prior.cov[span, span] @ turn.T))
        spans = (slice(0, 6), slice(6, 9), slice(9, 15))
        blocks = [part for key, s in zip(self.keys(0)[:3], spans, strict=True) for part in (key, root[:, s])]
        return gtsam.LinearContainerFactor(gtsam.JacobianFactor(*blocks, np.zeros(15), unit), values)

    def _state_keys(self, k: int) -> list[int]:
        """Variables of the whole state at a node, in the order of its tangent."""
        return [X(k), V(k), B(k), *(other.key(k) for other in self.others)]

    def move(self, k: int, x: Array) -> tuple[list[Any], Array]:
        """Preintegrate the samples that lead to node k."""
        bias = constant_bias(x)
        pim = gtsam.PreintegratedCombinedMeasurements(self.parameters, bias)
        integrate, accel, gyro, dt = pim.integrateMeasurement, self.accel, self.gyro, self.dt
        span = slice(self.pointer[k], self.pointer[k + 1])
        for force, rate, interval in zip(accel[span], gyro[span], dt[span], strict=True):
            integrate(force, rate, interval)
        factors = [gtsam.CombinedImuFactor(X(k - 1), V(k - 1), X(k), V(k), B(k - 1), B(k), pim)]
        for other in self.others:
            if not other.static:
                model, still = noise_model(np.diag(other.variance * sum(dt[span]))), 0.0 * other.variance
                between = one_of("BetweenFactor", other)
                factors.append(between(other.key(k - 1), other.key(k), number_or_vector(still), model))
        arrived = pim.predict(gtsam.NavState(pose3(x), x[7:10]), bias)
        return factors, np.concatenate([flat_pose(arrived.pose()), arrived.velocity(), x[10:]])

    def reading_factors(self, k: int) -> list[Any]:
        """Factors of whatever `pose_factor` knows."""
        plan, made = self.problem.schedule, []
        for r in range(plan.reading_ptr[k], plan.reading_ptr[k + 1]):
            sensor, which = plan.sensor[r], int(plan.context[r, 0])
            made.append(self.makers[sensor](k, plan.z[r, : self.sizes[sensor]], which))
        return made

    def read(self, source: Any, k: int) -> Array:
        """State (n,) from `Values` or an incremental engine."""
        if hasattr(source, "atPose3"):
            pose, velocity, bias = source.atPose3(X(k)), source.atVector(V(k)), source.atConstantBias(B(k))
            number, vector = source.atDouble, source.atVector
        else:
            pose, velocity = source.calculateEstimatePose3(X(k)), source.calculateEstimateVector(V(k))
            bias = source.calculateEstimateConstantBias(B(k))
            number, vector = source.calculateEstimateDouble, source.calculateEstimateVector
        x = np.empty(self.problem.model.manifold.size)
        x[:16] = np.concatenate([flat_pose(pose), velocity, bias.vector()])
        for other in self.others:
            x[other.storage] = (number if len(other.variance) == 1 else vector)(other.key(k))
        return x

    def covariance(self, source: Any, k: int, x: Array) -> Array:
        """GTSAM's velocity lives in the world frame, ours steps in the body frame."""
        turn = to_world(x, self.problem.model.manifold.dim).T
        cov = turn @ joint_blocks(source, self._state_keys(k)) @ turn.T
        return (cov + cov.T) / 2

    def covariances(self, graph: Any, values: Any, mean: Array) -> Array:
        """A part common to all nodes would cost an elimination of the whole chain a query."""
        if any(other.static for other in self.others):
            return chain_marginals(self.problem, mean)
        return super().covariances(graph, values, mean)


def combined_parameters(process: Strapdown) -> Any:
    """Continuous densities; GTSAM divides or multiplies by dt itself."""
    noise, eye = process.noise, np.eye(3)
    parameters = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)
    parameters.n_gravity = np.asarray(process.gravity, dtype=np.float64)
    parameters.setAccelerometerCovariance(eye * noise.accel_density**2)
    parameters.setGyroscopeCovariance(eye * noise.gyro_density**2)
    parameters.setBiasAccCovariance(eye * noise.accel_bias_walk**2)
    parameters.setBiasOmegaCovariance(eye * noise.gyro_bias_walk**2)
    parameters.setIntegrationCovariance(eye * max(noise.integration_density, LEAST_INTEGRATION) ** 2)
    return parameters


def to_world(x: Array, d: int = 15) -> Array:
    """(d, d) turns the velocity rows from the body to the world frame."""
    turn = np.eye(d)
    turn[6:9, 6:9] = rotation_matrix(x[:4])
    return turn


def constant_bias(x: Array) -> Any:
    """`gtsam.imuBias.ConstantBias` of a state that ends with both biases."""
    return gtsam.imuBias.ConstantBias(x[10:13], x[13:16])


def flat_pose(pose: Any) -> Array:
    """Quaternion (w, x, y, z) and position."""
    q = pose.rotation().toQuaternion()
    flat = np.array([q.w(), q.x(), q.y(), q.z(), *pose.translation()])
    if flat[0] < 0:
        flat[:4] = -flat[:4]
    return flat


@native_process.register
def _(process: Strapdown, problem: Problem) -> NativeGraph | None:
    model, noise = problem.model, process.noise
    # CombinedImuFactor has a bias at every node, and inverts its walk: none may be static or certain.
    densities = (noise.accel_density, noise.gyro_density, noise.accel_bias_walk, noise.gyro_bias_walk)
    if not (known_layout(model, process) and min(densities) > 0):
        return None
    native = InertialGraph(problem, process)
    return native if all(native.makers) else None
