"""What a careful user would write against gtsam itself: the peers of our filter and of our graphs."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np
from gtsam.symbol_shorthand import B, L, V, X

from sequential.manifold import rotation_matrix
from sequential.timeline import Problem

Sigmas = gtsam.noiseModel.Diagonal.Sigmas
Isotropic = gtsam.noiseModel.Isotropic.Sigma


class Drive:
    """KITTI's arrays, with the noise as shipped.  Like ours, each peer starts from arrays when timed."""

    def __init__(self, problem: Problem) -> None:
        plan, model = problem.schedule, problem.model
        self.pointer, self.dt = plan.step_ptr, plan.step_dt
        self.accel = np.array(plan.inputs[plan.step_input, :3])
        self.gyro = np.array(plan.inputs[plan.step_input, 3:6])
        node = np.searchsorted(problem.t, problem.reading_t)
        self.fixes = {int(k): plan.z[r, :3] for r, k in enumerate(node)}
        self.nodes = len(problem.t)
        self.noise, self.prior = model.process.noise, model.prior  # type: ignore[attr-defined]
        self.variance = float(model.sensors["gps"].noise_cov[0, 0])
        x = self.prior.mean
        self.pose = gtsam.Pose3(gtsam.Rot3(rotation_matrix(x[:4])), x[4:7])
        self.velocity = np.array(x[7:10])

    def filter(self) -> np.ndarray:
        """gtsam.NavStateImuEKF (nine states, no biases), sample by sample: positions (K, 3)."""
        parameters = gtsam.PreintegrationParams.MakeSharedU(9.8)
        parameters.setAccelerometerCovariance(np.eye(3) * self.noise.accel_density**2)
        parameters.setGyroscopeCovariance(np.eye(3) * self.noise.gyro_density**2)
        parameters.setIntegrationCovariance(np.zeros((3, 3)))
        start = gtsam.NavState(self.pose, self.velocity)
        ekf = gtsam.NavStateImuEKF(start, np.array(self.prior.cov[:9, :9]), parameters)
        gyro, accel, dt = list(self.gyro), list(self.accel), self.dt.tolist()
        predict, pointer = ekf.predict, self.pointer.tolist()
        noise, positions = np.eye(3) * self.variance, []
        for k in range(self.nodes):
            for s in range(pointer[k], pointer[k + 1]):
                predict(gyro[s], accel[s], dt[s])
            if k in self.fixes:
                state = ekf.state()
                jacobian = np.zeros((3, 9))
                jacobian[:, 3:6] = state.attitude().matrix()
                ekf.updateWithVector(state.position(), jacobian, self.fixes[k], noise)
            positions.append(ekf.state().position())
        return np.array(positions)

    def batch(self) -> np.ndarray:
        """CombinedImuFactor between all fixes, Levenberg-Marquardt from dead reckoning: positions (K, 3)."""
        parameters = gtsam.PreintegrationCombinedParams.MakeSharedU(9.8)
        parameters.setAccelerometerCovariance(np.eye(3) * self.noise.accel_density**2)
        parameters.setGyroscopeCovariance(np.eye(3) * self.noise.gyro_density**2)
        parameters.setIntegrationCovariance(np.eye(3) * 1e-16)
        parameters.setBiasAccCovariance(np.eye(3) * self.noise.accel_bias_walk**2)
        parameters.setBiasOmegaCovariance(np.eye(3) * self.noise.gyro_bias_walk**2)
        gyro, accel, dt = list(self.gyro), list(self.accel), self.dt.tolist()
        pointer = self.pointer.tolist()
        sigmas, bias = np.sqrt(np.diag(self.prior.cov)), gtsam.imuBias.ConstantBias()
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        graph.add(gtsam.PriorFactorPose3(X(0), self.pose, Sigmas(sigmas[:6])))
        graph.add(gtsam.PriorFactorVector(V(0), self.velocity, Sigmas(sigmas[6:9])))
        graph.add(gtsam.PriorFactorConstantBias(B(0), bias, Sigmas(sigmas[9:])))
        gps, state = Isotropic(3, self.variance**0.5), gtsam.NavState(self.pose, self.velocity)
        for k in range(self.nodes):
            if k:
                pim = gtsam.PreintegratedCombinedMeasurements(parameters, bias)
                for s in range(pointer[k], pointer[k + 1]):
                    pim.integrateMeasurement(accel[s], gyro[s], dt[s])
                graph.add(gtsam.CombinedImuFactor(X(k - 1), V(k - 1), X(k), V(k), B(k - 1), B(k), pim))
                state = pim.predict(state, bias)
            if k in self.fixes:
                graph.add(gtsam.GPSFactor(X(k), self.fixes[k], gps))
                state = gtsam.NavState(gtsam.Pose3(state.attitude(), self.fixes[k]), state.velocity())
            values.insert(X(k), state.pose())
            values.insert(V(k), state.velocity())
            values.insert(B(k), bias)
        result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
        return np.array([result.atPose3(X(k)).translation() for k in range(self.nodes)])


def range_chain(
    problem: Problem, odometry: tuple[Any, Any], beacons: np.ndarray, start: np.ndarray
) -> np.ndarray:
    """RangeFactor2D to known beacons along a chain of poses: (K, 3) poses.

    Beacons are variables with tight priors, since the factor wants a variable; the start is given.
    """
    plan, prior = problem.schedule, problem.model.prior
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    gaussian = gtsam.noiseModel.Gaussian.Covariance
    graph.add(gtsam.PriorFactorPose2(X(0), gtsam.Pose2(*prior.mean), gaussian(np.array(prior.cov))))
    noise = Isotropic(1, float(next(iter(problem.model.sensors.values())).noise_cov[0, 0]) ** 0.5)
    for i, place in enumerate(beacons):
        values.insert(L(i), place)
        graph.add(gtsam.PriorFactorPoint2(L(i), place, Isotropic(2, 1e-4)))
    delta, cov = odometry
    for k in range(len(start)):
        values.insert(X(k), gtsam.Pose2(*start[k]))
        if k:
            graph.add(gtsam.BetweenFactorPose2(X(k - 1), X(k), gtsam.Pose2(*delta[k]), gaussian(cov[k])))
        for r in range(plan.reading_ptr[k], plan.reading_ptr[k + 1]):
            graph.add(gtsam.RangeFactor2D(X(k), L(int(plan.context[r, 0])), plan.z[r, 0], noise))
    result = gtsam.GaussNewtonOptimizer(graph, values).optimize()
    return np.array(gtsam.utilities.extractPose2(result))
