"""Marginal covariances of a chain, all nodes in one pass.

`gtsam.Marginals` answers one query at a time; with a static variable that every node touches, each joint
marginal eliminates the chain anew (4 ms a node, 1200 nodes: 5 s).  A linear filter forwards and a smoother
backwards about the solution solve the same normal equations in a millisecond.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.smoothers.chain import ChainPass
from sequential.timeline import Problem

__all__ = ["chain_marginals"]

Array = NDArray[np.float64]


def chain_marginals(problem: Problem, trajectory: Array) -> Array:
    """(K, d, d) covariance of every node, linearised at a trajectory (K, n), robust weights taken there.

    Raises
    ------
    NotPositiveDefiniteError
    """
    chain, prior = ChainPass(problem, problem.schedule), problem.model.prior
    chain.solve(prior.mean, prior.cov, trajectory)
    return chain.cov
