"""Where the right camera is to the left one, from pairs that may disagree: the pose that most of them back.

Every pair proposes the pose that its own two views of the board give; the proposal that predicts the right
views of the others best, by the median, is taken.  A pair that it does not predict was taken at another
moment, after the rig was bent, or numbers its board from the other end; the last is tried and mended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.camera import Camera
from vision3d.rigid import compose, inverse, transform
from vision3d.stereo.alone import Alone
from vision3d.stereo.view_pairs import ViewPair
from vision3d.views import View

__all__ = ["Consensus", "Disagreement", "consensus_of"]

Array = NDArray[np.float64]

PROPOSALS = 40
"""Pairs that propose, at most."""
FAR, FAR_PX = 6.0, 3.0
"""A pair disagrees whose right view is this many times the median, and px, from where it should be."""
APART_PX = 25.0
"""Where even the best proposal is as wrong as this, by the median, the pairs are of different moments."""
EXCHANGED_RAD, EXCHANGED = 0.1, 0.3
"""Rotation, and share of the baseline, by which an inverted pose may differ from an exchanged pair's."""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """A pair whose two views the rig of the others does not explain.

    Parameters
    ----------
    pair : its number
    name : its name
    rms_px : how far the right view is from where the left one and the rig put it
    exchanged : left and right of this pair are the other way round
    """

    pair: int
    name: str
    rms_px: float
    exchanged: bool

    def __str__(self) -> str:
        if self.exchanged:
            return f"{self.name}: its left and right pictures are exchanged"
        return (
            f"{self.name}: its right view is {self.rms_px:.0f} px from where the other pairs put it; the rig "
            "was bent or turned there, or its pictures are of two moments"
        )


@dataclass(frozen=True, eq=False)
class Consensus:
    """What the pairs agree on.

    Parameters
    ----------
    right_T_left : (7,) the pose
    pairs : as given, but the boards of some renumbered, and those that disagree taken for two moments each
    poses : (V, 7) left_T_board of these
    disagreeing : pairs that the pose does not explain, by their numbers as given
    renumbered : names of pairs whose right view counted the board from another corner
    """

    right_T_left: Array
    pairs: tuple[ViewPair, ...]
    poses: Array
    disagreeing: tuple[Disagreement, ...]
    renumbered: tuple[str, ...]


def consensus_of(left: Alone, right: Alone, pairs: Sequence[ViewPair]) -> Consensus:
    """Find the pose that most pairs agree on.

    Parameters
    ----------
    left, right : each camera by itself
    pairs : of views

    Raises
    ------
    DataError
        where no pair shows the board to both cameras, or where the pairs do not belong together.
    """
    whole = [v for v, pair in enumerate(pairs) if pair.is_whole]
    if not whole:
        raise DataError(
            "no pair shows the board in both images; hold it where the fields of view overlap, or check that "
            "left and right pictures were taken together"
        )
    poses = left.poses, right.poses
    chosen, errors = _best(right.camera, pairs, whole, poses)
    moved, renumbered = list(pairs), []
    middle = float(np.median(errors))
    limit = max(FAR * middle, FAR_PX)
    for k, v in enumerate(whole):
        if errors[k] > limit and (better := _renumbered(right.camera, pairs[v], chosen, poses[0][v], limit)):
            moved[v], errors[k] = better, 0.0
            renumbered.append(pairs[v].name)
    if middle > APART_PX:
        raise DataError(_apart(pairs, whole, middle))
    apart = tuple(
        Disagreement(v, pairs[v].name, float(errors[k]), _exchanged(chosen, poses[0][v], poses[1][v]))
        for k, v in enumerate(whole)
        if errors[k] > limit
    )
    through_right = compose(np.broadcast_to(inverse(chosen), poses[1].shape), poses[1])
    return Consensus(chosen, *_parted(moved, poses[0], through_right, apart), apart, tuple(renumbered))


def _parted(
    pairs: list[ViewPair], by_left: Array, by_right: Array, apart: tuple[Disagreement, ...]
) -> tuple[tuple[ViewPair, ...], Array]:
    """Pairs that disagree as two moments each, and left_T_board of all."""
    parted = {one.pair for one in apart}
    used: list[ViewPair] = []
    poses = []
    for v, pair in enumerate(pairs):
        if v in parted:
            used += pair.halves()
            poses += [by_left[v], by_right[v]]
        else:
            used.append(pair)
            poses.append(by_right[v] if pair.left is None else by_left[v])
    return tuple(used), np.array(poses)


def _best(
    right: Camera, pairs: Sequence[ViewPair], whole: list[int], poses: tuple[Array, Array]
) -> tuple[Array, Array]:
    """The best proposal (7,), and how far it leaves the right view of every whole pair, px."""
    tried = whole[:: max(1, len(whole) // PROPOSALS)]
    best: tuple[float, Array, Array] | None = None
    for v in tried:
        proposal = compose(poses[1][v], inverse(poses[0][v]))
        errors = np.array([_off(right, proposal, poses[0][w], pairs[w].right) for w in whole])
        middle = float(np.median(errors))
        if best is None or middle < best[0]:
            best = middle, proposal, errors
    assert best is not None  # noqa: S101 - there is a whole pair
    # the mean of those that agree says it better than one of them
    agree = [v for v, error in zip(whole, best[2], strict=True) if error <= max(FAR * best[0], FAR_PX)]
    own = compose(poses[1][agree], inverse(poses[0][agree]))
    mean = _mean(own)
    errors = np.array([_off(right, mean, poses[0][w], pairs[w].right) for w in whole])
    return (mean, errors) if float(np.median(errors)) <= best[0] else (best[1], best[2])


def _mean(poses: Array) -> Array:
    """Mean rotation, and median place."""
    # signs of quaternions are free: the largest eigenvector of Σ q q' is their mean (Markley et al. 2007)
    q = poses[:, :4]
    rotation = np.linalg.eigh(q.T @ q)[1][:, -1]
    return np.concatenate([rotation * np.copysign(1.0, rotation[0]), np.median(poses[:, 4:], axis=0)])


def _off(camera: Camera, right_T_left: Array, left_T_board: Array, view: View | None) -> float:
    """RMS distance, px, of a right view from where a rig puts it; large where it cannot be seen at all."""
    assert view is not None  # noqa: S101 - of a whole pair
    pixels = camera.project(transform(compose(right_T_left, left_T_board), view.points))
    squares = np.sum((pixels - view.pixels) ** 2, axis=1)
    reach = float(np.hypot(*camera.size))
    return float(np.sqrt(np.mean(np.where(np.isfinite(squares), np.minimum(squares, reach**2), reach**2))))


def _renumbered(
    right: Camera, pair: ViewPair, right_T_left: Array, left_T_board: Array, limit: float
) -> ViewPair | None:
    """The pair with its right view counted from another corner of the board, where that explains it."""
    view = pair.right
    assert view is not None  # noqa: S101 - of a whole pair
    for order in _symmetries(view.points):
        other = replace(view, pixels=view.pixels[order], sigma_px=view.sigma_px[order])
        if _off(right, right_T_left, left_T_board, other) <= limit:
            return replace(pair, right=other)
    return None


def _symmetries(points: Array) -> list[NDArray[np.int64]]:
    """Orders in which a flat board turned in its plane shows the same points; without the one as it is."""
    at = points[:, :2] - 0.5 * (points[:, :2].min(axis=0) + points[:, :2].max(axis=0))
    step = np.abs(at).max() * 1e-6
    found = []
    for cosine, sine in ((-1, 0), (0, 1), (0, -1)):
        turned = at @ np.array([[cosine, sine], [-sine, cosine]], dtype=np.float64)
        distance = np.abs(turned[:, None] - at[None]).max(axis=2)
        if (distance.min(axis=1) < step).all():
            found.append(np.argmin(distance, axis=1).astype(np.int64))
    return found


def _exchanged(right_T_left: Array, left_T_board: Array, right_T_board: Array) -> bool:
    """Whether a pair's own pose is the inverse of the rig's."""
    own, wanted = compose(right_T_board, inverse(left_T_board)), inverse(right_T_left)
    cosine = min(1.0, abs(float(own[:4] @ wanted[:4])))
    near = np.linalg.norm(own[4:] - wanted[4:]) < EXCHANGED * np.linalg.norm(wanted[4:])
    return bool(2.0 * np.arccos(cosine) < EXCHANGED_RAD and near)


def _apart(pairs: Sequence[ViewPair], whole: list[int], middle: float) -> str:
    names = ", ".join(pairs[v].name for v in whole[:3])
    return (
        f"the {len(whole)} pairs do not belong together: with the best pose of the cameras half of the right "
        f"views are more than {middle:.0f} px from where the left ones put them; are left and right pictures "
        f"paired as they were taken ({names} …), and were both cameras fixed to each other?"
    )
