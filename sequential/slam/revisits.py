"""How well loops close: one landmark, seen again after the robot has been elsewhere.

Where a recording has no truth, its revisits are what can be checked.  Each *visit* of a landmark, a run of
sightings without a long pause, says by itself where the landmark is, given the poses.  The *loop error* of a
visit is how far that is from where the visit before had put it: the drift of dead reckoning, and the noise of
the sightings alone once the trajectory is right.

An estimator that has used all sightings is judged by them twice, so `without_visits` keeps some visits back:
what it does to those is a prediction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.slam.estimate import Values
from sequential.slam.problem import Factors, SlamProblem

__all__ = ["LoopErrors", "Visits", "loop_errors", "visits_of", "without_visits"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
AWAY_STEPS = 100


@dataclass(frozen=True, slots=True, eq=False)
class Visits:
    """Sightings of one group, sorted by landmark and step.

    Parameters
    ----------
    group : number of the factors in the problem
    rows : (N,) sightings in order
    visit : (N,) which visit each belongs to, counted over all landmarks
    landmark : (V,) whom each visit is of
    again : (V,) whether the landmark had been visited before: then there is a loop error
    """

    group: int
    rows: Ints
    visit: Ints
    landmark: Ints
    again: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class LoopErrors:
    """Distances (R,) in m between what a revisit says of its landmark and what the visit before it said."""

    landmark: Ints
    distance: Array

    @property
    def rms(self) -> float:
        """Root mean square, m."""
        return float(np.sqrt(np.mean(self.distance**2)))

    @property
    def median(self) -> float:
        """Half of the revisits are nearer, m."""
        return float(np.median(self.distance))

    @property
    def worst(self) -> float:
        """Farthest, m."""
        return float(self.distance.max())

    def to_json(self) -> dict[str, float | int]:
        """Plain numbers."""
        return {
            "rms_m": self.rms,
            "median_m": self.median,
            "worst_m": self.worst,
            "revisits": len(self.distance),
        }


def visits_of(problem: SlamProblem, group: int, away_steps: int = AWAY_STEPS) -> Visits:
    """The visits that a group of sightings is made of; a longer pause than `away_steps` ends one.

    Raises
    ------
    ModelError
        where the group does not join a pose that moves with one landmark that does not.
    """
    factors = problem.factors[group]
    _, slot = _slots(problem, factors)
    who = np.asarray(factors.index)[:, slot]
    step = problem.steps[group]
    rows = np.lexsort((step, who))
    fresh = np.diff(who[rows], prepend=-1) != 0
    pause = np.diff(step[rows], prepend=step[rows][:1]) > away_steps
    visit = np.cumsum(fresh | pause) - 1
    first = np.flatnonzero(fresh | pause)
    return Visits(group, rows, visit, who[rows][first], ~fresh[first])


def loop_errors(
    problem: SlamProblem, values: Values, group: int | None = None, away_steps: int = AWAY_STEPS
) -> LoopErrors:
    """Loop errors of an estimate.

    Parameters
    ----------
    values : poses are taken from here, landmarks are not
    group : number of the factors; by default the largest group of sightings

    Raises
    ------
    ModelError
        also where one sighting alone does not place its landmark.
    DataError
        where a pose is missing.
    """
    number = largest_group(problem) if group is None else group
    factors = problem.factors[number]
    pose, landmark = _slots(problem, factors)
    visits = visits_of(problem, number, away_steps)
    index = np.asarray(factors.index)[visits.rows]
    known: list[Array | None] = [None, None]
    known[pose] = values.at(factors.slots[pose], index[:, pose])
    places = factors.model.place(landmark, np.asarray(factors.z)[visits.rows], *known)
    count = np.bincount(visits.visit)
    mean = np.stack([np.bincount(visits.visit, column) / count for column in places.T], axis=1)
    again = np.flatnonzero(visits.again)
    return LoopErrors(visits.landmark[again], np.linalg.norm(mean[again] - mean[again - 1], axis=1))


def without_visits(
    problem: SlamProblem, every: int, group: int | None = None, away_steps: int = AWAY_STEPS
) -> tuple[SlamProblem, Factors]:
    """The problem without one revisit in `every`, and the sightings of those that were kept back.

    First visits all stay, so that each landmark is still on the map.
    """
    number = largest_group(problem) if group is None else group
    visits = visits_of(problem, number, away_steps)
    kept_back = np.flatnonzero(visits.again)[every - 1 :: every]
    out = visits.rows[np.isin(visits.visit, kept_back)]
    factors = problem.factors[number]
    inside = np.ones(len(factors), dtype=bool)
    inside[out] = False
    groups = list(problem.factors)
    groups[number] = chosen(factors, np.flatnonzero(inside))
    return replace(problem, factors=tuple(groups)), chosen(factors, np.sort(out))


def chosen(factors: Factors, rows: Ints) -> Factors:
    """Some measurements of a group."""
    noise = np.asarray(factors.noise_cov)
    return replace(
        factors,
        index=np.asarray(factors.index)[rows],
        z=np.asarray(factors.z)[rows],
        noise_cov=noise[rows] if noise.ndim == 3 else noise,
        step=None if factors.step is None else np.asarray(factors.step)[rows],
    )


def largest_group(problem: SlamProblem) -> int:
    """Number of the largest group of sightings; raises `ModelError` where there is none."""
    groups = [number for number, factors in enumerate(problem.factors) if _joins(problem, factors)]
    if not groups:
        msg = "loop errors need sightings of landmarks from poses; this problem has no such factors"
        raise ModelError(msg)
    return max(groups, key=lambda number: len(problem.factors[number]))


def _joins(problem: SlamProblem, factors: Factors) -> bool:
    """Whether a group joins one pose that moves with one landmark that does not."""
    moving = [slot in problem.moving for slot in factors.slots]
    return len(moving) == 2 and sum(moving) == 1 and factors.unknown is None


def _slots(problem: SlamProblem, factors: Factors) -> tuple[int, int]:
    """Which slot is the pose, which the landmark."""
    if not _joins(problem, factors):
        msg = (
            "loop errors are of landmarks with known ids, each seen from one pose; "
            f"{factors.name or 'a group'} joins {', '.join(factors.slots)}"
        )
        raise ModelError(msg)
    pose = 0 if factors.slots[0] in problem.moving else 1
    return pose, 1 - pose
