"""Smoothing with particles: whole trajectories, drawn backwards."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from sequential.compile import compiled
from sequential.errors import ModelError
from sequential.filters.particle import ParticleFilter
from sequential.history import ParticleHistory, Run
from sequential.timeline import Problem, sealed

__all__ = ["BackwardSimulation"]


@dataclass(frozen=True, slots=True, eq=False)
class BackwardSimulation:
    """Draw trajectories from all readings through a particle filter (Godsill, Doucet, West 2004).

    From a particle of the last node, each trajectory goes back to a particle of the node before, drawn by its
    weight and by how likely the process leads from it to where the trajectory is.  The trajectories are in
    `Run.particles.states` (N, T, n), all of one weight; mean and covariance are theirs.

    Parameters
    ----------
    filter : a `ParticleFilter`; its particles of all nodes are kept, and its generator draws on
    trajectories : how many; the time grows with this number times that of the particles

    Notes
    -----
    The process noise must move every direction between two nodes, since its density is asked for; between
    nodes of several steps it is gathered to first order.  Where it is small beside the distances of the
    particles, few ancestors remain: take more particles.  The innovations are those of the filter.

    Raises
    ------
    ModelError
    """

    filter: ParticleFilter
    trajectories: int = 100

    def __post_init__(self) -> None:
        if not isinstance(self.filter, ParticleFilter):
            raise ModelError(
                f"BackwardSimulation smooths a ParticleFilter, got {type(self.filter).__name__}; "
                "RauchTungStriebel(…) smooths Gaussian filters"
            )
        if self.trajectories < 2:
            raise ModelError(f"a covariance needs two trajectories or more, got {self.trajectories}")

    @property
    def name(self) -> str:
        """The filter's name with `_backward` behind it."""
        return f"{self.filter.name}_backward"

    def solve(self, problem: Problem) -> Run:
        """Filter forwards, draw trajectories backwards.

        Raises
        ------
        ModelError
            where the process noise is singular between two nodes.
        """
        from sequential.kernels.backward_simulation import draw_backwards, summarise

        began, model = time.perf_counter(), problem.model
        forward = replace(self.filter, keep=True).solve(problem)
        cloud, rng = forward.particles, self.filter.rng
        assert cloud is not None  # noqa: S101 - for the type checker
        assert cloud.states is not None  # noqa: S101
        assert cloud.weights is not None  # noqa: S101
        assert rng is not None  # noqa: S101
        whole, nodes = compiled(model), len(problem.t)
        out = np.empty((nodes, self.trajectories, model.manifold.size))
        uniforms = sealed(rng.random((nodes, self.trajectories)))
        stuck = draw_backwards(whole.tables, problem.schedule, cloud.states, cloud.weights, uniforms, out)
        whole.raise_failures()
        if stuck >= 0:
            raise ModelError(
                "backward simulation asks for the density of the process noise, which is singular on the way "
                f"to {problem.t[stuck] * 1e-9:.6f} s; give every part of the state a little noise"
            )
        weights = np.full((nodes, self.trajectories), 1.0 / self.trajectories)
        mean, cov = np.empty_like(forward.mean), np.empty_like(forward.cov)
        summarise(whole.tables, out, weights, mean, cov)
        report = replace(forward.report, estimator=self.name, seconds=time.perf_counter() - began)
        history = ParticleHistory(cloud.effective, out, weights)
        return replace(forward, mean=mean, cov=cov, report=report, particles=history)
