"""One pass of EKF-SLAM over a problem: what happens at each step."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, UnderConstrainedError
from sequential.evaluate.consistency import chi2_quantile
from sequential.history import Report
from sequential.slam.arrivals import UNKNOWN, Reading, arrivals, linearised
from sequential.slam.association import Association
from sequential.slam.ekf_record import Record
from sequential.slam.estimate import SlamRun
from sequential.slam.identify import Identifier, nameless
from sequential.slam.invariant import Frame
from sequential.slam.joint_belief import JointBelief, Variable
from sequential.slam.placing_jointly import VIEWS, place_by_several, place_jointly
from sequential.slam.problem import Factors, SlamProblem
from sequential.slam.robust_weight import weight

__all__ = ["FilterRun"]

Array = NDArray[np.float64]


class FilterRun:
    """The belief as it goes through the steps, and what is kept of it."""

    def __init__(
        self, problem: SlamProblem, linearisation: str, association: Association, keep: int | None
    ) -> None:
        self.problem, self.keep = problem, keep
        self.identifier = Identifier(problem, association)
        self.belief = JointBelief(problem.kinds)
        self.record = Record(problem)
        self.frame = Frame(problem) if linearisation == "invariant" else None
        self.about = self.belief.first if linearisation == "first_estimates" else self.belief.value
        self.newest = -1
        self.waiting: list[Reading] = []
        self.again: dict[Variable, int] = {}  # readings that a new attempt to place a variable waits for

    def steps(self) -> Iterator[int]:
        """Go through all steps; gives the number of each when it is done."""
        for step, readings in arrivals(self.problem):
            self.newest = step
            self._refuse_gone(readings)
            left = self._place([*self.waiting, *readings], moving=True)
            self._require_placed(left)
            left = self._associated(left)
            while True:
                self._update([r for r in left if self._known(r)])
                rest = [r for r in left if not self._known(r)]
                left = self._place(rest, moving=False)
                if len(left) == len(rest):
                    break
            self._keep_waiting(left)
            self.record.step(step, self.belief)
            self._forget(step)
            yield step

    def result(self, name: str, began: float) -> SlamRun:
        """All variables, as last believed."""
        self.record.end(self.belief)
        details = {"waiting": float(len(self.waiting)), "dropped": float(self.record.dropped)}
        report = Report(
            name,
            iterations=1,
            seconds=time.perf_counter() - began,
            rejected=self.record.rejected,
            message=self._said(),
            details=details,
        )
        return self.record.run(report)

    def _said(self) -> str:
        unused = len(self.waiting) + self.record.dropped
        if not unused:
            return ""
        return (
            f"{unused} readings were not used: alone they do not say where their landmark is, and no other "
            "view of it came while their pose was in the state; keep more poses with keep=…"
        )

    def _known(self, reading: Reading) -> bool:
        return all(variable in self.belief for variable in reading.variables)

    def _refuse_gone(self, readings: Sequence[Reading]) -> None:
        """Refuse readings of poses that have left the state."""
        if self.keep is None:
            return
        oldest = self.newest - max(self.keep, 1)
        for group, row, variables in readings:
            for kind, index in variables:
                if (
                    kind in self.problem.moving
                    and UNKNOWN != index < oldest
                    and (kind, index) not in self.belief
                ):
                    who = self.problem.factors[group]
                    msg = (
                        f"measurement {row} of {who.name or type(who.model).__name__} arrives at step "
                        f"{self.newest} and joins {kind}{index}, which EKF-SLAM has left behind: it keeps "
                        f"the newest pose and {self.keep} before it; use a graph for such a loop closure, or "
                        "keep=None to hold every pose in the state"
                    )
                    raise ModelError(msg)

    def _place(self, readings: Sequence[Reading], *, moving: bool) -> list[Reading]:
        """Add variables that one reading each determines; returns the readings that are left."""
        left, again = list(readings), True
        while again:
            again = False
            for reading in list(left):
                missing = [v for v in reading.variables if v not in self.belief]
                if len(missing) != 1 or (missing[0][0] in self.problem.moving) != moving:
                    continue
                if missing[0][1] == UNKNOWN:
                    continue
                if place_jointly(self.belief, self.problem, reading, missing[0], self.about, self._move):
                    left.remove(reading)
                    again = True
        return left if moving else self._place_by_several(left)

    def _place_by_several(self, left: list[Reading]) -> list[Reading]:
        """Add variables that no reading determines alone, where one came now and several do."""
        together: dict[Variable, list[Reading]] = {}
        for reading in left:
            missing = [v for v in reading.variables if v not in self.belief]
            if len(missing) == 1 and missing[0][1] != UNKNOWN:
                together.setdefault(missing[0], []).append(reading)
        used: list[Reading] = []
        for variable, own in together.items():
            if len(own) < self.again.get(variable, VIEWS):
                continue
            if place_by_several(self.belief, self.problem, own, variable, self.about, self._move):
                used += own
            else:
                self.again[variable] = len(own) + 1 + len(own) // 4
        gone = set(used)
        return [reading for reading in left if reading not in gone]

    def _require_placed(self, left: Sequence[Reading]) -> None:
        """Every reading's newest pose must be somewhere by now."""
        for reading in left:
            for kind, index in reading.variables:
                if kind in self.problem.moving and index == self.newest and (kind, index) not in self.belief:
                    msg = (
                        f"nothing says where {kind}{index} is: no prior, odometry or other single "
                        "measurement determines it from what is known at its step; add one"
                    )
                    raise UnderConstrainedError(msg)

    def _update(self, readings: Sequence[Reading]) -> None:
        """One joint update by all readings between known variables, those outside their gates left out."""
        parts = []
        for number in sorted({reading.group for reading in readings}):
            group, own = self.problem.factors[number], [r for r in readings if r.group == number]
            parts += self._gated(number, group, own)
        if not parts:
            return
        at = np.unique(np.concatenate([columns for columns, *_ in parts]))
        total = sum(len(error) for _, _, error, _ in parts)
        jacobian, residual, noise = np.zeros((total, len(at))), np.empty(total), np.zeros((total, total))
        row = 0
        for columns, own_jacobian, error, own_noise in parts:
            rows = slice(row, row + len(error))
            jacobian[rows, np.searchsorted(at, columns)] = own_jacobian
            residual[rows], noise[rows, rows] = -error, own_noise
            row = rows.stop
        self._move(self.belief.update(at, jacobian, residual, noise))

    def _move(self, step: Array) -> None:
        if self.frame is None:
            self.belief.move(step)
        else:
            self.frame.move(self.belief, step, self.newest)

    def _gated(
        self, number: int, group: Factors, readings: Sequence[Reading]
    ) -> list[tuple[NDArray[np.int64], Array, Array, Array]]:
        """Columns, Jacobian, error and noise of each reading that is used; innovations are recorded."""
        rows = linearised(group, readings, self.belief.value, self.about)
        limit = np.inf if group.gate is None else chi2_quantile(group.gate, group.model.measured.dim)
        used = []
        for n, reading in enumerate(readings):
            at = self.belief.columns_of(reading.variables)
            jacobian = np.concatenate([j[n] for j in rows.jacobians], axis=1)
            spread = jacobian @ self.belief.cov[np.ix_(at, at)] @ jacobian.T + rows.noise[n]
            error, noise = rows.error[n], rows.noise[n]
            squared = float(error @ np.linalg.solve(spread, error))
            accepted = squared <= limit
            self.record.innovation(number, reading, -error, spread, accepted=accepted)
            if not accepted:
                continue
            if group.loss is not None:
                noise = noise / weight(group.loss, squared / len(error))
            used.append((at, jacobian, error, noise))
        return used

    def _associated(self, readings: Sequence[Reading]) -> list[Reading]:
        """The readings with ids: those that came without one get theirs, or are rejected."""
        done = [r for r in readings if not nameless(r)]
        for reading, known in self.identifier.name(
            [r for r in readings if nameless(r)], self.belief, self.about
        ):
            self.record.associate(reading, known)
            if known is not None:
                done.append(known)
        return done

    def _keep_waiting(self, left: Sequence[Reading]) -> None:
        """Readings that place nothing yet wait for others, as long as their poses stay."""
        self.waiting = list(left)

    def _forget(self, step: int) -> None:
        """Drop poses that are too old, and readings that waited for them."""
        if self.keep is None:
            return
        for variable in [v for v in self.belief.value if v[0] in self.problem.moving]:
            if variable[1] < step - self.keep:
                self.belief.drop(variable)
        gone = [
            r
            for r in self.waiting
            if any(k in self.problem.moving and i < step - self.keep + 1 for k, i in r.variables)
        ]
        self.record.dropped += len(gone)
        left = set(gone)
        self.waiting = [r for r in self.waiting if r not in left]
