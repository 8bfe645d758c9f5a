"""What EKF-SLAM keeps of its steps, and the `SlamRun` made of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.history import Innovations, Report, Run
from sequential.slam.arrivals import Reading
from sequential.slam.association import REJECTED
from sequential.slam.estimate import SlamRun, Values
from sequential.slam.joint_belief import JointBelief, Variable
from sequential.slam.problem import SlamProblem

__all__ = ["Record"]

Array = NDArray[np.float64]
Seen = tuple[int, int, Array, Array, bool]


class Record:
    """Beliefs of the newest variables step by step, innovations, associations."""

    def __init__(self, problem: SlamProblem) -> None:
        self.problem = problem
        self.kept: dict[Variable, tuple[Array, Array]] = {}
        self.seen: dict[int, list[Seen]] = {n: [] for n in range(len(problem.factors))}
        self.found = {
            n: np.full(len(group), REJECTED)
            for n, group in enumerate(problem.factors)
            if group.unknown is not None
        }
        self.at = 0
        self.rejected = self.dropped = 0

    def step(self, step: int, belief: JointBelief) -> None:
        """Keep what is believed of the moving variables of this step."""
        self.at = step
        for kind in self.problem.moving:
            if (kind, step) in belief:
                self._keep((kind, step), belief)

    def end(self, belief: JointBelief) -> None:
        """Keep what is believed of everything that does not move."""
        for variable in belief.value:
            if variable[0] not in self.problem.moving:
                self._keep(variable, belief)

    def _keep(self, variable: Variable, belief: JointBelief) -> None:
        at = belief.columns(variable)
        self.kept[variable] = belief.value[variable], belief.cov[at, at].copy()

    def innovation(
        self, group: int, reading: Reading, residual: Array, cov: Array, *, accepted: bool
    ) -> None:
        """Keep a reading beside what was expected of it."""
        self.rejected += not accepted
        self.seen[group].append((self.at_time(self.at), reading.row, residual, cov, accepted))

    def associate(self, reading: Reading, known: Reading | None) -> None:
        """Keep which landmark a reading was taken for; None where it was rejected."""
        slot = self.problem.factors[reading.group].unknown or 0
        self.found[reading.group][reading.row] = REJECTED if known is None else known.variables[slot][1]
        self.rejected += known is None

    def at_time(self, step: int) -> int:
        """Time of a step in ns; its number where the problem has no times."""
        return step if self.problem.t is None else int(self.problem.t[step])

    def run(self, report: Report) -> SlamRun:
        """Everything, as a result."""
        index, rows, covs = {}, {}, {}
        for kind in self.problem.kinds:
            members = sorted(v for v in self.kept if v[0] == kind)
            if members:
                index[kind] = np.array([i for _, i in members], dtype=np.int64)
                rows[kind] = np.stack([self.kept[v][0] for v in members])
                covs[kind] = np.stack([self.kept[v][1] for v in members])
        first = self.problem.moving[0]
        t = np.array([self.at_time(int(k)) for k in index[first]], dtype=np.int64)
        innovations = {str(n): _stacked(one) for n, one in self.seen.items() if one}
        online = Run(
            t,
            rows[first].copy(),
            covs[first].copy(),
            self.problem.kinds[first],
            innovations,
            float("nan"),
            report,
        )
        found = np.concatenate(list(self.found.values())).astype(np.int64) if self.found else None
        values = Values(index, rows)
        return SlamRun(values, covs, dict(self.problem.kinds), report, online, innovations, found)


def _stacked(seen: list[Seen]) -> Innovations:
    t, row, residual, cov, accepted = zip(*seen, strict=True)
    return Innovations(
        np.array(t, dtype=np.int64),
        np.array(row, dtype=np.int64),
        np.stack(residual),
        np.stack(cov),
        np.array(accepted),
    )
