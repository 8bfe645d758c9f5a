"""The particle filter: a belief of any shape, carried by weighted samples."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.compile import compiled
from sequential.errors import DataError, ModelError, NotFiniteError, ShapeError
from sequential.filters.solution import collect_innovations, require_finite
from sequential.history import ParticleHistory, Report, Run
from sequential.simulate import root
from sequential.timeline import Problem, sealed

__all__ = ["ParticleFilter", "resample"]

Array = NDArray[np.float64]

SCHEMES = ("systematic", "stratified", "residual", "multinomial")
DRAWN = 2_000_000  # random numbers held at a time, 16 MB


@dataclass(frozen=True, slots=True, eq=False)
class ParticleFilter:
    """Propagate particles, weigh them by the likelihood, resample (Gordon, Salmond, Smith 1993: bootstrap).

    For beliefs that no Gaussian describes: several places at once, rings, unknown headings.

    Parameters
    ----------
    particles : how many; the error falls with its root, and the need grows steeply with the dimension
    rng : the only source of chance; every solve draws on from where it stands
    resampling : "systematic", "stratified", "residual" or "multinomial"; the last adds the most noise
    threshold : resample when the effective sample size falls below this share of the particles
    keep : keep all particles of all nodes in `Run.particles`

    Notes
    -----
    Process noise is drawn in the tangent after each step.  Estimates are the mean about the heaviest particle
    and the covariance there, before resampling.  A reading is gated by its predictive NIS, where the
    particles' spread and the noise make up S.  A robust loss weighs by exp(-ρ), the heavier tail that it
    stands for, which is not normalised in the log likelihood.  Effective sample sizes are in
    `Run.particles` and, at their smallest and on average, in `Run.report.details`.

    Raises
    ------
    ModelError
    """

    particles: int = 1000
    rng: np.random.Generator | None = None
    resampling: str = "systematic"
    threshold: float = 0.5
    keep: bool = False
    name = "pf"

    def __post_init__(self) -> None:
        if not isinstance(self.rng, np.random.Generator):
            raise ModelError(
                "a ParticleFilter draws from the generator that it is given: "
                f"rng=numpy.random.default_rng(seed); got {self.rng!r}"
            )
        if self.particles < 1:
            raise ModelError(f"a ParticleFilter has one particle or more, got {self.particles}")
        if not 0.0 <= self.threshold <= 1.0:
            raise ModelError(f"threshold is a share of the particles, 0 to 1, got {self.threshold}")
        _scheme(self.resampling)

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log.

        Raises
        ------
        ModelError, NotFiniteError
        """
        from sequential.kernels.particles import follow

        require_weighable(problem)
        assert self.rng is not None  # noqa: S101 - for the type checker
        whole, began, total = compiled(problem.model), time.perf_counter(), 0.0
        cloud, plan = self._cloud(problem), problem.schedule
        width = 1 if self.resampling == "systematic" else self.particles
        for span in _spans(plan.step_ptr, self.particles * whole.tables.d, width):
            nodes, steps = span[1] - span[0]
            normals = sealed(self.rng.standard_normal((steps, self.particles, whole.tables.d)))
            uniforms = sealed(self.rng.random((nodes, width)))
            gained, failed = follow(
                whole.tables, plan, sealed(span), normals, uniforms, _scheme(self.resampling), self.threshold,
                cloud,
            )  # fmt: skip
            whole.raise_failures()
            if failed >= 0:
                raise NotFiniteError(_lost(problem, failed))
            total += gained
        require_finite(problem, cloud.mean)
        details = {
            "particles": float(self.particles),
            "effective_min": float(cloud.effective.min()),
            "effective_mean": float(cloud.effective.mean()),
            "resampled": float((cloud.effective < self.threshold * self.particles).sum()),
        }
        report = Report(
            self.name,
            seconds=time.perf_counter() - began,
            message=whole.message(),
            rejected=int((cloud.accepted == 0).sum()),
            details=details,
        )
        kept = (cloud.kept, cloud.kept_weights) if self.keep else (None, None)
        history = ParticleHistory(cloud.effective, *kept)
        innovations, manifold = collect_innovations(problem, cloud), problem.model.manifold
        return Run(problem.t, cloud.mean, cloud.cov, manifold, innovations, total, report, particles=history)

    def _cloud(self, problem: Problem) -> Any:
        """Particles drawn from the prior, and the arrays that the kernel writes to."""
        from sequential.kernels.particles import Cloud

        assert self.rng is not None  # noqa: S101 - for the type checker
        manifold, prior, count = problem.model.manifold, problem.model.prior, self.particles
        steps = self.rng.standard_normal((count, manifold.dim)) @ root(prior.cov).T
        states = np.ascontiguousarray(manifold.retract(prior.mean, steps))
        nodes, (readings, widest) = len(problem.t), problem.schedule.z.shape
        kept = nodes if self.keep else 1
        return Cloud(
            states,
            np.full(count, 1.0 / count),
            np.empty((nodes, manifold.size)),
            np.empty((nodes, manifold.dim, manifold.dim)),
            np.empty(nodes),
            np.empty((kept, count, manifold.size)),
            np.empty((kept, count)),
            np.zeros((readings, widest)),
            np.zeros((readings, widest, widest)),
            np.zeros(readings, dtype=np.int64),
        )


