"""Where a variable may be by one measurement that does not determine it: along a ray, around a circle."""

from __future__ import annotations

from functools import singledispatch

import numpy as np

from sequential.manifold import SE2, Array, Manifold, rotate
from sequential.slam.factor_model import FactorModel
from sequential.slam.models import LandmarkBearing, LandmarkRange, Projection
from sequential.slam.models.displacement import into_world
from sequential.slam.models.planar_projection import PlanarProjection

__all__ = ["candidates"]

NEAREST_M, FARTHEST_M, DEPTHS = 0.1, 100.0, 12  # along a ray
AROUND = 16  # directions about a beacon's listener


@singledispatch
def candidates(model: FactorModel, missing: int, z: Array, *values: Array | None) -> Array:
    """Places (C, size) of variable number `missing` that one measurement z (1, size) allows.

    Those are starts for `determined`; none by default.  A model of your own registers itself.
    """
    return np.zeros((0, model.manifolds[missing].size))


@candidates.register
def _(model: Projection, missing: int, z: Array, *values: Array | None) -> Array:
    pose = values[0]
    if missing != 1 or pose is None:
        return np.zeros((0, model.manifolds[missing].size))
    body = _along_ray(model, z)
    return into_world(model.manifolds[0], np.repeat(pose, len(body), axis=0), body)


@candidates.register
def _(model: PlanarProjection, missing: int, z: Array, *values: Array | None) -> Array:
    pose = values[0]
    if missing != 1 or pose is None:
        return np.zeros((0, model.manifolds[missing].size))
    body = _along_ray(model, z)
    level = into_world(SE2(), np.repeat(pose, len(body), axis=0), body[:, :2])
    return np.concatenate([level, body[:, 2:]], axis=1)


def _along_ray(model: Projection | PlanarProjection, z: Array) -> Array:
    """Points (C, 3) in the frame of the body that a pixel (1, 2) may be of."""
    unproject = getattr(model.camera, "unproject", None)
    if unproject is None:
        return np.zeros((0, 3))
    points: Array = np.geomspace(NEAREST_M, FARTHEST_M, DEPTHS)[:, None] * unproject(z)
    if model.body_T_camera is not None:
        mount = np.asarray(model.body_T_camera)
        points = mount[4:] + rotate(mount[:4], points)
    return points


@candidates.register
def _(model: LandmarkBearing, missing: int, z: Array, *values: Array | None) -> Array:
    pose = values[0]
    if missing != 1 or pose is None:
        return np.zeros((0, model.manifolds[missing].size))
    far = np.geomspace(NEAREST_M, FARTHEST_M, DEPTHS)[:, None]
    ray = np.concatenate([np.cos(z), np.sin(z)], axis=1)
    return into_world(SE2(), np.repeat(pose, len(far), axis=0), far * ray)


@candidates.register
def _(model: LandmarkRange, missing: int, z: Array, *values: Array | None) -> Array:
    pose = values[0]
    if missing != 1 or pose is None:
        return np.zeros((0, model.manifolds[missing].size))
    around = _directions(model.manifolds[1])
    return into_world(model.manifolds[0], np.repeat(pose, len(around), axis=0), z * around)


def _directions(point: Manifold) -> Array:
    """(C, axes) unit vectors about evenly over the circle or the sphere (a Fibonacci lattice)."""
    turn = np.arange(AROUND)
    if point.dim == 2:
        angle = 2.0 * np.pi * turn / AROUND
        return np.column_stack([np.cos(angle), np.sin(angle)])
    up = 1.0 - 2.0 * (np.arange(2 * AROUND) + 0.5) / (2 * AROUND)
    angle = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(2 * AROUND)
    level = np.sqrt(1.0 - up**2)
    return np.column_stack([level * np.cos(angle), level * np.sin(angle), up])
