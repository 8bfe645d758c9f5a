"""Marker worlds recorded once, maps of them, and their truth in the gauge of a map."""

import numpy as np

from factorlab.marker_map import Inertial, map_markers
from factorlab.marker_map.world import BIAS_SIGMAS, NOISE, MarkerWorld
from sequential.manifold import SE3, quaternion_exp, rotate, rotation_matrix
from vision3d.rigid import compose, inverse

SE = SE3()


def recorded(seed, seconds=6.0, *, world=None, **settings):
    """World, what it says, and markers' true poses in the order of the sightings."""
    rng = np.random.default_rng(seed)
    made = MarkerWorld.room(rng, **(world or {}))
    told = made.record(seconds, rng, **settings)
    return made, told, np.array([made.markers[int(number)] for number in told.sightings.ids])


def mapped(world, told, *, imu=True, sightings=None):
    """The map that comes out."""
    inertial = Inertial(told.imu, world.body_T_camera, NOISE, bias_sigmas=BIAS_SIGMAS) if imu else None
    return map_markers(told.sightings if sightings is None else sightings, inertial)


def gauge(found, markers):
    """map_T_truth (7,): what brings the truth to where the map's reference marker is held."""
    row = found.reference
    if found.inertial is None:
        return inverse(markers[row])
    turn = rotation_matrix(found.poses[row, :4]) @ rotation_matrix(markers[row, :4]).T
    yaw = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
    pose = np.concatenate([quaternion_exp(np.array([0.0, 0.0, yaw])), np.zeros(3)])
    pose[4:] = found.poses[row, 4:] - compose(pose, markers[row])[4:]
    return pose


def map_error(found, markers):
    """(M, 6) of the placed markers, in the tangent at the estimate."""
    placed = found.placed
    return SE.local(found.poses[placed], compose(gauge(found, markers), markers)[placed])


def map_nees(found, markers):
    """Squared error of the whole map, and its degrees of freedom: the gauge has none."""
    error = map_error(found, markers).ravel()
    free = len(error) - (6 if found.inertial is None else 4)
    values, vectors = np.linalg.eigh(found.joint)
    kept = slice(len(values) - free, None)
    return float(np.sum((vectors[:, kept].T @ error) ** 2 / values[kept])), free


def frame_errors(found, truth, markers, world):
    """(F, 6), or (F, 15) with velocity and biases, in the tangents of `MarkerMap.frame_covs`."""
    pose = gauge(found, markers)
    bodies = truth.poses[found.frames]
    if found.inertial is None:
        return SE.local(found.trajectory, compose(pose, compose(bodies, world.body_T_camera)))
    turned = rotate(pose[:4], truth.velocities[found.frames])
    return np.hstack(
        [
            SE.local(found.trajectory, compose(pose, bodies)),
            turned - found.velocities,
            truth.biases[found.frames] - found.biases,
        ]
    )


def nees(error, cov):
    """(F,) squared errors by covariances."""
    return np.einsum("fi,fij,fj->f", error, np.linalg.inv(cov), error)