def resample(weights: ArrayLike, rng: np.random.Generator, scheme: str = "systematic") -> NDArray[np.int64]:
    """Ancestors (N,) of N particles: each is drawn weight · N times on average.

    Parameters
    ----------
    weights : (N,) zero or more; they need not add up to one
    scheme : "systematic", "stratified", "residual" or "multinomial" (Douc, Cappé, Moulines 2005)

    Raises
    ------
    ShapeError, DataError, ModelError
    """
    from sequential.kernels.resampling import resample as draw

    given = np.array(weights, dtype=np.float64)
    if given.ndim != 1 or not len(given):
        raise ShapeError(f"weights have shape (N,), got {given.shape}")
    if not (np.all(given >= 0.0) and 0.0 < given.sum() < np.inf):
        raise DataError("weights are finite, zero or more, and not all zero")
    ancestors = np.empty(len(given), dtype=np.int64)
    draw(given / given.sum(), rng.random(len(given)), _scheme(scheme), np.empty(len(given)), ancestors)
    return ancestors


def _scheme(name: str) -> int:
    if name not in SCHEMES:
        raise ModelError(f"there is no resampling {name!r}; there are {', '.join(map(repr, SCHEMES))}")
    return SCHEMES.index(name)


def require_weighable(problem: Problem) -> None:
    """Raise `ModelError` where a reading has no density: a particle would never meet it exactly."""
    smallest = np.linalg.eigvalsh(problem.schedule.noise_cov).min(axis=1, initial=np.inf)
    if np.all(smallest > 0.0) or not len(problem.reading_t):
        return
    for index, (name, sensor) in enumerate(problem.model.sensors.items()):
        rows = np.flatnonzero(problem.schedule.sensor == index)
        cov = problem.noises(rows, sensor.manifold.dim)
        if len(rows) and np.linalg.eigvalsh(cov).min() <= 0.0:
            raise ModelError(
                f"a particle filter weighs by the likelihood of a reading, so the noise_cov of {name!r} must "
                "be positive definite; give it a little noise, or use ExtendedKalmanFilter(form='ud')"
            )


def _spans(step_ptr: NDArray[np.int64], per_step: int, per_node: int) -> Iterator[NDArray[np.int64]]:
    """Pieces [[node, step], [node, step]] of the log that take a bounded number of random numbers."""
    nodes, node, step = len(step_ptr) - 1, 0, 0
    at_once, together = max(1, DRAWN // per_step), max(1, DRAWN // per_node)
    while node < nodes:
        last = min(int(np.searchsorted(step_ptr[1:], step + at_once, side="right")), node + together)
        last = max(last, node)
        # up to the last whole node, and on into the next one as far as the numbers go
        end = min(step + at_once, int(step_ptr[-1])) if last < node + together else int(step_ptr[last])
        yield np.array([[node, step], [last, end]], dtype=np.int64)
        node, step = last, end


def _lost(problem: Problem, reading: int) -> str:
    name = list(problem.model.sensors)[problem.schedule.sensor[reading]]
    return (
        f"no particle expects anything finite of {name!r} at {problem.reading_t[reading] * 1e-9:.6f} s "
        f"(reading {problem.reading_row[reading]}): a model function returned NaN, or the cloud diverged"
    )
