"""A bundle adjustment laid out for compiled loops: observations sorted by point, unknowns numbered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.manifold import SE3
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.rigid import inverse
from vision3d.sfm.intrinsics import free_basis, free_names
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["BundleProblem", "BundleState", "Linearized", "bundle_problem", "resettled"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class BundleState:
    """What the adjustment moves: cameras' parameters (C, P), poses (V, 7) camera_T_world, points (N, 3)."""

    parameters: Array
    poses: Array
    points: Array


@dataclass(frozen=True, eq=False)
class Linearized:
    """Residuals (K, 2), derivatives by view (K, 2, 6 + q) and by point (K, 2, 3); how many are lost."""

    residuals: Array
    by_view: Array
    by_point: Array
    lost: int


@dataclass(frozen=True, eq=False)
class BundleProblem:
    """What a bundle adjustment is given.

    Parameters
    ----------
    cameras, camera_of : the cameras, and that of every image (V,)
    names : of the images
    images, tracks : (K,) image and point of every observation, sorted by point
    pixels : (K, 2) where it was observed
    order : (K,) place of every observation in the reconstruction that was given
    starts : (N + 1,) observations of point j are `starts[j]` to `starts[j + 1]`
    free : names of what is free in every camera
    basis : (C, P, q) how a camera's parameters follow its free ones
    columns : (V, 6 + q) place of every unknown of an image among all of the views; −1 where it is held
    size : number of unknowns of the views
    held : images whose pose is held
    """

    cameras: tuple[Camera, ...]
    camera_of: Integers
    names: tuple[str, ...]
    images: Integers
    tracks: Integers
    pixels: Array
    order: Integers
    starts: Integers
    free: tuple[tuple[str, ...], ...]
    basis: Array
    columns: Integers
    size: int
    held: tuple[int, ...]

    @property
    def codes(self) -> Integers:
        """(C,) lens codes."""
        return np.array([camera.code for camera in self.cameras], dtype=np.int64)

    @property
    def camera_columns(self) -> list[slice]:
        """Where the free parameters of every camera stand among the unknowns of the views."""
        first = self.size - sum(map(len, self.free))
        places = []
        for names in self.free:
            places.append(slice(first, first + len(names)))
            first += len(names)
        return places

    def linearize(self, state: BundleState) -> Linearized:
        """Residuals and derivatives at a state."""
        from vision3d.kernels.bundle import linearize

        K, q = len(self.images), self.basis.shape[2]
        residuals, by_view, by_point = np.empty((K, 2)), np.empty((K, 2, 6 + q)), np.empty((K, 2, 3))
        given = (self.images, self.tracks, self.pixels, self.basis)
        turns, places = rotation_matrix(state.poses[:, :4]), np.ascontiguousarray(state.poses[:, 4:])
        lost = linearize(
            self.codes, state.parameters, self.camera_of, turns, places, state.points, *given,
            residuals, by_view, by_point,
        )  # fmt: skip
        return Linearized(residuals, by_view, by_point, lost)

    def residuals(self, state: BundleState) -> Array:
        """Residuals (K, 2), pixel − projection; NaN where there is none."""
        from vision3d.kernels.bundle import reproject

        residuals = np.empty((len(self.images), 2))
        given = (self.images, self.tracks, self.pixels)
        reproject(self.codes, state.parameters, self.camera_of, state.poses, state.points, *given, residuals)
        return residuals

    def moved(self, state: BundleState, step: Array, point_steps: Array) -> BundleState:
        """The state after a step (n,) of the views and steps (N, 3) of the points."""
        eta = np.zeros((len(self.camera_of), 6))
        places = self.columns[:, :6]
        eta[places >= 0] = step[places[places >= 0]]
        poses = inverse(SE3().retract(inverse(state.poses), eta))
        poses[places[:, 0] < 0] = state.poses[places[:, 0] < 0]
        parameters = state.parameters.copy()
        for c, place in enumerate(self.camera_columns):
            parameters[c] += self.basis[c, :, : len(self.free[c])] @ step[place]
        return BundleState(parameters, poses, state.points + point_steps)


def bundle_problem(
    reconstruction: Reconstruction, *, refine: bool | Sequence[str] = True, fixed: Sequence[int] = ()
) -> tuple[BundleProblem, BundleState]:
    """Lay out a reconstruction for adjustment.

    Parameters
    ----------
    reconstruction : cameras, poses, points and observations
    refine : what moves in the cameras, see `vision3d.sfm.intrinsics.free_names`
    fixed : images whose pose is held

    Raises
    ------
    ShapeError
        for an image in `fixed` that does not exist.
    ModelError
        for a parameter that no camera has.
    """
    r = reconstruction
    V, N = len(r.camera_of), len(r.points)
    held = tuple(sorted({int(i) for i in fixed}))
    if held and not (held[0] >= 0 and held[-1] < V):
        raise ShapeError(f"fixed names image {held[-1]}, but there are {V}, counted from 0")
    order = np.argsort(r.point_index, kind="stable")
    tracks = np.ascontiguousarray(r.point_index[order], dtype=np.int64)
    used = set(r.camera_of.tolist())  # what no image was taken with stays as it is
    free = tuple(free_names(camera, refine) if c in used else () for c, camera in enumerate(r.cameras))
    P, q = max(camera.count for camera in r.cameras), max(map(len, free))
    basis, parameters = np.zeros((len(free), P, q)), np.zeros((len(free), P))
    for c, camera in enumerate(r.cameras):
        basis[c, : camera.count, : len(free[c])] = free_basis(camera, free[c])
        parameters[c, : camera.count] = camera.parameters
    columns, size = _numbered(np.asarray(r.camera_of), free, q, held)
    problem = BundleProblem(
        tuple(r.cameras),
        np.array(r.camera_of, dtype=np.int64),
        tuple(r.names),
        np.ascontiguousarray(r.image_index[order], dtype=np.int64),
        tracks,
        np.ascontiguousarray(r.pixels[order], dtype=np.float64),
        order,
        np.searchsorted(tracks, np.arange(N + 1)).astype(np.int64),
        free,
        basis,
        columns,
        size,
        held,
    )
    return problem, BundleState(parameters, np.array(r.cameras_T_world), np.array(r.points))


def _numbered(
    camera_of: Integers, free: tuple[tuple[str, ...], ...], q: int, held: tuple[int, ...]
) -> tuple[Integers, int]:
    """Places of the unknowns of every image (V, 6 + q), poses first, then the cameras; and their number."""
    V = len(camera_of)
    columns = np.full((V, 6 + q), -1, dtype=np.int64)
    moving = np.setdiff1d(np.arange(V), held)
    columns[moving, :6] = np.arange(6 * len(moving)).reshape(-1, 6)
    first = 6 * len(moving) + np.cumsum([0, *map(len, free)])
    for i, c in enumerate(camera_of):
        columns[i, 6 : 6 + len(free[c])] = first[c] + np.arange(len(free[c]))
    return columns, int(first[-1])


def resettled(reconstruction: Reconstruction, problem: BundleProblem, state: BundleState) -> Reconstruction:
    """The reconstruction at another state."""
    cameras = tuple(
        camera.with_parameters(values[: camera.count]) if problem.free[c] else camera
        for c, (camera, values) in enumerate(zip(reconstruction.cameras, state.parameters, strict=True))
    )
    return reconstruction.replaced(cameras=cameras, cameras_T_world=state.poses, points=state.points)
