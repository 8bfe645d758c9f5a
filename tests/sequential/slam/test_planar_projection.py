"""A camera on the floor: what it expects, and how that moves."""

import numpy as np
from planar_worlds import mounted_camera

from sequential.manifold import (
    SE2,
    SE3,
    Vector,
    quaternion_exp,
    quaternion_inverse,
    quaternion_multiply,
    rotate,
)
from sequential.slam import check_factor_model
from sequential.slam.candidates import candidates
from sequential.slam.models import PlanarProjection


def scene(rng, count=50):
    """Poses, points two metres and more ahead of them, and a camera that is tilted as well."""
    camera, mount = mounted_camera()
    tilted = quaternion_multiply(quaternion_exp(np.array([0.05, 0.2, -0.1])), mount[:4])
    model = PlanarProjection(camera, np.concatenate([tilted, mount[4:]]))
    pose = np.column_stack([rng.normal(0.0, 5.0, (count, 2)), rng.uniform(-3.0, 3.0, count)])
    body = np.column_stack([rng.uniform(2.0, 9.0, count), rng.normal(0.0, 0.7, (count, 2))])
    return model, pose, rotate(upright(pose), body) + on_floor(pose)


def upright(pose):
    """world_q_body of poses in the plane."""
    half, zero = 0.5 * pose[:, 2], np.zeros(len(pose))
    return np.column_stack([np.cos(half), zero, zero, np.sin(half)])


def on_floor(pose):
    return np.column_stack([pose[:, :2], np.zeros(len(pose))])


def test_jacobians_meet_differences(rng):
    model, pose, point = scene(rng)
    z = model.expected(pose, point) + rng.standard_normal((len(pose), 2))
    assert np.isfinite(z).all()
    check_factor_model(model, z, pose, point)


def test_it_is_a_camera_of_space_on_a_pose_of_space(rng):
    model, pose, point = scene(rng)
    mount = np.tile(model.body_T_camera, (len(pose), 1))
    body = rotate(quaternion_inverse(upright(pose)), point - on_floor(pose))
    seen = rotate(quaternion_inverse(mount[:, :4]), body - mount[:, 4:])
    np.testing.assert_allclose(model.expected(pose, point), model.camera.project(seen), atol=1e-9)


def test_candidates_lie_on_the_ray(rng):
    model, pose, point = scene(rng, 1)
    z = model.expected(pose, point)
    along = candidates(model, 1, z, pose, None)
    seen = model.expected(np.repeat(pose, len(along), axis=0), along)
    np.testing.assert_allclose(seen, np.repeat(z, len(along), axis=0), atol=1e-6)
    assert len(candidates(model, 0, z, None, point)) == 0


def test_behind_the_camera_nothing_is_seen(rng):
    model, pose, point = scene(rng, 5)
    assert np.isnan(model.expected(pose + np.array([0.0, 0.0, np.pi]), point)).all()


def test_its_variables_are_a_plane_and_a_space():
    model = PlanarProjection(*mounted_camera())
    assert model.manifolds == (SE2(), Vector(3))
    assert model.measured == Vector(2)
    SE3().check(np.array(model.body_T_camera))
