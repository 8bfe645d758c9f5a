"""Normal equations of a bundle adjustment of one camera: an arrow, gathered view by view.

With θ the camera's parameters and two of a bent board, and ξ_v the pose of view v in the chart
`camera_T_board * Exp(ξ)` (rotation, then translation, in the board's frame), residuals r = pixel − projection
and weights w, one pass gives per view

    U_v = Σ w A'A    W_v = Σ w A'B    T_v = Σ w B'B    a_v = Σ w A'r    b_v = Σ w B'r

where A = ∂projection/∂θ (2, q) and B = ∂projection/∂ξ_v (2, 6).
"""

import math

import numpy as np

from vision3d.kernels import kernel
from vision3d.kernels.arrays import f1, f2, i0, i1, w2, w3
from vision3d.kernels.lenses import project_full_one


@kernel(i0(i0, f1, f1, f2, i1, f2, f2, f2, f1, w2, w3, w3, w3, w2, w2))
def normal_equations(
    lens, parameters, warp, poses, starts, points, bend, pixels, weights, residuals, U, W, T, a, b
):
    """Fill the residuals (M, 2) and the blocks per view; returns how many points have no projection.

    Points `starts[v]` to `starts[v + 1]` belong to view v; `bend` (M, 2) says how far along z the two
    numbers of `warp` push every point.  Points without a projection get a residual of NaN and no weight.
    """
    p = parameters.shape[0]
    q = p + 2
    by_point = np.empty((2, 3))
    by_parameters = np.empty((2, p))
    A = np.empty((2, q))
    B = np.empty((2, 6))
    R = np.empty((3, 3))
    lost = 0
    for v in range(poses.shape[0]):
        U[v] = 0.0
        W[v] = 0.0
        T[v] = 0.0
        a[v] = 0.0
        b[v] = 0.0
        w, x, y, z = poses[v, 0], poses[v, 1], poses[v, 2], poses[v, 3]
        R[0, 0] = 1.0 - 2.0 * (y * y + z * z)
        R[0, 1] = 2.0 * (x * y - w * z)
        R[0, 2] = 2.0 * (x * z + w * y)
        R[1, 0] = 2.0 * (x * y + w * z)
        R[1, 1] = 1.0 - 2.0 * (x * x + z * z)
        R[1, 2] = 2.0 * (y * z - w * x)
        R[2, 0] = 2.0 * (x * z - w * y)
        R[2, 1] = 2.0 * (y * z + w * x)
        R[2, 2] = 1.0 - 2.0 * (x * x + y * y)
        for i in range(starts[v], starts[v + 1]):
            X, Y = points[i, 0], points[i, 1]
            Z = points[i, 2] + bend[i, 0] * warp[0] + bend[i, 1] * warp[1]
            u, v_px = project_full_one(
                lens,
                parameters,
                math.inf,
                R[0, 0] * X + R[0, 1] * Y + R[0, 2] * Z + poses[v, 4],
                R[1, 0] * X + R[1, 1] * Y + R[1, 2] * Z + poses[v, 5],
                R[2, 0] * X + R[2, 1] * Y + R[2, 2] * Z + poses[v, 6],
                by_point,
                by_parameters,
            )
            residuals[i, 0] = pixels[i, 0] - u
            residuals[i, 1] = pixels[i, 1] - v_px
            if math.isnan(residuals[i, 0] + residuals[i, 1]):
                lost += 1
                continue
            weight = weights[i]
            if weight == 0.0:
                continue
            for k in range(2):
                for j in range(3):
                    B[k, 3 + j] = (
                        by_point[k, 0] * R[0, j] + by_point[k, 1] * R[1, j] + by_point[k, 2] * R[2, j]
                    )
                # the board turns about its own axes: d = X × (∂projection/∂X)
                B[k, 0] = Y * B[k, 5] - Z * B[k, 4]
                B[k, 1] = Z * B[k, 3] - X * B[k, 5]
                B[k, 2] = X * B[k, 4] - Y * B[k, 3]
                for j in range(p):
                    A[k, j] = by_parameters[k, j]
                A[k, p] = B[k, 5] * bend[i, 0]
                A[k, p + 1] = B[k, 5] * bend[i, 1]
            for k in range(2):
                r = residuals[i, k]
                for m in range(q):
                    scaled = weight * A[k, m]
                    a[v, m] += scaled * r
                    for n in range(m + 1):
                        U[v, m, n] += scaled * A[k, n]
                    for n in range(6):
                        W[v, m, n] += scaled * B[k, n]
                for m in range(6):
                    scaled = weight * B[k, m]
                    b[v, m] += scaled * r
                    for n in range(m + 1):
                        T[v, m, n] += scaled * B[k, n]
        for m in range(q):
            for n in range(m):
                U[v, n, m] = U[v, m, n]
        for m in range(6):
            for n in range(m):
                T[v, n, m] = T[v, m, n]
    return lost
