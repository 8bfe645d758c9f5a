"""Where the adjustment begins: a focal length and the poses, from nothing but the corners.

A ladder of focal lengths is tried under two laws of projection, perspective and equidistant, with the
principal point in the middle of the image.  Under each the pose of every view is a linear problem (the rays
through the corners must meet the board), and the rung whose poses explain the corners best wins.  Unlike the
closed form of Zhang 2000 ("A flexible new technique for camera calibration"), this holds for strong
distortion, for fields of view of 180° and for views that are nearly parallel to the image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import quaternion_from_matrix
from vision3d.calibrate.problem import Problem

__all__ = ["Start", "begin", "linear_pose"]

Array = NDArray[np.float64]

FOCALS = np.geomspace(0.18, 6.0, 15)
"""Rungs of the ladder, in units of the image's longer side."""
ENOUGH = 8
"""Views that choose the rung, where there are more."""
FLAT = 1e-3
"""A board whose third principal axis is shorter than this share of its first is flat."""


@dataclass(frozen=True, eq=False)
class Start:
    """Focal length, px; law of projection; poses (V, 7); what they leave of corners, (M, 2), and its RMS."""

    focal: float
    equidistant: bool
    poses: Array
    residuals: Array
    rms_px: float


def begin(problem: Problem, *, equidistant: bool | None = None) -> Start:
    """Find the rung of the ladder that explains the corners best.

    Parameters
    ----------
    problem : Problem
        Corners of the views.
    equidistant : bool, optional
        Try this law of projection alone; both by default.

    Returns
    -------
    Start
        Focal length and poses to begin from.
    """
    laws = (False, True) if equidistant is None else (equidistant,)
    few = problem
    if problem.count > ENOUGH:
        few = problem.only(np.linspace(0, problem.count - 1, ENOUGH).astype(np.int64))
    tried = [_rung(few, f * max(problem.size), equidistant=law) for law in laws for f in FOCALS]
    best = min(tried, key=lambda one: one.rms_px)
    finer = [_rung(few, best.focal * f, equidistant=best.equidistant) for f in np.geomspace(0.83, 1.2, 6)]
    best = min([best, *finer], key=lambda one: one.rms_px)
    return _rung(problem, best.focal, equidistant=best.equidistant)


def _rung(problem: Problem, focal: float, *, equidistant: bool) -> Start:
    """Poses of every view under one focal length and law."""
    middle = 0.5 * (np.array(problem.size) - 1.0)
    rays = _rays((problem.pixels - middle) / focal, equidistant=equidistant)
    poses, residuals = [], []
    for v in range(problem.count):
        rows = slice(problem.starts[v], problem.starts[v + 1])
        R, t = linear_pose(problem.points[rows], rays[rows])
        poses.append(np.concatenate([quaternion_from_matrix(R), t]))
        at = _image(problem.points[rows] @ R.T + t, equidistant=equidistant) * focal + middle
        residuals.append(problem.pixels[rows] - at)
    # the median over views: a view with wrong corners must not choose the focal length
    rms = float(np.sqrt(np.median([np.mean(np.sum(one**2, axis=1)) for one in residuals])))
    return Start(focal, equidistant, np.array(poses), np.concatenate(residuals), rms)


def linear_pose(points: Array, rays: Array) -> tuple[Array, Array]:
    """Pose of points seen along rays, linear in its unknowns: ``ray × (R X + t) = 0``.

    Parameters
    ----------
    points : Array
        (N, 3), at least 4 of a plane or 6 of space, m.
    rays : Array
        (N, 3), unit rays in the camera frame.

    Returns
    -------
    R, t : Array
        Rotation (3, 3) and translation (3,) of the board in the camera frame: to begin from, not the best.
    """
    middle = points.mean(axis=0)
    _, lengths, axes = np.linalg.svd(points - middle, full_matrices=False)
    axes = axes * np.sign(np.linalg.det(axes))
    size = lengths[0] / np.sqrt(len(points))
    at = (points - middle) @ axes.T / size
    flat = lengths[2] < FLAT * lengths[0]
    known = np.column_stack([at[:, :2] if flat else at, np.ones(len(at))])
    columns = _null(known, rays)
    if np.sum(rays * (known @ columns.T)) < 0.0:
        columns = -columns
    if flat:
        columns = np.column_stack([columns[:, :2], np.cross(columns[:, 0], columns[:, 1]), columns[:, 2]])
        columns[:, 2] /= max(float(np.sqrt(np.linalg.norm(columns[:, 2]))), 1e-12)
    u, s, vt = np.linalg.svd(columns[:, :3])
    u[:, 2] *= np.linalg.det(u @ vt)
    scale = float(np.mean(s[:2] if flat else s))
    R = u @ vt @ axes
    return R, columns[:, 3] / scale * size - R @ middle


def _null(known: Array, rays: Array) -> Array:
    """The matrix (3, k) that carries `known` (N, k) best onto the rays, of unit norm, sign open."""
    k = known.shape[1]
    skew = np.zeros((len(rays), 3, 3))
    x, y, z = rays.T
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -z, y, -x
    skew[:, 1, 0], skew[:, 2, 0], skew[:, 2, 1] = z, -y, x
    # Σ (ray × M X)² = vec(M)' [Σ P ⊗ X X'] vec(M) with P = I - ray ray'
    P = np.einsum("nij,nik->njk", skew, skew)
    A = np.einsum("nij,na,nb->iajb", P, known, known).reshape(3 * k, 3 * k)
    smallest: Array = np.linalg.eigh(A)[1][:, 0].reshape(3, k)
    return smallest


def _rays(at: Array, *, equidistant: bool) -> Array:
    """Unit rays of image points in focal lengths, (N, 2)."""
    if not equidistant:
        rays = np.column_stack([at, np.ones(len(at))])
        unit: Array = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        return unit
    angle = np.linalg.norm(at, axis=1)
    ratio = np.sinc(angle / np.pi)
    return np.column_stack([at * ratio[:, None], np.cos(angle)])


def _image(points: Array, *, equidistant: bool) -> Array:
    """Image points in focal lengths of points in the camera frame; far away where there is none."""
    if not equidistant:
        ahead = points[:, 2] > 1e-9
        z = np.where(ahead, points[:, 2], 1.0)
        return np.where(ahead[:, None], points[:, :2] / z[:, None], 1e3)
    radius = np.linalg.norm(points[:, :2], axis=1)
    ratio = np.arctan2(radius, points[:, 2]) / np.maximum(radius, 1e-12)
    at: Array = points[:, :2] * ratio[:, None]
    return at
