"""Poses of three points seen along three rays: up to four.

With unknown distances λ the law of cosines gives three equations λᵢ² + λⱼ² - 2 cᵢⱼ λᵢ λⱼ = dᵢⱼ².  Two conics
in λ have no right-hand side; the degenerate one of their pencil, a root of a cubic, is a pair of lines, and a
line meets a conic in two points.  Persson, Nordberg 2018, "Lambda Twist"; Ding, Yang, Larsson, Olsson, Åström
2023, "Revisiting the P3P problem".  Distances are polished by Newton steps on the three equations.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f2, i0, i1, w2
from vision3d.kernels.polynomials import roots_of

__all__ = ["solve_p3p"]

FLAT = 1e-12
"""Squared sine of the angle at a corner of three points that are taken for a line."""
NEWTON, SETTLED = 5, 1e-15
PAIRS = np.array([[0, 1], [0, 2], [1, 2]])


@inlined
def adjugate(M, A):
    """Fill A with the adjugate of a symmetric M (3, 3); gives the determinant of M."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for r in range(3):
            s, t = (r + 1) % 3, (r + 2) % 3
            A[i, r] = M[j, s] * M[k, t] - M[j, t] * M[k, s]
    return M[0, 0] * A[0, 0] + M[0, 1] * A[0, 1] + M[0, 2] * A[0, 2]


@inlined
def conics(c, d, D1, D2):
    """Fill D1 and D2 (3, 3): forms that vanish at the distances, from cosines c and squared lengths d."""
    D1[:, :] = 0.0
    D2[:, :] = 0.0
    for e, D in ((0, D1), (1, D2)):
        i, j = PAIRS[e, 0], PAIRS[e, 1]
        D[i, i] += d[2]
        D[j, j] += d[2]
        D[i, j] -= d[2] * c[e]
        D[j, i] = D[i, j]
        D[1, 1] -= d[e]
        D[2, 2] -= d[e]
        D[1, 2] += d[e] * c[2]
        D[2, 1] = D[1, 2]


@inlined
def pencil(D1, D2, A1, A2, p):
    """Fill p (4,), the determinant of D1 + γ D2 in ascending powers of γ."""
    p[0] = adjugate(D1, A1)
    p[3] = adjugate(D2, A2)
    p[1], p[2] = 0.0, 0.0
    for i in range(3):
        for j in range(3):
            p[1] += A1[i, j] * D2[i, j]
            p[2] += A2[i, j] * D1[i, j]


@inlined
def line_pair(D, A, lines):
    """Fill lines (2, 3) of a degenerate conic D; False where not real.  A is room for its adjugate."""
    adjugate(D, A)
    i = 0
    for k in range(1, 3):
        if abs(A[k, k]) > abs(A[i, i]):
            i = k
    if not A[i, i] < 0.0:
        return False
    size = math.sqrt(-A[i, i])
    x, y, z = A[0, i] / size, A[1, i] / size, A[2, i] / size
    # D + [point]x has rank one: its rows are one line, its columns the other
    A[:, :] = D
    A[0, 1] += z
    A[0, 2] -= y
    A[1, 0] -= z
    A[1, 2] += x
    A[2, 0] += y
    A[2, 1] -= x
    row, column = 0, 0
    for r in range(3):
        for s in range(3):
            if abs(A[r, s]) > abs(A[row, column]):
                row, column = r, s
    for k in range(3):
        lines[0, k], lines[1, k] = A[row, k], A[k, column]
    return True


@inlined
def meet(line, D, points):
    """Fill points (2, 3) where a line meets a conic; gives their number, 0 or 2."""
    i = 0
    for k in range(1, 3):
        if abs(line[k]) > abs(line[i]):
            i = k
    j, k = (i + 1) % 3, (i + 2) % 3
    u, v = np.zeros(3), np.zeros(3)
    u[j], u[i] = line[i], -line[j]
    v[k], v[i] = line[i], -line[k]
    a, b, c = 0.0, 0.0, 0.0
    for r in range(3):
        for s in range(3):
            a += u[r] * D[r, s] * u[s]
            b += u[r] * D[r, s] * v[s]
            c += v[r] * D[r, s] * v[s]
    under = b * b - a * c
    if under < 0.0:
        if under < -1e-10 * (b * b + abs(a * c)):
            return 0
        under = 0.0
    q = -(b + math.copysign(math.sqrt(under), b))
    for e in range(3):
        points[0, e] = q * u[e] + a * v[e]
        points[1, e] = c * u[e] + q * v[e]
    return 2


