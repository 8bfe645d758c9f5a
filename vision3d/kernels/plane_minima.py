"""Both minima of the reprojection error of a flat object.

Weak perspective leaves a flat object two readings, mirror images about the line of sight (Schweighofer and
Pinz 2006, "Robust pose estimation from a planar target"); `two_minima` descends into both.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.plane_pose import cholesky, descend, normal_equations, rotate_right, solve

__all__ = ["two_minima"]

ITERATIONS = 60
SAME = 1e-3  # rad: minima whose normals are closer are one


@inlined
def mirrored(R, t, out):
    """The other reading under weak perspective: depths reversed along the line of sight to the centre."""
    norm = math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    for j in range(2):
        along = (R[0, j] * t[0] + R[1, j] * t[1] + R[2, j] * t[2]) / norm
        for i in range(3):
            out[i, j] = R[i, j] - 2.0 * along * t[i] / norm
    out[0, 2] = out[1, 0] * out[2, 1] - out[2, 0] * out[1, 1]
    out[1, 2] = out[2, 0] * out[0, 1] - out[0, 0] * out[2, 1]
    out[2, 2] = out[0, 0] * out[1, 1] - out[1, 0] * out[0, 1]


@kernel("f8(f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1])")
def settle(R, t, X, n, A, W, rows, H):
    """Move R and t to the nearest minimum; returns chi squared, and leaves the normal equations in H (6, 6).

    The valley is curved: a step of the normal wants a place of its own.  So all but the normal is fitted
    after each step, before chi squared is compared (variable projection: Golub and Pereyra 1973).
    """
    R2, t2, H2 = np.empty((3, 3)), np.empty(3), np.empty((6, 6))
    g, step, L = np.empty(6), np.zeros(6), np.empty((6, 6))
    chi2 = descend(R, t, X, n, A, W, 2, 15, 1e-4, rows, H)
    if not chi2 < math.inf:
        return math.inf
    damping = 1e-4
    chi2 = normal_equations(R, t, X, n, A, W, rows, H, g)
    for _ in range(ITERATIONS):
        if math.isnan(cholesky(H, 0, damping, L)):
            damping = 10.0 * damping + 1e-9
            continue
        solve(L, g, 0, step)
        rotate_right(R, step[0], step[1], step[2], R2)
        gain = 0.0
        for i in range(6):
            gain -= step[i] * g[i]
        for i in range(3):
            t2[i] = t[i] + R[i, 0] * step[3] + R[i, 1] * step[4] + R[i, 2] * step[5]
        lower = descend(R2, t2, X, n, A, W, 2, 5, 1e-6, rows, H2)
        if lower <= chi2 + 1e-12 * (1.0 + chi2):
            for i in range(3):
                t[i] = t2[i]
                for j in range(3):
                    R[i, j] = R2[i, j]
            chi2 = normal_equations(R, t, X, n, A, W, rows, H, g)
            damping = 0.1 * damping if damping > 1e-9 else 0.0
            if gain < 1e-10 and damping < 1e-3:
                break
        else:
            if gain < 1e-12 or damping > 1e8:
                break
            damping = 10.0 * damping + 1e-9
    return chi2


@inlined
def exchange(R, t, chi2, H):
    """Put the second minimum first."""
    chi2[0], chi2[1] = chi2[1], chi2[0]
    for i in range(3):
        t[0, i], t[1, i] = t[1, i], t[0, i]
        for j in range(3):
            R[0, i, j], R[1, i, j] = R[1, i, j], R[0, i, j]
    for i in range(6):
        for j in range(6):
            H[0, i, j], H[1, i, j] = H[1, i, j], H[0, i, j]


@inlined
def same_tilt(R):
    """Whether two minima have one normal."""
    cosine = R[0, 0, 2] * R[1, 0, 2] + R[0, 1, 2] * R[1, 1, 2] + R[0, 2, 2] * R[1, 2, 2]
    return cosine > math.cos(SAME)


@kernel("i8(f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[::1], f8[:,:,::1])")
def two_minima(X, n, A, W, R, t, chi2, H):
    """Descend from R[0], t[0] and from its mirror image; the better minimum comes first.

    R (2, 3, 3), t (2, 3), chi2 (2,) and H (2, 6, 6) are filled; returns how many minima there are.
    """
    rows = np.empty((2 * W.shape[1], 7))
    mirrored(R[0], t[0], R[1])
    for i in range(3):
        t[1, i] = t[0, i]
    for m in range(2):
        chi2[m] = settle(R[m], t[m], X, n, A, W, rows, H[m])
    for _ in range(2):  # the first starts may have led to one place: mirror what is better once more
        if chi2[1] < chi2[0]:
            exchange(R, t, chi2, H)
        if not chi2[0] < math.inf:
            return 0
        if chi2[1] < math.inf and not same_tilt(R):
            return 2
        mirrored(R[0], t[0], R[1])
        for i in range(3):
            t[1, i] = t[0, i]
        chi2[1] = settle(R[1], t[1], X, n, A, W, rows, H[1])
    if chi2[1] < chi2[0]:
        exchange(R, t, chi2, H)
    return 1 if same_tilt(R) or not chi2[1] < math.inf else 2
