"""From each node to the next: where the process leads, and the Jacobian and the noise gathered on the way."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from sequential.kernels.arrays import f2, w2, w3
from sequential.kernels.call import bare
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal
from sequential.kernels.moving import predict
from sequential.kernels.records import MODEL, SCHEDULE

__all__ = ["walk"]


@bare
def walk_nodes(model, plan, trajectory, belief, x, q, phi, work, arrived, transition, noise):
    """The loop of `walk`, with every array at hand."""
    for node in range(len(plan.reading_ptr) - 1):
        copy_vector(trajectory[max(node - 1, 0)], x)
        fill_diagonal(q, 0.0)
        fill_diagonal(phi, 1.0)
        if node > 0:
            predict(model, plan, node, belief, x, q, phi, 1, work)
        copy_vector(x, arrived[node])
        copy_matrix(phi, transition[node])
        copy_matrix(q, noise[node])


@njit(types.void(MODEL, SCHEDULE, f2, w2, w3, w3), cache=True, error_model="numpy")
def walk(model, plan, trajectory, arrived, transition, noise):
    """From each node's state to the next node: arrival (K, n), Φ and Q (K, d, d); entry 0 stands still."""
    n, d = model.n, model.d
    belief = np.empty(n + d * d)
    x, q, phi = belief[:n], belief[n:].reshape((d, d)), np.empty((d, d))
    work = (np.empty((d, d)), np.empty((d, d)), np.empty(n), np.empty((d, d)))
    walk_nodes(model, plan, trajectory, belief, x, q, phi, work, arrived, transition, noise)
