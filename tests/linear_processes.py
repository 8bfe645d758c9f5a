"""Every process that is linear in the state, each with its manifold: a family to state laws over."""

import numpy as np

import sequential as sq

SWING = sq.ContinuousProcess(
    [[0.0, 1.0], [-4.0, -0.3]], [[0.0], [1.0]], 0.2, [[0.0], [1.0]]
)  # a damped spring that is pushed

CONTINUOUS = {
    "random walk": (sq.RandomWalk([[0.2, 0.05], [0.05, 0.3]]), sq.Vector(2)),
    "constant velocity": (sq.ConstantVelocity(0.5, axes=2), sq.Vector(4)),
    "constant acceleration": (sq.ConstantAcceleration(0.7, axes=2), sq.Vector(6)),
    "Singer": (sq.Singer(3.0, 1.2, axes=2), sq.Vector(6)),
    "Gauss-Markov": (sq.GaussMarkov([2.0, 50.0], [0.5, 0.1]), sq.Vector(2)),
    "correlated Gauss-Markov": (sq.GaussMarkov([2.0, 5.0], cov=[[1.0, 0.3], [0.3, 0.5]]), sq.Vector(2)),
    "coordinated turn": (sq.CoordinatedTurn(0.4, 0.3), sq.Vector(4)),
    "spring": (SWING, sq.Vector(2)),
    "parts": (
        sq.Independent(motion=sq.ConstantVelocity(0.5), swing=SWING, bias=sq.GaussMarkov(8.0, 0.2)),
        sq.Product(motion=sq.Vector(2), swing=sq.Vector(2), bias=sq.Vector(1)),
    ),
}


def declare(process, manifold, sensors=None, prior_cov=None, **more):
    """A model with a linear process and, unless given, a sensor of the whole state."""
    n = manifold.size
    inputs = process.functions(manifold).inputs
    return sq.StateSpace(
        manifold,
        sq.Gaussian(np.zeros(n), np.eye(n) if prior_cov is None else prior_cov),
        process,
        {"all": sq.LinearSensor(np.eye(n), 0.1 * np.eye(n))} if sensors is None else sensors,
        input="drive" if inputs else None,
        start=0.0,
        **more,
    )
