"""The right-invariant error of pose and map, kept in the ordinary charts of the variables.

With the error of the group SE_{1+L}, a motion of the whole world is the same direction at every estimate, so
that an update cannot turn it into one that seems to be observed.  In the charts of the variables that error
is ordinary between updates; an update moves pose and map by one exponential, and carries the covariance to
the charts at the new estimate.  Barrau, Bonnabel 2015, "An EKF-SLAM algorithm with consistency properties".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE2
from sequential.slam.gauge import FRAME, POINT, VECTOR, act, directions, rigid_of, world_roles
from sequential.slam.joint_belief import JointBelief
from sequential.slam.problem import SlamProblem

__all__ = ["Frame"]

Array = NDArray[np.float64]


class Frame:
    """Moves a joint belief as one element of the group."""

    def __init__(self, problem: SlamProblem) -> None:
        self.roles = world_roles(problem)
        self.kind, self.rigid = rigid_of(problem, self.roles)
        self.rotation = slice(2, 3) if isinstance(self.rigid, SE2) else slice(0, 3)

    def move(self, belief: JointBelief, step: Array, newest: int) -> None:
        """Apply a correction (used,), given in the charts, and carry the covariance along."""
        pose = self.kind, newest
        rigid, origin = self.rigid, self.rigid.identity()
        # Ad(x): a step of the body seen from the world
        to_world = np.linalg.inv(directions(rigid, FRAME, belief.value[pose], rigid.dim))[self.rotation]
        turn = to_world @ step[belief.columns(pose)]
        carried = np.eye(belief.used)
        new = {}
        for variable, value in belief.value.items():
            role, at = self.roles[variable[0]], belief.columns(variable)
            manifold = belief.kinds[variable[0]]
            if role not in (POINT, VECTOR):
                new[variable] = manifold.retract(value, step[at])
                if role == FRAME:
                    carried[at, at] = rigid.transport(value, new[variable])[0]
                continue
            turning = directions(rigid, role, value, manifold.dim)[:, self.rotation]
            twist = np.zeros(rigid.dim)
            twist[self.rotation] = turn
            shift = ~np.isin(np.arange(rigid.dim), np.arange(rigid.dim)[self.rotation])
            twist[shift] = step[at] - turning @ turn
            new[variable] = act(rigid, rigid.retract(origin, twist), POINT, value)
            further = directions(rigid, role, new[variable], manifold.dim)[:, self.rotation] - turning
            carried[at, belief.columns(pose)] = further @ to_world
        belief.value.update(new)
        belief.cov[...] = carried @ belief.cov @ carried.T
