"""Systems that switch between models, drawn with their modes, and solved exactly over all sequences."""

from itertools import pairwise, product

import numpy as np

import sequential as sq
from sequential.model import evaluate
from sequential.simulate import root


def coasting(density, *, variance=0.25, gate=None, loss=None, prior=(1.0, 1.0, 0.25, 0.25)):
    """A point in the plane whose acceleration is white with the given density."""
    sensor = sq.LinearSensor([[1.0, 0, 0, 0], [0, 1.0, 0, 0]], [variance, variance], gate=gate, loss=loss)
    return sq.StateSpace(
        sq.Vector(4), sq.Gaussian([0.0, 0.0, 1.0, 0.5], np.diag(prior)),
        sq.ConstantVelocity(density, axes=2), {"position": sensor}, start=0.0,
    )  # fmt: skip


def wandering(density, variance=0.1):
    """One number that wanders, read directly."""
    return sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], [[1.0]]), sq.RandomWalk(density),
        {"z": sq.LinearSensor([[1.0]], variance)}, start=0.0,
    )  # fmt: skip


def matrices(model, dt):
    """Transition and noise of a linear process over dt, and the matrix and noise of its only sensor."""
    f, d = model.process_functions, model.manifold.dim
    zero, u = np.zeros(d), np.zeros(1)
    phi = evaluate(f.jacobian, zero, u, dt, f.params, d * d).reshape(d, d)
    noise = evaluate(f.noise, zero, u, dt, f.params, d * d).reshape(d, d)
    (sensor,) = model.sensors.values()
    return phi, noise, np.asarray(sensor.matrix, dtype=float), np.asarray(sensor.noise_cov)


def draw(models, transition, count, dt, rng, initial=None):
    """A log of linear models with one sensor, its truth (N, d) and its modes (N,)."""
    name = next(iter(models[0].sensors))
    chances = np.full(len(models), 1 / len(models)) if initial is None else initial
    mode = rng.choice(len(models), p=chances)
    prior = models[mode].prior
    x = prior.mean + root(prior.cov) @ rng.standard_normal(len(prior.mean))
    truth, modes, seen = [], [], []
    for k in range(count):
        if k:
            mode = rng.choice(len(models), p=transition[mode])
        phi, noise, h, r = matrices(models[mode], dt)
        if k:
            x = phi @ x + root(noise) @ rng.standard_normal(len(x))
        truth.append(x)
        modes.append(mode)
        seen.append(h @ x + root(r) @ rng.standard_normal(len(h)))
    log = sq.SensorLog({name: sq.Stream(np.arange(count) * dt, np.array(seen))})
    return log, np.array(truth), np.array(modes)


def enumerate_modes(models, transition, z, dt, initial):
    """Exact smoothed mean (N, d), covariance (N, d, d), mode chances (N, J) and log likelihood.

    Every sequence of modes is a linear model of its own: its joint Gaussian is conditioned on all readings.
    """
    chances, means, covs, sequences = [], [], [], list(product(range(len(models)), repeat=len(z)))
    found = [one_sequence(models, modes, z, dt) for modes in sequences]
    for modes, (log_likelihood, mean, cov) in zip(sequences, found, strict=True):
        chance = np.log(initial[modes[0]])
        chance += sum(np.log(transition[a, b]) for a, b in pairwise(modes))
        chances.append(chance + log_likelihood)
        means.append(mean)
        covs.append(cov)
    best = max(chances)
    weights = np.exp(np.array(chances) - best)
    total = best + np.log(weights.sum())
    weights /= weights.sum()
    mean = np.einsum("s,skd->kd", weights, means)
    apart = np.array(means) - mean
    cov = np.einsum("s,skde->kde", weights, covs) + np.einsum("s,skd,ske->kde", weights, apart, apart)
    is_in = np.array(sequences)[:, :, None] == np.arange(len(models))
    share = np.einsum("s,skj->kj", weights, is_in)
    return mean, cov, share, total


def one_sequence(models, modes, z, dt):
    """Log likelihood, means and covariances of all states given all readings, by one joint Gaussian."""
    count, d = len(modes), models[0].manifold.dim
    prior = models[modes[0]].prior
    mean, cov = np.zeros((count, d)), np.zeros((count, d, count, d))
    h_all, r_all = np.zeros((z.size, count * d)), np.zeros((z.size, z.size))
    for k, mode in enumerate(modes):
        phi, noise, h, r = matrices(models[mode], dt)
        if k == 0:
            mean[0], cov[0, :, 0] = prior.mean, prior.cov
        else:
            mean[k] = phi @ mean[k - 1]
            for other in range(k):
                cov[k, :, other] = phi @ cov[k - 1, :, other]
                cov[other, :, k] = cov[k, :, other].T
            cov[k, :, k] = phi @ cov[k - 1, :, k - 1] @ phi.T + noise
        m = len(h)
        h_all[k * m : (k + 1) * m, k * d : (k + 1) * d] = h
        r_all[k * m : (k + 1) * m, k * m : (k + 1) * m] = r
    joint = cov.reshape(count * d, count * d)
    s = h_all @ joint @ h_all.T + r_all
    residual = z.ravel() - h_all @ mean.ravel()
    gain = np.linalg.solve(s, h_all @ joint).T
    log_likelihood = -0.5 * (residual @ np.linalg.solve(s, residual) + np.linalg.slogdet(2 * np.pi * s)[1])
    smoothed = (mean.ravel() + gain @ residual).reshape(count, d)
    left = (joint - gain @ s @ gain.T).reshape(count, d, count, d)
    return log_likelihood, smoothed, left[np.arange(count), :, np.arange(count)]
