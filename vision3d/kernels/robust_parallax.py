"""A fundamental matrix from a plane and two points off it, where most matches lie on that plane.

Seven matches of which six or more are in a plane fit many fundamental matrices, and most rows agree with any
of them; the plane's homography leaves only the epipole open, which two more matches give (Chum, Werner, Matas
2005, "Two-view geometry estimation unaffected by a dominant plane").
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, i0, i1, w1
from vision3d.kernels.robust_local import climb
from vision3d.kernels.robust_sampling import draw
from vision3d.kernels.robust_scoring import score

__all__ = ["plane_and_parallax"]

BLOCK = 64
EQUAL = 1e-12


@inlined
def parallax_line(data, i, H, line):
    """Fill line (3,) with the join of a match's second point and of where the plane would put it."""
    x, y = data[i, 0], data[i, 1]
    px, py = H[0] * x + H[1] * y + H[2], H[3] * x + H[4] * y + H[5]
    pz = H[6] * x + H[7] * y + H[8]
    u, v = data[i, 2], data[i, 3]
    line[0], line[1], line[2] = v * pz - py, px - u * pz, u * py - v * px


@inlined
def from_epipole(e, H, F):
    """Fill F (9,) = [e]ₓ H of unit norm; false where there is none."""
    size = 0.0
    for j in range(3):
        F[j] = e[1] * H[6 + j] - e[2] * H[3 + j]
        F[3 + j] = e[2] * H[j] - e[0] * H[6 + j]
        F[6 + j] = e[0] * H[3 + j] - e[1] * H[j]
    for k in range(9):
        size += F[k] * F[k]
    if not size > EQUAL:
        return False
    for k in range(9):
        F[k] /= math.sqrt(size)
    return True


@kernel(f0(f2, f1, i1, i1, f1, f0, f0, i0, types.uint64, w1))
def plane_and_parallax(data, weights, functions, off, H, threshold2, limit, trials, seed, model):
    """Look for a model (9,) of cost below the limit through pairs of rows off the plane of H (9,).

    The rows `off` are those that do not agree with H.  Returns the cost, or the limit where none is better.
    """
    n = data.shape[0]
    random, pair = np.array([seed], np.uint64), np.empty(2, np.int64)
    a, b, e, F = np.empty(3), np.empty(3), np.empty(3), np.empty(9)
    none, room, looked = np.array([0.0, 0.0, math.inf]), np.empty(BLOCK), np.empty(2)
    errors, share, best, best_pair = np.empty(n), np.empty(n), limit, math.inf
    for _ in range(trials):
        draw(random, off.shape[0], 0, 2, pair)
        parallax_line(data, off[pair[0]], H, a)
        parallax_line(data, off[pair[1]], H, b)
        e[0], e[1], e[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
        size = math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
        if not size > EQUAL:
            continue
        e /= size
        if not from_epipole(e, H, F):
            continue
        cost = score(functions[1], data, weights, F, threshold2, False, best_pair, none, room, looked)
        if not cost < best_pair:
            continue
        best_pair = cost
        if climb(functions, data, weights, threshold2, n, F, errors, share) < 1:
            continue
        cost = score(functions[1], data, weights, F, threshold2, False, best, none, room, looked)
        if cost < best:
            best = cost
            model[:] = F
    return best
