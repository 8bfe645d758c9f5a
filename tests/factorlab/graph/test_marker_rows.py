"""Rows of corners: Jacobians meet differences for every lens, and GTSAM's own factor agrees."""

import gtsam
import gtsam_unstable
import numpy as np
import pytest
from gtsam.symbol_shorthand import M, P, X
from marker_map_worlds import recorded

from factorlab.graph.factors.inertial import pose3
from factorlab.graph.marker_rows import LOST, CornerRows
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.markers import MarkerSightings
from vision3d.rigid import compose, inverse

SE = SE3()
STEP = 1e-6
LENSES = [
    Camera("pinhole", (520, 521, 321, 238), (), (640, 480)),
    Camera("brown4", (520, 521, 321, 238), (-0.12, 0.05, 4e-4, -3e-4), (640, 480)),
    Camera("rational8", (520, 521, 321, 238), (0.1, 0.02, 4e-4, -3e-4, 0.01, 0.2, 0.01, 0.02), (640, 480)),
    Camera("fisheye4", (330, 331, 321, 238), (0.02, -0.01, 0.003, -1e-3), (640, 480)),
]


def case(camera, rng, count=6):
    """Sightings at random poses in front of a camera, a mount, and values near the truth."""
    mount = SE.random(rng)
    frames = SE.random(rng, shape=(count,))
    seen = np.concatenate(
        [SE.random(rng, scale=0.4, shape=(count,))[:, :4], rng.uniform(-0.3, 0.3, (count, 3))], axis=1
    )
    seen[:, 6] = rng.uniform(0.9, 1.4, count)
    markers = compose(compose(frames, mount), seen)
    root = rng.standard_normal((count, 8, 8))
    cov = 0.02 * (root @ root.transpose(0, 2, 1) + 4 * np.eye(8))
    nothing = np.zeros(count, dtype=np.int64)
    exact = MarkerSightings(
        camera, np.arange(count), np.arange(count), np.full(count, 0.12), np.arange(count), np.arange(count),
        np.zeros((count, 4, 2)), cov, nothing,
    )  # fmt: skip
    rows = CornerRows.of(exact, mount)
    corners = camera.project(rows.in_camera(frames, markers)) + rng.standard_normal((count, 4, 2))
    given = (camera, exact.t, exact.ids, exact.size_m, exact.frame, exact.marker, corners, cov, nothing)
    return CornerRows.of(MarkerSightings(*given), mount), frames, markers


@pytest.mark.parametrize("camera", LENSES, ids=lambda one: one.lens)
def test_jacobians_meet_differences(camera, rng):
    rows, frames, markers = case(camera, rng)
    error, by_frame, by_marker = rows.linearised(frames, markers)
    np.testing.assert_allclose(error, rows.errors(frames, markers), rtol=1e-12)
    for j in range(6):
        step = np.zeros(6)
        step[j] = STEP
        ahead, behind = SE.retract(frames, step), SE.retract(frames, -step)
        slope = (rows.errors(ahead, markers) - rows.errors(behind, markers)) / (2 * STEP)
        np.testing.assert_allclose(by_frame[:, :, j], slope, rtol=1e-5, atol=1e-4)
        ahead, behind = SE.retract(markers, step), SE.retract(markers, -step)
        slope = (rows.errors(frames, ahead) - rows.errors(frames, behind)) / (2 * STEP)
        np.testing.assert_allclose(by_marker[:, :, j], slope, rtol=1e-5, atol=1e-4)


def test_gtsams_own_factor_gives_the_same_error_and_linearisation(rng):
    """ProjectionFactorPPP with the inverse pose of the marker; the mount is the identity, noise isotropic."""
    world, told, truth = recorded(3, 1.0)
    sightings, camera = told.sightings, world.camera
    rows = CornerRows.of(sightings, SE.identity())
    frames = compose(told.truth.poses, world.body_T_camera)[sightings.frame]
    markers = SE.retract(truth[sightings.marker], 0.01 * rng.standard_normal((len(sightings), 6)))
    error, by_frame, by_marker = rows.linearised(frames, markers)
    unwhite = np.linalg.cholesky(sightings.cov)
    fx, fy, cx, cy = camera.intrinsics
    lens = gtsam.Cal3DS2(np.array([fx, fy, 0.0, cx, cy, *camera.distortion]))
    noise = gtsam.noiseModel.Isotropic.Sigma(2, 1.0)
    for s in range(0, len(sightings), 7):
        values = gtsam.Values()
        values.insert(M(0), pose3(inverse(markers[s])))
        values.insert(X(0), pose3(frames[s]))
        for k in range(4):
            values.insert(P(k), sightings.points[s, k])
            factor = gtsam_unstable.ProjectionFactorPPPCal3DS2(
                sightings.corners[s, k], noise, M(0), X(0), P(k), lens
            )
            graph = gtsam.NonlinearFactorGraph()
            graph.add(factor)
            native = graph.linearize(values).at(0).augmentedJacobian()
            at = slice(2 * k, 2 * k + 2)
            np.testing.assert_allclose(-native[:, -1], (unwhite[s] @ error[s])[at], atol=1e-9)
            np.testing.assert_allclose(native[:, 6:12], (unwhite[s] @ by_frame[s])[at], atol=1e-7)
            # a step of the inverse pose is one of the pose, carried by its adjoint and turned round
            carry = -SE.transport(SE.identity(), inverse(markers[s]))[0]
            np.testing.assert_allclose(native[:, :6] @ carry, (unwhite[s] @ by_marker[s])[at], atol=1e-7)


def test_behind_the_camera_nothing_pulls(rng):
    rows, frames, markers = case(LENSES[0], rng)
    behind = markers.copy()
    behind[0] = compose(compose(frames[0], rows.body_T_camera), np.array([1.0, 0, 0, 0, 0, 0, -1.0]))
    error, by_frame, by_marker = rows.linearised(frames, behind)
    assert (error[0] == LOST).all()
    assert not by_frame[0].any()
    assert not by_marker[0].any()
    assert np.isfinite(error).all()