@inlined
def distances(c, d, L):
    """Scale L (3,) to distances, all positive, and polish them; False where they are not."""
    if L[0] < 0.0:
        for k in range(3):
            L[k] = -L[k]
    e = 0
    for k in range(1, 3):
        if d[k] > d[e]:
            e = k
    i, j = PAIRS[e, 0], PAIRS[e, 1]
    square = L[i] * L[i] + L[j] * L[j] - 2.0 * c[e] * L[i] * L[j]
    if not (L[0] > 0.0 and L[1] > 0.0 and L[2] > 0.0 and square > 0.0):
        return False
    scale = math.sqrt(d[e] / square)
    for k in range(3):
        L[k] *= scale
    for _ in range(NEWTON):
        # f01 moves with L0 and L1 only, and so on: the determinant has two terms
        f0 = L[0] * L[0] + L[1] * L[1] - 2.0 * c[0] * L[0] * L[1] - d[0]
        f1 = L[0] * L[0] + L[2] * L[2] - 2.0 * c[1] * L[0] * L[2] - d[1]
        f2 = L[1] * L[1] + L[2] * L[2] - 2.0 * c[2] * L[1] * L[2] - d[2]
        a0, a1 = L[0] - c[0] * L[1], L[1] - c[0] * L[0]
        b0, b2 = L[0] - c[1] * L[2], L[2] - c[1] * L[0]
        e1, e2 = L[1] - c[2] * L[2], L[2] - c[2] * L[1]
        det = -a0 * b2 * e1 - a1 * b0 * e2
        if abs(f0) + abs(f1) + abs(f2) < SETTLED * (d[0] + d[1] + d[2]) or det == 0.0:
            break
        L[0] -= 0.5 * (-b2 * e1 * f0 - a1 * e2 * f1 + a1 * b2 * f2) / det
        L[1] -= 0.5 * (-b0 * e2 * f0 + a0 * e2 * f1 - a0 * b2 * f2) / det
        L[2] -= 0.5 * (b0 * e1 * f0 - a0 * e1 * f1 - a1 * b0 * f2) / det
    return L[0] > 0.0 and L[1] > 0.0 and L[2] > 0.0


@inlined
def frame(P, F):
    """Fill F (3, 3) with an orthonormal frame of three points P (3, 3), in its rows; False on a line."""
    first, second = 0.0, 0.0
    for k in range(3):
        F[0, k] = P[1, k] - P[0, k]
        first += F[0, k] ** 2
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        F[2, k] = F[0, a] * (P[2, b] - P[0, b]) - F[0, b] * (P[2, a] - P[0, a])
        second += F[2, k] ** 2
    far = (P[2, 0] - P[0, 0]) ** 2 + (P[2, 1] - P[0, 1]) ** 2 + (P[2, 2] - P[0, 2]) ** 2
    if not second > FLAT * first * far:
        return False
    for k in range(3):
        F[0, k] /= math.sqrt(first)
        F[2, k] /= math.sqrt(second)
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        F[1, k] = F[2, a] * F[0, b] - F[2, b] * F[0, a]
    return True


@inlined
def write_pose(P, C, F, G, pose):
    """Fill pose (7,) that brings points P with frame F to points C with frame G."""
    R = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                R[i, j] += G[k, i] * F[k, j]
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    best = 0
    for k in range(3):
        if R[k, k] > (trace if best == 0 else R[best - 1, best - 1]):
            best = k + 1
    if best == 0:
        pose[0] = 1.0 + trace
        pose[1], pose[2], pose[3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    else:
        i = best - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        pose[0] = R[k, j] - R[j, k]
        pose[1 + i] = 1.0 + R[i, i] - R[j, j] - R[k, k]
        pose[1 + j], pose[1 + k] = R[j, i] + R[i, j], R[k, i] + R[i, k]
    norm = math.sqrt(pose[0] ** 2 + pose[1] ** 2 + pose[2] ** 2 + pose[3] ** 2)
    norm = math.copysign(norm, pose[0])
    for k in range(4):
        pose[k] /= norm
    for i in range(3):
        pose[4 + i] = 0.0
        for n in range(3):
            pose[4 + i] += (C[n, i] - R[i, 0] * P[n, 0] - R[i, 1] * P[n, 1] - R[i, 2] * P[n, 2]) / 3.0


@kernel((i0)(f2, i1, w2))
def solve_p3p(data, sample, out):
    """Fill out (S, 7) with the poses camera_T_object of three points; gives their number, at most 4.

    `data` (N, 6 or more) begins with a point and the unit ray that it was seen along; `sample` (3,) are rows
    of it; S >= 4.
    """
    P, F, C, G = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    c, d, L = np.empty(3), np.empty(3), np.empty(3)
    for n in range(3):
        for k in range(3):
            P[n, k] = data[sample[n], k]
    if not frame(P, F):
        return 0
    for e in range(3):
        i, j = PAIRS[e, 0], PAIRS[e, 1]
        c[e], d[e] = 0.0, 0.0
        for k in range(3):
            c[e] += data[sample[i], 3 + k] * data[sample[j], 3 + k]
            d[e] += (P[i, k] - P[j, k]) ** 2
    total = d[0] + d[1] + d[2]
    D1, D2, D0 = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    A1, A2 = np.empty((3, 3)), np.empty((3, 3))
    p, roots, table, ends, some = np.empty(4), np.empty(3), np.zeros((4, 4)), np.empty(5), np.empty(3)
    lines, points, count = np.empty((2, 3)), np.empty((2, 3)), 0
    for e in range(3):
        d[e] /= total
    conics(c, d, D1, D2)
    pencil(D1, D2, A1, A2, p)
    found = roots_of(p, 3, table, ends, some, roots)
    for g in range(found):
        D0[:, :] = D1 + roots[g] * D2
        if not line_pair(D0, A1, lines):
            continue
        for one in range(2):
            for m in range(meet(lines[one], D1, points)):
                L[:] = points[m]
                if count == 4 or not distances(c, d, L):
                    continue
                for n in range(3):
                    for k in range(3):
                        C[n, k] = L[n] * math.sqrt(total) * data[sample[n], 3 + k]
                if frame(C, G):
                    write_pose(P, C, F, G, out[count])
                    count += 1
        break
    return count
