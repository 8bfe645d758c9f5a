"""The chain of a filter as one dense problem in plain NumPy: what recursive estimators are held against.

Nothing here knows a kernel: manifolds, model functions and differences only.
"""

from typing import NamedTuple

import numpy as np

from sequential.jacobians import difference
from sequential.model import evaluate


class Chain(NamedTuple):
    """A problem linearised at a trajectory (K, n); the unknowns are tangent steps δ_k there."""

    offset: np.ndarray  # (K, d) δ_k = Φ_k δ_{k-1} + offset_k + noise_k, with δ_{-1} = 0
    transition: np.ndarray  # (K, d, d)
    noise: np.ndarray  # (K, d, d)
    seen: np.ndarray  # (rows,) what the readings say of all δ: seen = H δ + v
    matrix: np.ndarray  # (rows, K d)
    cov: np.ndarray  # (rows, rows)


def step(problem, node, x):
    """The state that the process makes of x on the way to a node, with Φ (d, d) and Q (d, d)."""
    model, plan = problem.model, problem.schedule
    f, manifold = model.process_functions, model.manifold
    d = manifold.dim
    phi, q = np.eye(d), np.zeros((d, d))
    for s in range(plan.step_ptr[node], plan.step_ptr[node + 1]):
        u, dt = plan.inputs[plan.step_input[s]], plan.step_dt[s]

        def ahead(y, u=u, dt=dt):
            return evaluate(f.value, y, u, dt, f.params, manifold.size)

        if f.jacobian is None:
            jacobian = difference(ahead, x, manifold, manifold)
        else:
            jacobian = evaluate(f.jacobian, x, u, dt, f.params, d * d).reshape(d, d)
        phi = jacobian @ phi
        q = jacobian @ q @ jacobian.T + evaluate(f.noise, x, u, dt, f.params, d * d).reshape(d, d)
        x = ahead(x)
    return x, phi, q


def look(problem, reading, x):
    """Residual (m,), Jacobian (m, d) and noise (m, m) of one reading at x."""
    model, plan = problem.model, problem.schedule
    name = list(model.sensors)[plan.sensor[reading]]
    f, sensor, d = model.sensor_functions[name], model.sensors[name], model.manifold.dim
    image = sensor.manifold

    def observe(y):
        return evaluate(f.value, y, plan.context[reading], 0.0, f.params, image.size)

    if f.jacobian is None:
        jacobian = difference(observe, x, model.manifold, image)
    else:
        jacobian = evaluate(f.jacobian, x, plan.context[reading], 0.0, f.params, image.dim * d)
    residual = image.local(observe(x), plan.z[reading, : image.size])
    return residual, jacobian.reshape(image.dim, d), sensor.noise_cov


def linearise(problem, trajectory):
    """Expand prior, process and readings at a trajectory."""
    model, plan = problem.model, problem.schedule
    manifold, d, nodes = model.manifold, model.manifold.dim, len(problem.t)
    chain = [], [], []
    seen, rows, covs = [], [], []
    for k in range(nodes):
        if k == 0:
            before, phi, q = model.prior.mean, np.zeros((d, d)), model.prior.cov
        else:
            before, phi, q = step(problem, k, trajectory[k - 1])
        carried, inverse = manifold.transport(before, trajectory[k])
        chain[0].append(-inverse @ manifold.local(before, trajectory[k]))
        chain[1].append(carried @ phi)
        chain[2].append(inverse @ q @ inverse.T)
        for reading in range(plan.reading_ptr[k], plan.reading_ptr[k + 1]):
            residual, jacobian, noise = look(problem, reading, trajectory[k])
            wide = np.zeros((len(residual), nodes * d))
            wide[:, k * d : (k + 1) * d] = jacobian
            seen.append(residual)
            rows.append(wide)
            covs.append(noise)
    return Chain(*map(np.array, chain), np.concatenate(seen), np.concatenate(rows), block_diagonal(covs))


def block_diagonal(blocks):
    out = np.zeros(2 * (sum(map(len, blocks)),))
    at = 0
    for block in blocks:
        out[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return out


def least_squares(chain):
    """Means (K, d) and covariances (K, d, d) of δ by whitened rows; every noise must be definite."""
    nodes, d = chain.offset.shape
    left, right = [], []
    for k in range(nodes):
        white = np.linalg.inv(np.linalg.cholesky(chain.noise[k]))
        row = np.zeros((d, nodes * d))
        row[:, k * d : (k + 1) * d] = white
        if k:
            row[:, (k - 1) * d : k * d] = -white @ chain.transition[k]
        left.append(row)
        right.append(white @ chain.offset[k])
    white = np.linalg.inv(np.linalg.cholesky(chain.cov))
    a = np.concatenate([*left, white @ chain.matrix])
    b = np.concatenate([*right, white @ chain.seen])
    q, r = np.linalg.qr(a)
    inverse = np.linalg.inv(r)
    return blocks_of(inverse @ (q.T @ b), inverse @ inverse.T, d)


def condition(chain):
    """The same by conditioning the joint Gaussian of all nodes on the readings; noise may be singular."""
    mean, cov = prior_of(chain)
    cross = cov @ chain.matrix.T
    gain = np.linalg.solve(chain.matrix @ cross + chain.cov, cross.T).T
    left = np.eye(len(mean)) - gain @ chain.matrix
    mean = mean + gain @ (chain.seen - chain.matrix @ mean)
    return blocks_of(mean, left @ cov @ left.T + gain @ chain.cov @ gain.T, chain.offset.shape[1])


def prior_of(chain):
    """Mean (K d,) and covariance (K d, K d) of all δ before any reading."""
    nodes, d = chain.offset.shape
    spread = np.eye(nodes * d)
    for k in range(1, nodes):
        rows = slice(k * d, (k + 1) * d)
        spread[rows, : k * d] = chain.transition[k] @ spread[(k - 1) * d : k * d, : k * d]
    return spread @ chain.offset.ravel(), spread @ block_diagonal(chain.noise) @ spread.T


def blocks_of(mean, cov, d):
    nodes = len(mean) // d
    blocks = cov.reshape(nodes, d, nodes, d)
    return mean.reshape(nodes, d), blocks[np.arange(nodes), :, np.arange(nodes), :]


def gauss_newton(problem, trajectory, iterations=30):
    """The maximum a posteriori trajectory (K, n) and its covariances (K, d, d)."""
    manifold = problem.model.manifold
    for _ in range(iterations):
        delta, cov = condition(linearise(problem, trajectory))
        trajectory = manifold.retract(trajectory, delta)
        if np.abs(delta / np.sqrt(np.diagonal(cov, axis1=1, axis2=2))).max() < 1e-8:
            return trajectory, cov
    raise AssertionError(f"the dense Gauss-Newton still moves by {np.abs(delta).max()}")
