"""Why a SLAM filter claims to know what nobody told it: what its Jacobians, taken together, can see.

Measurements between poses and landmarks leave the world free to be moved and turned as a whole.  Jacobians
of all of them, taken at one point, leave it free too: 3 directions in the plane, 6 in space.  A filter takes
each at the estimate of its own step, and as estimates jump at every update, these do not fit together: a turn
of the world seems to be seen.  The information so gained is spurious, and the covariance shrinks by it.
Huang, Mourikis, Roumeliotis 2010, "Observability-based rules for designing consistent EKF SLAM estimators".
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sequential.slam.ekf import EkfSlam
from sequential.slam.estimate import SlamRun
from sequential.slam.gauge import directions, rigid_of, world_roles
from sequential.slam.joint_belief import JointBelief
from sequential.slam.problem import SlamProblem

__all__ = ["HeadingClaim", "WorldWatch", "claimed_heading", "free_directions"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

HONEST = 0.01  # a claim that falls by less is rounding, or curvature
ROUNDING = 1e-9  # share of the largest singular value below which one is rounding


@dataclass(slots=True)
class WorldWatch:
    """Watches an `EkfSlam` and keeps how surely it claims to know where its whole world stands.

    At each step the joint covariance P of pose and map implies an information Nᵀ P⁻¹ N about moving all of it
    by one rigid motion, N being how every variable answers.  Only a prior or an absolute sensor tells
    anything about that: from one step to the next it may fall, but never rise.

    Parameters
    ----------
    problem : what is filtered
    every : steps between two looks
    at_first : take N where the variables were placed, as a filter with first-estimates Jacobians does
    """

    problem: SlamProblem
    every: int = 1
    at_first: bool = False
    steps: list[int] = field(default_factory=list)
    information: list[Array] = field(default_factory=list)
    _roles: dict[str, str] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._roles = world_roles(self.problem)

    def __call__(self, step: int, belief: JointBelief) -> None:
        """Look at the belief after a step."""
        if step % self.every:
            return
        _, rigid = rigid_of(self.problem, self._roles)
        moved = np.zeros((belief.used, rigid.dim))
        for kind, members, at in belief.by_kind():
            source = belief.first if self.at_first else belief.value
            values = np.stack([source[v] for v in members])
            moved[at] = directions(rigid, self._roles[kind], values, belief.kinds[kind].dim)
        held = np.flatnonzero(np.diag(belief.cov) > 0.0)
        inside = belief.cov[np.ix_(held, held)]
        self.steps.append(step)
        self.information.append(moved[held].T @ np.linalg.solve(inside, moved[held]))

    def heading_sigma(self) -> Array:
        """(K,) rad, the least that the filter claims to know the heading of its world to (SE(2) problems).

        Its place is left free: the Schur complement of the turn.
        """
        found = []
        for information in self.information:
            across = information[2, :2] @ np.linalg.solve(information[:2, :2], information[:2, 2])
            found.append(1.0 / np.sqrt(information[2, 2] - across))
        return np.array(found)


@dataclass(frozen=True, slots=True, eq=False)
class HeadingClaim:
    """How surely a filter claims to know the heading of its whole world, in the plane.

    Parameters
    ----------
    steps : (K,) at which was looked
    sigma : (K,) rad claimed after each; of an honest filter it never falls
    """

    steps: Ints
    sigma: Array

    @property
    def lost(self) -> float:
        """By what factor the claim fell below an earlier one, at worst: 1 for an honest filter."""
        return float((np.maximum.accumulate(self.sigma) / self.sigma).max())

    def __str__(self) -> str:
        """One sentence."""
        worst = int(np.argmax(np.maximum.accumulate(self.sigma) / self.sigma))
        widest = float(self.sigma[: worst + 1].max())
        if self.lost < 1.0 + HONEST:
            return (
                "the heading of the world is never claimed better than before: "
                f"{self.sigma[-1]:.3g} rad at the end"
            )
        return (
            f"nothing measures the heading of the world as a whole, yet the filter claims it to {widest:.3g} "
            f"rad and later to {self.sigma[worst]:.3g} rad, {self.lost:.2f} times better: its Jacobians, "
            "taken at estimates that jump, see a turn that no measurement shows"
        )


def claimed_heading(problem: SlamProblem, estimator: EkfSlam | None = None, every: int = 1) -> HeadingClaim:
    """Filter a planar problem and say how surely the heading of the whole is claimed.

    Parameters
    ----------
    estimator : the filter; EKF-SLAM with its usual linearisation unless given
    every : steps between two looks

    Raises
    ------
    ModelError
        where the problem has no world that is free to be moved, see `world_roles`.
    """
    estimator = estimator or EkfSlam()
    watch = WorldWatch(problem, every, at_first=estimator.linearisation == "first_estimates")
    replace(estimator, watch=watch).solve(problem)
    return HeadingClaim(np.array(watch.steps, dtype=np.int64), watch.heading_sigma())


def free_directions(problem: SlamProblem, run: SlamRun) -> int:
    """Dimension of what the measurements between variables leave free, all Jacobians taken at one point.

    Parameters
    ----------
    run : gives the point; poses and landmarks that it does not hold are left out with their measurements

    Notes
    -----
    A dense singular value decomposition: for some hundred variables.
    """
    kinds = [kind for kind in problem.kinds if kind in run.values.index]
    width = {kind: len(run.values.index[kind]) * problem.kinds[kind].dim for kind in kinds}
    start = dict(zip(kinds, np.cumsum([0, *width.values()]).tolist(), strict=False))
    stacked = []
    for group in problem.factors:
        if len(group.slots) < 2 or not len(group) or group.unknown is not None:
            continue
        index = np.asarray(group.index)
        held = np.all([run.values.has(slot, index[:, k]) for k, slot in enumerate(group.slots)], axis=0)
        index, z = index[held], np.asarray(group.z)[held]
        values = [run.values.at(slot, index[:, k]) for k, slot in enumerate(group.slots)]
        white = np.linalg.inv(np.linalg.cholesky(group.covs()[held]))
        rows = np.zeros((len(z), group.model.measured.dim, sum(width.values())))
        which = np.arange(len(z))[:, None, None], np.arange(rows.shape[1])[None, :, None]
        jacobians = group.model.jacobians(z, *values)
        for k, (slot, jacobian) in enumerate(zip(group.slots, jacobians, strict=True)):
            d = problem.kinds[slot].dim
            number = np.searchsorted(run.values.index[slot], index[:, k])
            columns = (start[slot] + d * number)[:, None] + np.arange(d)
            np.add.at(rows, (*which, columns[:, None, :]), white @ jacobian)
        stacked.append(rows.reshape(-1, rows.shape[2]))
    sizes = np.linalg.svd(np.concatenate(stacked), compute_uv=False)
    return int(sum(width.values()) - np.count_nonzero(sizes > ROUNDING * sizes[0]))
