"""Marker corners as native factors beside one 8-d Python factor a sighting in GTSAM's own optimiser.

The native graph holds the inverse pose of each marker (`factorlab.graph.slam.marker_graph`); the Python
factor is written with GTSAM's operations, as its users write it.  Both begin and end in one place.
"""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np
from gtsam.symbol_shorthand import M, X
from marker_graph_worlds import CAMERA, SIDE_M, SIGMA_PX, wall
from numpy.typing import NDArray

from factorlab.graph.slam import BatchSlam
from measure.figures import Figure, interleaved, say
from sequential.manifold import SE3
from sequential.slam import SlamProblem
from sequential.slam.models.marker import square_corners

Array = NDArray[np.float64]
SHAPE = "8 markers, 60 views, 4 corners"


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    problem = wall(np.random.default_rng(0))[0]
    native = BatchSlam(route="native", initial="given", covariance=False)
    batched = BatchSlam(route="batched", initial="given", covariance=False)
    ours, theirs = native.solve(problem), python_factors(problem)
    apart = SE3().local(ours.values.rows["m"], theirs)
    times = interleaved(
        {
            "native": lambda: native.solve(problem),
            "batched": lambda: batched.solve(problem),
            "python": lambda: python_factors(problem),
        },
        2 if quick else 7,
    )
    for name, seconds in times.items():
        say(f"marker corners, {name}: {1e3 * seconds:.0f} ms")
    return {
        "marker_corners_native_speedup": Figure(
            times["python"] / times["native"], "x", f"8-d CustomFactor, {SHAPE}", must=3.0, better="higher"
        ),
        "marker_corners_batched_speedup": Figure(
            times["python"] / times["batched"], "x", "our rows and SciPy", better="higher"
        ),
        "marker_corners_native_ms": Figure(1e3 * times["native"], "ms", "build, solve, read and check"),
        "marker_corners_apart": Figure(
            float(np.abs(apart).max()), "rad, m", "marker poses, native and Python factors", must=1e-6
        ),
    }


def pose_of(row: Array) -> gtsam.Pose3:
    """GTSAM's pose."""
    return gtsam.Pose3(gtsam.Rot3.Quaternion(*row[:4]), row[4:])


def python_factors(problem: SlamProblem) -> Array:
    """Levenberg-Marquardt over 8-d `CustomFactor`s: marker poses (n, 7)."""
    prior, corners = problem.factors
    fx, fy, cx, cy = CAMERA.intrinsics
    lens = gtsam.Cal3DS2(fx, fy, 0.0, cx, cy, *CAMERA.distortion)
    noise = gtsam.noiseModel.Isotropic.Sigma(8, SIGMA_PX)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    held = gtsam.noiseModel.Gaussian.Covariance(prior.covs()[0])
    graph.add(gtsam.PriorFactorPose3(M(0), pose_of(prior.z[0]), held))
    for (i, j), z in zip(corners.index.tolist(), corners.z, strict=True):
        graph.add(gtsam.CustomFactor(noise, [X(i), M(j)], corner_error(lens, z.reshape(4, 2))))
    assert problem.start is not None
    for key, kind in ((X, "x"), (M, "m")):
        for i, row in zip(problem.start.index[kind].tolist(), problem.start.rows[kind], strict=True):
            values.insert(key(i), pose_of(row))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(30)
    parameters.setRelativeErrorTol(1e-10)
    found = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters).optimize()
    rows = []
    for j in problem.indices("m").tolist():
        pose = found.atPose3(M(j))
        q = pose.rotation().toQuaternion()
        rows.append([q.w(), q.x(), q.y(), q.z(), *pose.translation()])
    return SE3().normalize(np.array(rows))


def corner_error(lens: gtsam.Cal3DS2, z: Array) -> Any:
    """The error of one sighting, with Jacobians by GTSAM's own."""
    points = square_corners(SIDE_M)

    def error(factor: gtsam.CustomFactor, values: gtsam.Values, slopes: list[Array] | None) -> Array:
        keys = factor.keys()
        camera = gtsam.PinholeCameraCal3DS2(values.atPose3(keys[0]), lens)
        marker, found = values.atPose3(keys[1]), np.zeros(8)
        by_camera, by_marker = np.zeros((8, 6)), np.zeros((8, 6))
        for k, point in enumerate(points):
            rows = slice(2 * k, 2 * k + 2)
            if slopes is None:
                found[rows] = camera.project(marker.transformFrom(point)) - z[k]
                continue
            turn, move = np.zeros((3, 6), order="F"), np.zeros((3, 3), order="F")
            world = marker.transformFrom(point, turn, move)
            pose, place = np.zeros((2, 6), order="F"), np.zeros((2, 3), order="F")
            found[rows] = camera.project(world, pose, place, np.zeros((2, 9), order="F")) - z[k]
            by_camera[rows], by_marker[rows] = pose, place @ turn
        if slopes is not None:
            slopes[0], slopes[1] = by_camera, by_marker
        return found

    return error
