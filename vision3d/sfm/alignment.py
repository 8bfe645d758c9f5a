"""A model laid on the truth: the similarity that brings its cameras there, and what is left.

Structure from motion leaves place, direction and scale open, so errors are those after the best similarity
of the cameras' centres (Umeyama, IEEE PAMI 13(4), 1991); the rotation errors are of the same similarity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.manifold.quaternion import (
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_multiply,
    rotate,
    rotation_matrix,
)
from vision3d.rigid import inverse
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.view_graph import angle_of

__all__ = ["Alignment", "align", "transformed"]

Array = NDArray[np.float64]
FEWEST = 3
OWN_DIRECTIONS = 0.1  # weight of the directions of the cameras beside their places


@dataclass(frozen=True, eq=False)
class Alignment:
    """Truth from model: `scale * rotation * point + translation`.

    Parameters
    ----------
    scale, rotation, translation : number, quaternion (4,), (3,)
    position_errors : (V,) of the cameras' centres, in the truth's unit
    rotation_errors_rad : (V,) of the cameras' directions
    """

    scale: float
    rotation: Array
    translation: Array
    position_errors: Array
    rotation_errors_rad: Array

    @property
    def ate(self) -> float:
        """Absolute trajectory error: RMS of the position errors."""
        return float(np.sqrt(np.mean(self.position_errors**2)))

    def apply(self, points: Array) -> Array:
        """Points (N, 3) of the model in the truth's frame."""
        return self.scale * rotate(self.rotation, points) + self.translation


def align(found: Reconstruction, truth_T_world: dict[str, Array]) -> Alignment:
    """The similarity from the centres of the pictures that the truth knows.

    Parameters
    ----------
    truth_T_world : by the names of pictures, true poses camera_T_world (7,)

    Raises
    ------
    DataError
        where fewer than three pictures are in both, or their centres lie in one point.
    """
    views = [k for k, name in enumerate(found.names) if name in truth_T_world]
    if len(views) < FEWEST:
        raise DataError(f"a similarity needs {FEWEST} pictures that the truth knows, got {len(views)}")
    truth = np.array([truth_T_world[found.names[k]] for k in views])
    theirs, ours = inverse(truth), inverse(found.cameras_T_world[views])
    scale, rotation, translation = _umeyama(ours, theirs)
    moved = scale * rotate(rotation, ours[:, 4:]) + translation
    turned = quaternion_multiply(np.broadcast_to(rotation, (len(views), 4)), ours[:, :4])
    between = quaternion_multiply(quaternion_inverse(theirs[:, :4]), turned)
    return Alignment(
        scale, rotation, translation, np.linalg.norm(moved - theirs[:, 4:], axis=1), angle_of(between)
    )


def transformed(found: Reconstruction, alignment: Alignment) -> Reconstruction:
    """The model in the truth's frame and unit."""
    world_T_cameras = inverse(found.cameras_T_world)
    places = alignment.apply(world_T_cameras[:, 4:])
    turns = quaternion_multiply(np.broadcast_to(alignment.rotation, (len(found), 4)), world_T_cameras[:, :4])
    return found.replaced(
        points=alignment.apply(found.points), cameras_T_world=inverse(np.concatenate([turns, places], axis=1))
    )


def _umeyama(source: Array, target: Array) -> tuple[float, Array, Array]:
    """Scale, quaternion and translation that take the places of poses (N, 7) nearest to each other.

    Cameras along a line leave the turn about it open; a small share of their own directions decides it.
    """
    middle_s, middle_t = source[:, 4:].mean(axis=0), target[:, 4:].mean(axis=0)
    apart_s, apart_t = source[:, 4:] - middle_s, target[:, 4:] - middle_t
    spread_s, spread_t = float((apart_s**2).sum()), float((apart_t**2).sum())
    if spread_s <= 0.0 or spread_t <= 0.0:
        raise DataError("all cameras of the model are in one place, which leaves scale and direction open")
    turns_s, turns_t = rotation_matrix(source[:, :4]), rotation_matrix(target[:, :4])
    places = apart_t.T @ apart_s / np.sqrt(spread_s * spread_t)
    directions = np.einsum("nij,nkj->ik", turns_t, turns_s) / len(source)
    u, _, vt = np.linalg.svd(places + OWN_DIRECTIONS * directions)
    turn = (u * np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])) @ vt
    scale = float((apart_t * (apart_s @ turn.T)).sum() / spread_s)
    return scale, quaternion_from_matrix(turn), middle_t - scale * turn @ middle_s
