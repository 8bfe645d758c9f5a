"""The plane that most pixels of a depth image lie on, fitted in inverse depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from vision3d.camera import Camera
from vision3d.stereo.depth import Depth

__all__ = ["FittedPlane", "InverseDepth", "best_plane"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TILE = 12  # px
FULL = 0.6  # share of a tile's pixels that must have a depth
SEEDS, ROUNDS = 120, 8
GATE = 3.0  # standard deviations
LOOSE = 2.0  # what a surface may be uneven by, in medians of the pixels' standard deviation
TUKEY = 4.685
NEIGHBOURS = 289.0  # pixels (17 by 17) over which errors of matches go together


@dataclass(frozen=True, slots=True, eq=False)
class InverseDepth:
    """Inverse depth (h, w), 1/m, its standard deviation, the rays (h, w, 3) with z = 1, and where all are."""

    inverse: Array
    std: Array
    rays: Array
    known: Mask

    @classmethod
    def of(cls, depth: Depth | Any, camera: Camera, relative_std: float) -> Self:
        """Of a stereo depth, or of an array (h, w) in metres."""
        from vision3d.stereo.back_projection import back_project

        points = back_project(depth, camera)
        z = points[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse, rays = 1.0 / z, points / z[..., None]
            known = np.asarray(np.isfinite(points).all(axis=-1))
            spread = relative_std * z
            if isinstance(depth, Depth):
                known &= depth.measured & np.isfinite(depth.std_m)
                spread = depth.std_m.astype(np.float64)
            std = spread / z**2
        if known.any():  # nobody is much surer than most
            std = np.hypot(std, 0.5 * np.median(std[known]))
        return cls(inverse, std, rays, known)


class FittedPlane(NamedTuple):
    """m (3,) of 1/z = m · ray, its covariance (3, 3), and the pixels (h, w) it was fitted to."""

    m: Array
    cov: Array
    inliers: Mask


class _Tiles(NamedTuple):
    """Sums over tiles (T, …): normal equations, weights, mean ray, inverse depth and its deviation."""

    information: Array
    moment: Array
    rays: Array
    inverse: Array
    std: Array
    pixels: Array
    misfit: Array


def best_plane(data: InverseDepth, free: Mask) -> FittedPlane | None:
    """The plane of most pixels among those that are `free`; None where no tile is flat."""
    tiles = _tiles(data, free)
    if tiles is None:
        return None
    # the flattest tiles propose, spread over the picture by their order
    order = np.argsort(tiles.misfit)[: max(SEEDS, len(tiles.misfit) // 2)]
    best, most = None, 0.0
    for seed in order[:: max(1, len(order) // SEEDS)]:
        members, support = _grown(tiles, int(seed))
        if support > most:
            best, most = members, support
    if best is None:
        return None
    m = np.asarray(np.linalg.solve(*_normal(tiles, best)), dtype=np.float64)
    return _polished(data, free, m)


def _tiles(data: InverseDepth, free: Mask) -> _Tiles | None:
    """Fit every tile that is full enough."""
    height, width = free.shape
    rows, columns = height // TILE, width // TILE
    if rows < 1 or columns < 1:
        return None

    def cut(values: Any) -> Any:
        part = values[: rows * TILE, : columns * TILE]
        shape = (rows, TILE, columns, TILE, *values.shape[2:])
        return part.reshape(shape).swapaxes(1, 2).reshape(rows * columns, TILE * TILE, *values.shape[2:])

    taken = cut(free)
    full = taken.mean(axis=1) >= FULL
    if not full.any():
        return None
    taken, rays = taken[full], cut(data.rays)[full]
    inverse, std = cut(data.inverse)[full], cut(data.std)[full]
    weight = np.where(taken, 1.0 / std**2, 0.0)
    inverse, rays = np.where(taken, inverse, 0.0), np.where(taken[..., None], rays, 0.0)
    information = np.einsum("tn,tni,tnj->tij", weight, rays, rays)
    moment = np.einsum("tn,tni,tn->ti", weight, rays, inverse)
    ridge = 1e-9 * np.trace(information, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    m = np.linalg.solve(information + ridge, moment[..., None])[..., 0]
    residual = np.where(taken, inverse - np.einsum("tni,ti->tn", rays, m), 0.0)
    pixels = taken.sum(axis=1).astype(np.float64)
    total = weight.sum(axis=1)
    misfit = np.sqrt((weight * residual**2).sum(axis=1) / pixels)
    middle = np.einsum("tn,tni->ti", weight, rays) / total[:, None]
    mean = (weight * inverse).sum(axis=1) / total
    return _Tiles(information, moment, middle, mean, 1.0 / np.sqrt(total / pixels), pixels, misfit)


def _normal(tiles: _Tiles, members: Mask) -> tuple[Array, Array]:
    """Normal equations of some tiles, whose pixels' errors go together."""
    information = tiles.information[members].sum(axis=0) / NEIGHBOURS
    return information + 1e-12 * np.trace(information) * np.eye(3), tiles.moment[members].sum(
        axis=0
    ) / NEIGHBOURS


def _grown(tiles: _Tiles, seed: int) -> tuple[Mask, float]:
    """Tiles that a seed's plane predicts, gathered until they stay the same, and their pixels."""
    members = np.zeros(len(tiles.pixels), dtype=np.bool_)
    members[seed] = True
    for _ in range(ROUNDS):
        information, moment = _normal(tiles, members)
        m = np.linalg.solve(information, moment)
        spread = np.einsum("ti,ij,tj->t", tiles.rays, np.linalg.inv(information), tiles.rays)
        # a plane that is badly known must not gather everything
        spread = np.minimum(spread, (3.0 * tiles.std) ** 2)
        gate = GATE * np.sqrt(tiles.std**2 + spread)
        now = (np.abs(tiles.inverse - tiles.rays @ m) < gate) & (tiles.misfit < GATE)
        now[seed] = True
        if (now == members).all():
            break
        members = now
    return members, float(tiles.pixels[members].sum())


def _polished(data: InverseDepth, free: Mask, m: Array) -> FittedPlane | None:
    """Fit all free pixels that lie on the plane, with Tukey's weights."""
    rays, inverse, std = data.rays[free], data.inverse[free], data.std[free]
    loose = np.hypot(std, LOOSE * np.median(std))
    information = np.eye(3)
    for _ in range(10):
        scaled = (inverse - rays @ m) / loose
        weight = np.square(np.maximum(1.0 - np.square(scaled / TUKEY), 0.0)) / loose**2
        information = (rays * weight[:, None]).T @ rays
        if not np.isfinite(information).all() or np.linalg.cond(information) > 1e14:
            return None
        step = np.linalg.solve(information, (rays * weight[:, None]).T @ (inverse - rays @ m))
        m = m + step
        if np.linalg.norm(step) < 1e-10 * np.linalg.norm(m):
            break
    close = np.abs(inverse - rays @ m) < GATE * loose
    inliers = np.zeros_like(free)
    inliers[free] = close
    cov = np.asarray(NEIGHBOURS * np.linalg.inv(information), dtype=np.float64)
    return FittedPlane(m, cov, inliers)
