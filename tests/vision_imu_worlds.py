"""A gyro and a marker on one body before a camera: readings with noise, and the truth beside them."""

import numpy as np

import sequential as sq
from factorlab.markers.attitudes import attitude_readings
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply, rotate
from sequential.sensors import ImuErrors, simulate_imu, tumble
from vision3d.camera import Camera
from vision3d.markers import Marker, detect_markers, marker_corners, marker_poses
from vision3d.render import Plane, marker_texture, render_planes

CAMERA = Camera("brown5", (530, 531, 322, 240), (-0.28, 0.08, 1e-3, -2e-4, 0.02), (640, 480))
SIZE_M, FPS, RATE_HZ = 0.05, 15.0, 100.0
NOISE = sq.ImuNoise(gyro_density=1e-3, accel_density=1e-2, gyro_bias_walk=3e-4, accel_bias_walk=1e-4)
BIAS_SIGMA = 0.03  # rad/s, of the bias at the start
ROTATIONS = sq.SO3()


def turning(rng, seconds=20.0, angle=0.14):
    """A motion, and the gyro's stream."""
    motion = tumble(seconds, rng, angle=angle, sway=0.0, period=(1.5, 6.0))
    errors = ImuErrors(noise=NOISE, gyro_bias=rng.normal(0.0, BIAS_SIGMA, 3))
    recording, truth = simulate_imu(motion, rng, rate=RATE_HZ, errors=errors, field=None)
    return motion, sq.Stream(recording.t, recording.gyro), truth


def frames(motion):
    """Times of the pictures, s, and the marker's attitude in them."""
    t = np.arange(0.0, motion.duration, 1.0 / FPS)
    return t, ROTATIONS.normalize(motion.attitude(t)[0])


def noisy_readings(motion, rng, sigma=0.03, flipped=0.1):
    """Attitudes with Gaussian noise beside their mirror images; the wrong one comes first now and then."""
    t, q = frames(motion)
    right = ROTATIONS.retract(q, sigma * rng.standard_normal((len(q), 3)))
    mirrored = mirror(right, rng)
    swap = rng.random(len(q)) < flipped
    first, second = np.where(swap[:, None], mirrored, right), np.where(swap[:, None], right, mirrored)
    cov = np.tile(sigma**2 * np.eye(3), (len(q), 1, 1))
    return sq.two_mode_readings(t, first, second, (1.0 - flipped) / flipped, cov, cov)


def mirror(q, rng):
    """The same attitudes, tilted the other way about an axis across the line of sight."""
    axis = rng.uniform(0.0, 2.0 * np.pi, len(q))
    turn = rng.uniform(0.35, 0.9, len(q))[:, None] * np.column_stack([np.cos(axis), np.sin(axis), 0 * axis])
    return ROTATIONS.normalize(quaternion_multiply(q, quaternion_exp(turn)))


def corner_readings(motion, rng, distance=0.9, sigma_px=0.25):
    """Poses of four corners with Gaussian noise: the modes, odds and covariances of `marker_poses`."""
    t, q = frames(motion)
    place, corners = np.array([0.12, -0.06, distance]), marker_corners(SIZE_M)
    markers = [
        Marker(7, CAMERA.project(rotate(one, corners) + place) + rng.normal(0, sigma_px, (4, 2)), sigma_px)
        for one in q
    ]
    return attitude_readings(t, marker_poses(CAMERA, markers, SIZE_M))


def rendered_readings(motion, rng, distance=1.1):
    """Pictures, rendered and read."""
    t, q = frames(motion)
    texture, poses = marker_texture("4x4_50", 7, SIZE_M), []
    for one in q:
        plane = Plane(np.append(one, [0.12, -0.06, distance]), texture)
        image = render_planes(CAMERA, [plane], rng=rng, noise=6.0, blur_px=0.8)
        found = detect_markers(image, "4x4_50", camera=CAMERA)
        poses.append(marker_poses(CAMERA, found, SIZE_M)[0] if found else None)
    return attitude_readings(t, poses)


def gyro_only(gyro, marker):
    """The gyro integrated from the first sighting: times (ns) and attitudes."""
    rows = np.flatnonzero(gyro.t >= marker.t[0])
    q = [marker.values[0]]
    for k, dt in zip(rows, np.diff(gyro.t[rows]) * 1e-9, strict=False):
        q.append(quaternion_multiply(q[-1], quaternion_exp(gyro.values[k] * dt)))
    return gyro.t[rows], ROTATIONS.normalize(np.array(q))


def off(motion, t, q):
    """Rotation vectors (N, 3) from estimates to the truth, rad."""
    return ROTATIONS.local(ROTATIONS.normalize(q), ROTATIONS.normalize(motion.attitude(t * 1e-9)[0]))


def rms_deg(errors):
    """Root mean square angle, degrees."""
    return float(np.degrees(np.sqrt(np.mean(np.sum(errors**2, axis=-1)))))


def squared(run, errors):
    """(N,) NEES of the attitude."""
    return np.einsum("ni,nij,nj->n", errors, np.linalg.inv(run.cov[:, :3, :3]), errors)
