"""Residuals and Jacobians of a bundle adjustment: many cameras, many poses, many points, in one pass.

A pose moves by η = (rotation, translation) in its camera's own axes, `world_T_camera * Exp(η)`, so a point p
in the camera frame moves by p × ω − v: well scaled wherever the origin of the world is.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import kernel
from vision3d.kernels.arrays import f2, f3, i0, i1, w2, w3
from vision3d.kernels.lenses import project_full_one, project_one

__all__ = ["linearize", "reproject"]


@kernel(i0(i1, f2, i1, f3, f2, f2, i1, i1, f2, f3, w2, w3, w3))
def linearize(
    codes,
    parameters,
    camera_of,
    rotations,
    places,
    points,
    images,
    tracks,
    pixels,
    basis,
    residuals,
    by_view,
    by_point,
):
    """Fill what every observation says; returns how many have no projection.

    Parameters
    ----------
    codes : (C,) lens codes
    parameters : (C, P) of the cameras, padded with zeros
    camera_of : (V,) camera of every image
    rotations, places : (V, 3, 3) camera_R_world, (V, 3) of the world's origin in the cameras
    points : (N, 3) in the world
    images, tracks : (K,) image and point of every observation
    pixels : (K, 2) where it was observed
    basis : (C, P, q) how the parameters of a camera follow its free ones
    residuals : (K, 2) filled: pixel − projection, px; NaN where there is none
    by_view : (K, 2, 6 + q) filled: derivatives of the projection by η and by the free parameters
    by_point : (K, 2, 3) filled: derivatives of the projection by the point
    """
    P = parameters.shape[1]
    q = basis.shape[2]
    d = np.empty((2, 3))
    d_parameters = np.zeros((2, P))
    lost = 0
    for k in range(images.shape[0]):
        i, j = images[k], tracks[k]
        c = camera_of[i]
        R = rotations[i]
        X, Y, Z = points[j, 0], points[j, 1], points[j, 2]
        px = R[0, 0] * X + R[0, 1] * Y + R[0, 2] * Z + places[i, 0]
        py = R[1, 0] * X + R[1, 1] * Y + R[1, 2] * Z + places[i, 1]
        pz = R[2, 0] * X + R[2, 1] * Y + R[2, 2] * Z + places[i, 2]
        d_parameters[:, :] = 0.0
        u, v = project_full_one(codes[c], parameters[c], math.inf, px, py, pz, d, d_parameters)
        residuals[k, 0], residuals[k, 1] = pixels[k, 0] - u, pixels[k, 1] - v
        if math.isnan(u + v):
            lost += 1
            by_view[k] = 0.0
            by_point[k] = 0.0
            continue
        for r in range(2):
            for m in range(3):
                by_point[k, r, m] = d[r, 0] * R[0, m] + d[r, 1] * R[1, m] + d[r, 2] * R[2, m]
                by_view[k, r, 3 + m] = -d[r, m]
            by_view[k, r, 0] = d[r, 1] * pz - d[r, 2] * py
            by_view[k, r, 1] = d[r, 2] * px - d[r, 0] * pz
            by_view[k, r, 2] = d[r, 0] * py - d[r, 1] * px
            for n in range(q):
                total = 0.0
                for m in range(P):
                    total += d_parameters[r, m] * basis[c, m, n]
                by_view[k, r, 6 + n] = total
    return lost


@kernel(i0(i1, f2, i1, f2, f2, i1, i1, f2, w2))
def reproject(codes, parameters, camera_of, poses, points, images, tracks, pixels, residuals):
    """Fill the residuals (K, 2) alone; returns how many observations have no projection."""
    lost = 0
    for k in range(images.shape[0]):
        i, j = images[k], tracks[k]
        c = camera_of[i]
        w, x, y, z = poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3]
        X, Y, Z = points[j, 0], points[j, 1], points[j, 2]
        # v + 2 w (q × v) + 2 q × (q × v)
        a, b, e = y * Z - z * Y, z * X - x * Z, x * Y - y * X
        px = X + 2.0 * (w * a + y * e - z * b) + poses[i, 4]
        py = Y + 2.0 * (w * b + z * a - x * e) + poses[i, 5]
        pz = Z + 2.0 * (w * e + x * b - y * a) + poses[i, 6]
        u, v = project_one(codes[c], parameters[c], math.inf, px, py, pz)
        residuals[k, 0], residuals[k, 1] = pixels[k, 0] - u, pixels[k, 1] - v
        if math.isnan(u + v):
            lost += 1
    return lost
