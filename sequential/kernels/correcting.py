"""The update of a belief by a linearised reading, in the default form: quick, and redone where in doubt.

Joseph's form is silently wrong where S is nearly singular: in the example of Grewal and Andrews (2015,
ex. 7.2) with δ = 1e-8 its error is 0.4 of the variance.  The pivots of S tell: one that keeps less than
`DOUBTFUL` of its diagonal has lost that share of its digits.  Such an update, and one that leaves a negative
variance, is done again as U D Uᵀ.
"""

from __future__ import annotations

import numpy as np
from numba import types

from sequential.kernels.arrays import b0, f0, f1, f2, i0, w1, w2
from sequential.kernels.belief import add_correction, gain_and_innovation, joseph
from sequential.kernels.bierman import BIERMAN_VECTORS, update_covariance_ud
from sequential.kernels.call import allocating, bare_as, inlined, inlined_as
from sequential.kernels.matrices import copy_matrix
from sequential.kernels.sensing import scratch_size

__all__ = [
    "CORRECTION",
    "DOUBT",
    "DOUBTFUL",
    "correct",
    "correction_scratch",
    "doubt_scratch",
    "redo",
    "settle",
]

DOUBTFUL = 1e-9
PAIR = types.Tuple([f0, f0])
DOUBT = types.Tuple([w2, w2, w2, w2])
CORRECTION = types.Tuple([w2, w1, w2, w2, w2, w2, w2, w1, w1, w2, DOUBT])


@bare_as(PAIR(f2, f2, f2, f0, f1, i0, i0, w2, w1, DOUBT))
def redo(p, h, noise, weight, residual, m, d, updated, delta, doubt):
    """(NIS, log det S) in UD form; the new covariance goes to `updated`, K·residual to `delta`.

    NIS is -1 where P or S is not positive.
    """
    copy_matrix(p, updated)
    for i in range(d):
        delta[i] = 0.0
    u, rows, lower, vectors = doubt
    return update_covariance_ud(updated, h, noise, weight, residual, m, d, delta, u, rows, lower, vectors)


@inlined_as(b0(f2, f2, i0))
def doubtful(innovation_cov, lower, m):
    """Whether a pivot of S has kept too few digits."""
    found = False
    for i in range(m):
        found = found or not DOUBTFUL * innovation_cov[i, i] * lower[i, i] < 1.0
    return found


@inlined
def correct(p, h, noise, weight, residual, m, d, update):
    """K·residual into `delta`; returns (NIS, a, b, whether it had to be redone), NIS -1 for an S < 0.

    log det S = a + log b, as in `gain_and_innovation`.
    """
    cross, gain, innovation_cov, lower, delta = update[2], update[3], update[4], update[5], update[7]
    nis, log_det, determinant = gain_and_innovation(
        p, h, noise, weight, residual, m, d, innovation_cov, lower, cross, gain, update[8]
    )
    if nis < 0.0 or doubtful(innovation_cov, lower, m):
        nis, log_det = redo(p, h, noise, weight, residual, m, d, update[9], delta, update[10])
        return nis, log_det, 1.0, True
    for i in range(d):
        delta[i] = 0.0
    add_correction(gain, residual, m, d, delta)
    return nis, log_det, determinant, False


@inlined
def settle(p, h, noise, weight, residual, m, d, update, redone):
    """Make P the covariance after the correction that came before; False where there is none."""
    cross, gain, scaled, delta, updated = update[2], update[3], update[6], update[7], update[9]
    sound = redone or joseph(p, h, cross, gain, noise, weight, m, d, updated, scaled)
    if not sound:
        sound = redo(p, h, noise, weight, residual, m, d, updated, delta, update[10])[0] >= 0.0
    for i in range(d):
        for j in range(d):
            p[i, j] = updated[i, j]
    return sound


@allocating
def doubt_scratch(d, widest):
    """Arrays for `redo`, of type DOUBT."""
    square, rows = np.empty((d, d)), np.empty((widest, d))
    return square, rows, np.empty((widest, widest)), np.empty((BIERMAN_VECTORS, max(widest, d)))


@allocating
def correction_scratch(n, d, widest):
    """Arrays for an update, of type CORRECTION.

    H (m, d), scratch of a look, H P, Kᵀ, S, its factor, K R, K·residual, a vector, the new
    covariance, and those of a doubtful update.
    """
    flat = np.empty(scratch_size(n, d, widest))
    return (
        np.empty((widest, d)), flat, np.empty((widest, d)), np.empty((widest, d)),
        np.empty((widest, widest)), np.empty((widest, widest)), np.empty((d, max(widest, d))),
        np.empty(d), np.empty(max(d, widest)), np.empty((d, d)), doubt_scratch(d, widest),
    )  # fmt: skip
