"""Both cameras, their pose and the board's poses in one arrow of normal equations.

Unknowns are θ = (η, left parameters, right parameters, bend of the board) and the poses of the board in the
left camera, ξ_v.  The kernel of one camera (`vision3d.kernels.adjustment`) is asked twice: the right camera
sees the board at ``right_T_left Exp(η) left_T_board Exp(ξ_v)``, which is ``right_T_board Exp(Ad η + ξ_v)``
with ``Ad = Ad(left_T_board⁻¹)``, so its blocks need that matrix only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.manifold import SE3
from vision3d.calibrate.adjustment import Unknowns, linearize, prior_of
from vision3d.calibrate.descent import ITERATIONS, SETTLED, Blocks, Solution, descend
from vision3d.calibrate.problem import Problem
from vision3d.rigid import compose
from vision3d.stereo.view_pairs import ViewPair
from vision3d.views import View

__all__ = ["JointProblem", "JointUnknowns", "adjust_jointly", "linearize_jointly"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Noise = tuple[tuple[float, float], tuple[float, float]]
"""Floor, px, and scale of the corners of the left and of the right camera."""


@dataclass(frozen=True, eq=False)
class JointUnknowns:
    """What the adjustment moves; `poses` (V, 7) are left_T_board."""

    lenses: tuple[str, str]
    right_T_left: Array
    left: Array
    right: Array
    warp: Array
    poses: Array

    @property
    def count(self) -> int:
        """Length of θ."""
        return 6 + len(self.left) + len(self.right) + 2

    def moved(self, step: Array, pose_steps: Array) -> JointUnknowns:
        """After a step of θ and one (V, 6) of the poses."""
        p = 6 + len(self.left)
        return replace(
            self,
            right_T_left=SE3().retract(self.right_T_left, step[:6]),
            left=self.left + step[6:p],
            right=self.right + step[p:-2],
            warp=self.warp + step[-2:],
            poses=SE3().retract(self.poses, pose_steps),
        )

    @property
    def poses_right(self) -> Array:
        """(V, 7) right_T_board."""
        return compose(np.broadcast_to(self.right_T_left, self.poses.shape), self.poses)


@dataclass(frozen=True, eq=False)
class JointProblem:
    """Corners of V pairs: first those of all left images, then those of all right ones, M in all.

    Attributes
    ----------
    pairs : tuple[ViewPair, ...]
        What was seen.
    left, right : Problem
        Corners of one camera; a pair that it did not see has none.
    starts : NDArray[np.int64]
        (P + 1,) of the P images that show the board, left ones first.
    pictures : tuple[tuple[int, int], ...]
        Side (0, 1) and pair of each image.
    """

    pairs: tuple[ViewPair, ...]
    left: Problem
    right: Problem
    starts: NDArray[np.int64]
    pictures: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, pairs: Sequence[ViewPair], noise: Noise = ((0.0, 1.0), (0.0, 1.0))) -> JointProblem:
        """Lay out the corners; `noise` is the floor below their sigmas, and the scale of both, by camera."""
        sides = ([pair.left for pair in pairs], [pair.right for pair in pairs])
        bend = _reach([view for side in sides for view in side if view is not None])
        left, right = (_laid_out(side, bend, *own) for side, own in zip(sides, noise, strict=True))
        counts, pictures = [], []
        for side, views in enumerate(sides):
            for v, view in enumerate(views):
                if view is not None:
                    counts.append(len(view))
                    pictures.append((side, v))
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        return cls(tuple(pairs), left, right, starts, tuple(pictures))

    @property
    def sigma_px(self) -> Array:
        """(M,), standard deviation of every corner, per axis."""
        return np.concatenate([self.left.sigma_px, self.right.sigma_px])

    def stated(self, side: int) -> Array:
        """What the views of one camera (0 left, 1 right) state of their corners, px."""
        views = [pair.left if side == 0 else pair.right for pair in self.pairs]
        return np.concatenate([np.zeros(0), *(view.sigma_px for view in views if view is not None)])

    @property
    def count(self) -> int:
        """How many images there are."""
        return len(self.pictures)

    @property
    def owner(self) -> NDArray[np.int64]:
        """Number of the image of every corner, (M,)."""
        return np.repeat(np.arange(self.count), np.diff(self.starts))

    @property
    def pair_of(self) -> NDArray[np.int64]:
        """Number of the pair of every corner, (M,)."""
        return np.array([pair for _, pair in self.pictures], dtype=np.int64)[self.owner]

    @property
    def is_right(self) -> Mask:
        """Which corners the right camera saw, (M,)."""
        return np.arange(len(self.sigma_px)) >= len(self.left.points)

    def split(self, values: Array) -> tuple[Array, ...]:
        """Cut an array (M, ...) into one array an image."""
        return tuple(np.split(values, self.starts[1:-1]))

    def only(self, chosen: Sequence[int] | NDArray[np.int64]) -> JointProblem:
        """The same with the chosen pairs alone."""
        own = self.left.scale, self.right.scale
        noise = ((self.left.floor_px, own[0]), (self.right.floor_px, own[1]))
        return JointProblem.of([self.pairs[int(v)] for v in chosen], noise)


def linearize_jointly(problem: JointProblem, at: JointUnknowns, weights: Array) -> Blocks:
    """Residuals (M, 2) and normal equations of all pairs, weighted by `weights` (M,)."""
    m, p, q = len(problem.left.points), len(at.left), len(at.right)
    one = linearize(problem.left, Unknowns(at.lenses[0], at.left, at.warp, at.poses), weights[:m])
    two = linearize(problem.right, Unknowns(at.lenses[1], at.right, at.warp, at.poses_right), weights[m:])
    # Ad(left_T_board⁻¹)
    adjoint, _ = SE3().transport(np.broadcast_to(SE3().identity(), at.poses.shape), at.poses)
    own = np.r_[6 : 6 + p, at.count - 2 : at.count]
    # the right camera's blocks by (η, its parameters, bend): η comes in as its pose does
    whole = np.r_[0:6, 6 + p : 6 + p + q, at.count - 2 : at.count]
    V = len(at.poses)
    U, W, a = np.zeros((V, at.count, at.count)), np.zeros((V, at.count, 6)), np.zeros((V, at.count))
    U[np.ix_(range(V), own, own)] += one.U
    W[:, own] += one.W
    a[:, own] += one.a
    turned = two.T @ adjoint
    by_pose = two.W @ adjoint
    U[np.ix_(range(V), whole, whole)] += np.block(
        [[adjoint.transpose(0, 2, 1) @ turned, by_pose.transpose(0, 2, 1)], [by_pose, two.U]]
    )
    W[:, whole] += np.concatenate([turned.transpose(0, 2, 1), two.W], axis=1)
    a[:, whole] += np.concatenate([np.einsum("vji,vj->vi", adjoint, two.b), two.a], axis=1)
    prior = np.concatenate([np.zeros(6), prior_of(at.lenses[0])[:-2], prior_of(at.lenses[1])])
    pull = -prior * np.concatenate([np.zeros(6), at.left, at.right, at.warp])
    residuals = np.concatenate([one.residuals, two.residuals])
    return Blocks(residuals, U, W, one.T + two.T, a, one.b + two.b, one.lost + two.lost, prior, pull)


def adjust_jointly(
    problem: JointProblem,
    unknowns: JointUnknowns,
    weights: Array,
    free: Mask,
    *,
    iterations: int = ITERATIONS,
    settled: float = SETTLED,
) -> Solution[JointUnknowns]:
    """Minimise the weighted squares of the residuals; `free` (θ,) says what moves besides the poses."""

    def linearized(at: JointUnknowns) -> Blocks:
        return linearize_jointly(problem, at, weights)

    return descend(
        linearized, JointUnknowns.moved, unknowns, weights, free, iterations=iterations, settled=settled
    )


def _reach(views: Sequence[View]) -> tuple[Array, Array]:
    """Middle and half extent of what was seen of the board, (2,) each."""
    points = np.concatenate([view.points[:, :2] for view in views])
    low, high = points.min(axis=0), points.max(axis=0)
    return 0.5 * (low + high), np.where(high > low, 0.5 * (high - low), 1.0)


def _laid_out(
    views: Sequence[View | None], reach: tuple[Array, Array], floor_px: float, scale: float
) -> Problem:
    """Corners of one camera, with the bend of the whole board."""
    seen = [view for view in views if view is not None]
    counts = [0 if view is None else len(view) for view in views]
    points = np.concatenate([np.zeros((0, 3)), *(view.points for view in seen)])
    stated = np.concatenate([np.zeros(0), *(view.sigma_px for view in seen)])
    return Problem(
        np.ascontiguousarray(points),
        np.ascontiguousarray(np.concatenate([np.zeros((0, 2)), *(view.pixels for view in seen)])),
        scale * np.hypot(stated, floor_px),
        np.ascontiguousarray(1.0 - ((points[:, :2] - reach[0]) / reach[1]) ** 2),
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        seen[0].size if seen else (1, 1),
        floor_px,
        scale,
    )
