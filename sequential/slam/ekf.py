"""EKF-SLAM: one joint Gaussian of the newest pose, the map and whatever does not move."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from sequential.errors import ModelError
from sequential.slam.association import Association
from sequential.slam.beginnings import needs_several
from sequential.slam.ekf_run import FilterRun
from sequential.slam.estimate import SlamRun, Values
from sequential.slam.joint_belief import JointBelief
from sequential.slam.problem import SlamProblem

__all__ = ["LINEARISATIONS", "EkfSlam", "filtered_start"]

WINDOW = 10  # steps that stay where landmarks need several views
LINEARISATIONS = ("standard", "first_estimates", "invariant")


@dataclass(frozen=True, slots=True)
class EkfSlam:
    """The extended Kalman filter over a state that grows with the map.

    A step's measurements are used in this order: one that joins the newest pose to what is known places it
    (and carries its noise exactly, by the implicit function of the measurement); those between known
    variables make one joint update; those to a new landmark add it.  Poses of earlier steps are dropped.
    Smith, Self, Cheeseman 1990, "Estimating uncertain spatial relationships in robotics".

    Parameters
    ----------
    linearisation : where Jacobians are taken.
        "standard": at the estimate.
        "first_estimates": at the first estimate of each variable, so that the linearised system keeps the
        directions that nothing observes (Huang, Mourikis, Roumeliotis 2010, FEJ-EKF).
        "invariant": the error is that of the group of pose and map (right-invariant, SE_{1+L}), in which
        those directions do not depend on the estimate (Barrau, Bonnabel 2015, "An EKF-SLAM algorithm with
        consistency properties")
    association : for measurements that come without an id
    keep : how many steps before the newest stay in the state, for measurements that join them and for
        landmarks that need several views; None keeps all.  Where no measurement alone places a landmark, as
        with one camera, 0 means 10
    watch : called after every step with its number and the joint belief, which it must not change
    """

    linearisation: str = "standard"
    association: Association = field(default_factory=Association)
    keep: int | None = 0
    watch: Callable[[int, JointBelief], None] | None = None

    def __post_init__(self) -> None:
        if self.linearisation not in LINEARISATIONS:
            msg = f"linearisation is one of {', '.join(LINEARISATIONS)}, got {self.linearisation!r}"
            raise ModelError(msg)
        if self.keep is not None and self.keep < 0:
            msg = f"keep counts steps that stay in the state: 0 or more, or None for all; got {self.keep}"
            raise ModelError(msg)

    @property
    def name(self) -> str:
        """Short name, with the linearisation behind it where it is not the usual one."""
        return "ekf_slam" if self.linearisation == "standard" else f"ekf_slam ({self.linearisation})"

    def solve(self, problem: SlamProblem) -> SlamRun:
        """Filter all measurements in the order of their steps.

        Returns
        -------
        SlamRun
            poses as believed when they were newest, everything else as believed at the end

        Raises
        ------
        ModelError
            where a measurement joins a pose that has left the state, or does not place a pose.
        UnderConstrainedError
            where nothing says where a pose is.
        """
        began = time.perf_counter()
        keep = WINDOW if self.keep == 0 and needs_several(problem) else self.keep
        run = FilterRun(problem, self.linearisation, self.association, keep)
        for step in run.steps():
            if self.watch is not None:
                self.watch(step, run.belief)
        return run.result(self.name, began)


def filtered_start(problem: SlamProblem) -> Values:
    """Values for a graph to begin from: an invariant filter's, which errs less far than dead reckoning."""
    return EkfSlam("invariant").solve(problem).values
