"""How sure the place of a patch is: what its residuals are like, and what its texture says."""

from __future__ import annotations

import math

from vision3d.kernels import inlined
from vision3d.kernels.cubic import inside, slopes_at

__all__ = ["REACH", "P", "correlate", "factor", "information", "place_cov", "solve"]

P = 8  # parameters: a shift, four of the warp, gain, offset
REACH = 3  # of correlations of the residuals, px


@inlined
def factor(A, L, first):
    """Cholesky of the rows and columns from `first` on; whether it exists."""
    for i in range(first, P):
        for j in range(first, i + 1):
            s = A[i, j]
            for k in range(first, j):
                s -= L[i, k] * L[j, k]
            if i == j:
                if s <= 1e-9 * A[i, i] or s <= 0.0:
                    return False
                L[i, i] = math.sqrt(s)
            else:
                L[i, j] = s / L[j, j]
    return True


@inlined
def solve(L, first, x):
    """Replace x by the solution for the factor L."""
    for i in range(first, P):
        for k in range(first, i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(P - 1, first - 1, -1):
        for k in range(i + 1, P):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]


@inlined
def correlate(residual, weight, side, lags):
    """Add a patch's correlation of residuals, weighted, to lags (2 REACH + 1)², each 1 where they agree."""
    own = mass = 0.0
    for k in range(side * side):
        own += weight[k] * residual[k] * residual[k]
        mass += weight[k]
    if own <= 0.0:
        return
    own /= mass
    for v in range(-REACH, REACH + 1):
        for u in range(-REACH, REACH + 1):
            total = mass = 0.0
            for y in range(max(0, -v), min(side, side - v)):
                for x in range(max(0, -u), min(side, side - u)):
                    k, m = y * side + x, (y + v) * side + x + u
                    w = math.sqrt(weight[k] * weight[m])
                    total += w * residual[k] * residual[m]
                    mass += w
            lags[v + REACH, u + REACH] += total / mass / own


@inlined
def information(second, x, y, warp, gain, J, weight, radius, lead, shift, wx, wy, slope, A, L):
    """Factor sum w J J' to L, J' from the second image, whose noise is another; whether it exists.

    The noise of the first image stands twice in sum w J J, and would pass for texture.
    """
    A[:] = 0.0
    a, b, c, d = warp[0, 0] / gain, warp[0, 1] / gain, warp[1, 0] / gain, warp[1, 1] / gain
    k = 0
    for v in range(-radius, radius + 1):
        for u in range(-radius, radius + 1):
            bx, by = x + warp[0, 0] * u + warp[0, 1] * v, y + warp[1, 0] * u + warp[1, 1] * v
            if not inside(second, bx, by):
                return False
            slopes_at(second, bx, by, wx, wy, slope)
            gx, gy = weight[k] * (a * slope[0] + c * slope[1]), weight[k] * (b * slope[0] + d * slope[1])
            for j in range(lead, P):
                e = J[k, j]
                A[shift, j] += gx * e
                A[shift + 1, j] += gy * e
                if lead == 0:
                    A[2, j] += gx * u * e
                    A[3, j] += gx * v * e
                    A[4, j] += gy * u * e
                    A[5, j] += gy * v * e
                A[6, j] += weight[k] * J[k, 6] * e
                A[7, j] += weight[k] * e
            k += 1
    for i in range(lead, P):
        for j in range(lead, i):
            A[i, j] = A[j, i] = 0.5 * (A[i, j] + A[j, i])
    return factor(A, L, lead)


@inlined
def place_cov(L, J, weight, side, lead, shift, rho, along, field, cov):
    """xx, xy, yy of d for residuals of variance 1 with the correlation rho; returns 1ᵀ(A^-1)1 of d."""
    plain = 0.0
    for r in range(2):
        for i in range(P):
            along[r, i] = 0.0
        along[r, shift + r] = 1.0
        solve(L, lead, along[r])
        plain += along[r, shift + r]
        for k in range(side * side):
            total = 0.0
            for i in range(lead, P):
                total += along[r, i] * J[k, i]
            field[r, k] = weight[k] * total
    cov[0] = cov[1] = cov[2] = 0.0
    for v in range(-REACH, REACH + 1):
        for u in range(-REACH, REACH + 1):
            xx = xy = yy = 0.0
            for y in range(max(0, -v), min(side, side - v)):
                for x in range(max(0, -u), min(side, side - u)):
                    k, m = y * side + x, (y + v) * side + x + u
                    xx += field[0, k] * field[0, m]
                    xy += field[0, k] * field[1, m]
                    yy += field[1, k] * field[1, m]
            cov[0] += rho[v + REACH, u + REACH] * xx
            cov[1] += rho[v + REACH, u + REACH] * xy
            cov[2] += rho[v + REACH, u + REACH] * yy
    return plain
