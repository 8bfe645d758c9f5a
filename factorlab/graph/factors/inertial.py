"""Strapdown inertial navigation as CombinedImuFactor, with GPS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.keys import B, V, X
from factorlab.graph.native import NativeGraph, joint_blocks, native_process, noise_model
from sequential.manifold import rotation_matrix
from sequential.models import Position, Strapdown
from sequential.timeline import Problem

__all__ = ["InertialGraph"]

Array = NDArray[np.float64]

# GTSAM inverts the covariance of a preintegration; without any integration noise a segment of one sample
# would make it singular.  This is 10 nm/√s.
LEAST_INTEGRATION = 1e-8
UNCORRELATED = 1e-9  # a correlation below this is rounding


class InertialGraph(NativeGraph):
    """Pose3 X(k), velocity V(k), bias B(k); one preintegration for each segment between nodes.

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
        body = next(iter(problem.model.manifold.parts))  # type: ignore[attr-defined]
        self.makers = [position_factor(s, body) for s in problem.model.sensors.values()]

    def keys(self, k: int) -> list[int]:
        """Pose, velocity, bias."""
        return [X(k), V(k), B(k)]

    def shared_keys(self) -> list[int]:
        """None."""
        return []

    def insert(self, values: Any, k: int, x: Array) -> None:
        """Three variables."""
        values.insert(X(k), pose3(x))
        values.insert(V(k), x[7:10])
        values.insert(B(k), constant_bias(x))

    def insert_shared(self, values: Any, x: Array) -> None:
        """Nothing to insert."""

    def prior_factors(self) -> list[Any]:
        """One prior for each part, or one container of the whole where the parts are correlated."""
        prior = self.problem.model.prior
        pose, velocity, bias = self.keys(0)
        # Position and velocity step along the body's axes here, along the world's in these factors.
        turn = to_world(prior.mean)
        turn[3:6, 3:6] = turn[6:9, 6:9]
        cov = turn @ prior.cov @ turn.T
        spans = (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 15))
        rest = prior.cov / np.sqrt(np.outer(np.diag(prior.cov), np.diag(prior.cov)))
        for s in spans:
            rest[s, s] = 0.0
        if np.abs(rest).max() > UNCORRELATED:
            return [self._container()]
        models = [noise_model(cov[s, s]) for s in spans]
        # PriorFactorPose3 measures along SE(3)'s exponential, where our position and rotation are apart.
        return [
            gtsam.PoseRotationPrior3D(pose, pose3(prior.mean).rotation(), models[0]),
            gtsam.PoseTranslationPrior3D(pose, prior.mean[4:7], models[1]),
            gtsam.PriorFactorVector(velocity, prior.mean[7:10], models[2]),
            gtsam.PriorFactorConstantBias(bias, constant_bias(prior.mean), models[3]),
        ]

    def _container(self) -> Any:
        """The whole prior as rows about its mean, which GTSAM's chart meets to first order."""
        prior, unit = self.problem.model.prior, gtsam.noiseModel.Unit.Create(15)
        values = gtsam.Values()
        self.insert(values, 0, prior.mean)
        turn = to_world(prior.mean)
        root = np.linalg.inv(np.linalg.cholesky(turn @ prior.cov @ turn.T))
        spans = (slice(0, 6), slice(6, 9), slice(9, 15))
        blocks = [part for key, s in zip(self.keys(0), spans, strict=True) for part in (key, root[:, s])]
        return gtsam.LinearContainerFactor(gtsam.JacobianFactor(*blocks, np.zeros(15), unit), values)

    def move(self, k: int, x: Array) -> tuple[list[Any], Array]:
        """Preintegrate the samples that lead to node k."""
        bias = constant_bias(x)
        pim = gtsam.PreintegratedCombinedMeasurements(self.parameters, bias)
        integrate, accel, gyro, dt = pim.integrateMeasurement, self.accel, self.gyro, self.dt
        span = slice(self.pointer[k], self.pointer[k + 1])
        for force, rate, interval in zip(accel[span], gyro[span], dt[span], strict=True):
            integrate(force, rate, interval)
        factor = gtsam.CombinedImuFactor(X(k - 1), V(k - 1), X(k), V(k), B(k - 1), B(k), pim)
        arrived = pim.predict(gtsam.NavState(pose3(x), x[7:10]), bias)
        return [factor], np.concatenate([flat_pose(arrived.pose()), arrived.velocity(), x[10:]])

    def reading_factors(self, k: int) -> list[Any]:
        """GPS factors."""
        plan = self.problem.schedule
        return [
            self.makers[plan.sensor[r]](X(k), plan.z[r, :3])
            for r in range(plan.reading_ptr[k], plan.reading_ptr[k + 1])
        ]

    def read(self, source: Any, k: int) -> Array:
        """State (16,) from `Values` or an incremental engine."""
        if hasattr(source, "atPose3"):
            pose, velocity, bias = source.atPose3(X(k)), source.atVector(V(k)), source.atConstantBias(B(k))
        else:
            pose, velocity = source.calculateEstimatePose3(X(k)), source.calculateEstimateVector(V(k))
            bias = source.calculateEstimateConstantBias(B(k))
        return np.concatenate([flat_pose(pose), velocity, bias.vector()])

    def covariance(self, source: Any, k: int, x: Array) -> Array:
        """GTSAM's velocity lives in the world frame, ours steps in the body frame."""
        turn = to_world(x).T
        cov = turn @ joint_blocks(source, self.keys(k)) @ turn.T
        return (cov + cov.T) / 2


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


def to_world(x: Array) -> Array:
    """(15, 15) turns the velocity rows from the body to the world frame."""
    turn = np.eye(15)
    turn[6:9, 6:9] = rotation_matrix(x[:4])
    return turn


def pose3(x: Array) -> Any:
    """`gtsam.Pose3` of a state that begins with quaternion and position."""
    return gtsam.Pose3(gtsam.Rot3.Quaternion(x[0], x[1], x[2], x[3]), x[4:7])


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


def position_factor(sensor: Any, body: str) -> Callable[[int, Array], Any] | None:
    """Maker of the native factor of a sensor on the part `body`, or None where it has none."""
    if not isinstance(sensor, Position) or sensor.axes != 3:
        return None
    if sensor.gate is not None or sensor.part not in {None, body}:
        return None
    model = noise_model(sensor.noise_cov, sensor.loss)
    arm = np.zeros(3)
    arm[: len(sensor.lever_arm)] = sensor.lever_arm
    if arm.any():
        return lambda key, z: gtsam.GPSFactorArm(key, z, arm, model)
    return lambda key, z: gtsam.GPSFactor(key, z, model)


@native_process.register
def _(process: Strapdown, problem: Problem) -> NativeGraph | None:
    model, noise = problem.model, process.noise
    # CombinedImuFactor has a bias at every node, and inverts its walk: nothing may be static or certain.
    densities = (noise.accel_density, noise.gyro_density, noise.accel_bias_walk, noise.gyro_bias_walk)
    if model.manifold.dim != 15 or model.static or not min(densities) > 0:
        return None
    native = InertialGraph(problem, process)
    return native if all(native.makers) else None
