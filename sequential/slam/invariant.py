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
from sequential.slam.gauge import FRAME, POINT, VECTOR, directions, rigid_of, world_roles
from sequential.slam.joint_belief import JointBelief, Variable
from sequential.slam.models.displacement import into_world
from sequential.slam.problem import SlamProblem

__all__ = ["Frame"]

Array = NDArray[np.float64]


class Frame:
    """Moves a joint belief as one element of the group."""

    def __init__(self, problem: SlamProblem) -> None:
        self.roles = world_roles(problem)
        self.kind, self.rigid = rigid_of(problem, self.roles)
        turning = slice(2, 3) if isinstance(self.rigid, SE2) else slice(0, 3)
        self.rotation = np.arange(self.rigid.dim)[turning]
        self.shift = np.setdiff1d(np.arange(self.rigid.dim), self.rotation)

    def move(self, belief: JointBelief, step: Array, newest: int) -> None:
        """Apply a correction (used,), given in the charts, and carry the covariance along."""
        pose, rigid = (self.kind, newest), self.rigid
        # Ad(x): a step of the body seen from the world
        to_world = np.linalg.inv(directions(rigid, FRAME, belief.value[pose], rigid.dim))[self.rotation]
        at_pose = belief.columns(pose)
        turn = to_world @ step[at_pose]
        carried = np.eye(belief.used)
        moved: dict[Variable, Array] = {}
        for kind, members, at in belief.by_kind():
            role, manifold = self.roles[kind], belief.kinds[kind]
            values = np.stack([belief.value[v] for v in members])
            if role in (POINT, VECTOR):
                turning = directions(rigid, role, values, manifold.dim)[..., self.rotation]
                new = self._carry(values, step[at] - turning @ turn, turn)
                further = directions(rigid, role, new, manifold.dim)[..., self.rotation] - turning
                carried[at.ravel(), at_pose] = (further @ to_world).reshape(-1, rigid.dim)
            else:
                new = manifold.retract(values, step[at])
                if role == FRAME:
                    carried[at[:, :, None], at[:, None, :]] = rigid.transport(values, new)[0]
            moved.update(zip(members, new, strict=True))
        belief.value.update(moved)
        belief.cov[...] = carried @ belief.cov @ carried.T

    def _carry(self, values: Array, shift: Array, turn: Array) -> Array:
        """Points (N, axes), each moved by the exponential of the common turn and its own shift."""
        twist = np.empty((len(values), self.rigid.dim))
        twist[:, self.rotation], twist[:, self.shift] = turn, shift
        motion = self.rigid.retract(
            np.broadcast_to(self.rigid.identity(), (len(values), self.rigid.size)), twist
        )
        return into_world(self.rigid, motion, values)
