"""Moving a belief from node to node, and that move linearised about a trajectory."""

from __future__ import annotations

from sequential.kernels.call import call, inlined
from sequential.kernels.charts import transport
from sequential.kernels.matrices import copy_matrix, copy_vector, fill_diagonal, multiply, push_covariance
from sequential.kernels.sensing import process_jacobian

__all__ = ["linearise_move", "linearise_prior", "predict"]


@inlined
def predict(model, plan, node, belief, x, p, phi, keep, work):
    """Carry belief = [x | p] (and phi with `keep`) along the steps that lead to a node."""
    d, width = model.d, plan.inputs.shape[1]
    f, flat, after, flipped = work
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        u, dt = plan.step_input[s] * width, plan.step_dt[s]
        if model.advance != 0 and (keep == 0 or model.carry != 0):
            if keep != 0:
                call(model.carry, x, 0, plan.inputs, u, dt, model.params, 0, phi, 0)
            call(model.advance, belief, 0, plan.inputs, u, dt, model.params, 0, belief, 0)
            continue
        call(model.step, x, 0, plan.inputs, u, dt, model.params, 0, after, 0)
        process_jacobian(model, x, plan.inputs, plan.step_input[s], dt, after, f)
        push_covariance(f, p, flat, flipped, d)
        call(model.noise, x, 0, plan.inputs, u, dt, model.params, 0, p, 0)
        if keep != 0:
            multiply(f, phi, flat, d, d, d)
            copy_matrix(flat, phi)
        copy_vector(after, x)


@inlined
def linearise_prior(model, prior, states, x, cov, e, turn, inverse, work):
    """The prior seen from the first state: e leads there, cov is its covariance in that tangent."""
    copy_vector(prior[0], x)
    copy_matrix(prior[1], cov)
    transport(model.table, len(model.table), model.d, x, 0, states, 0, e, turn, inverse)
    push_covariance(inverse, cov, work[0], work[1], model.d)


@inlined
def linearise_move(model, plan, node, trajectory, states, belief, x, q, phi, e, turn, inverse, work):
    """The move to a node about a trajectory: e leads from its arrival to the state, q is its noise there.

    The Jacobian of the whole move, in the tangents of the two states, ends in phi.
    """
    d = model.d
    copy_vector(trajectory[node - 1], x)
    fill_diagonal(q, 0.0)
    fill_diagonal(phi, 1.0)
    predict(model, plan, node, belief, x, q, phi, 1, work)
    transport(model.table, len(model.table), d, x, 0, states, node * model.n, e, turn, inverse)
    push_covariance(inverse, q, work[0], work[1], d)
    multiply(turn, phi, work[0], d, d, d)
    copy_matrix(work[0], phi)
