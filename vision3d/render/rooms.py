"""Scenes with names: a desk, a corridor, a wall, the ground outside, and a wall of equal bricks.

All lie in front of a camera at the origin that looks along +z, y down, at metres that suit a 60 degree lens.
"""

from __future__ import annotations

import numpy as np

from vision3d.render.material import Material, bricks, leaves, speckles
from vision3d.render.shapes import Shape, Window, box, pose_at, rectangle, sphere
from vision3d.render.solid import Scene

__all__ = ["SCENES", "corridor", "desk", "ground", "repeated_wall", "wall"]

Tint = tuple[float, float, float]
DOWN, UP = (-np.pi / 2, 0.0, 0.0), (np.pi / 2, 0.0, 0.0)  # a rectangle whose face looks up, or down


def _windows(rng: np.random.Generator, count: int, share: float) -> list[Window]:
    """Windows of a material at random places, so that no two surfaces show the same."""
    corners = rng.uniform(0.0, 1.0, (count, 2))
    return [(float(u), float(v), share, share) for u, v in corners]


def _tint(rng: np.random.Generator) -> Tint:
    blue, green, red = rng.uniform(0.45, 1.0, 3)
    return float(blue), float(green), float(red)


def _material(rng: np.random.Generator, given: Material | None) -> Material:
    return leaves(rng, 1536, count=20_000) if given is None else given


def desk(rng: np.random.Generator, material: Material | None = None) -> Scene:
    """A table half a metre below with boxes, balls and books on it, a wall behind; depths 0.7 to 2.2 m.

    Parameters
    ----------
    rng : for places, sizes and pictures
    material : to cover everything with windows of it; leaves by default
    """
    cover = _material(rng, material)
    table, back = 0.45, 2.2
    shapes: list[Shape] = [
        rectangle(pose_at((0, table, 1.4), DOWN), (2.6, 1.8), cover, window=_windows(rng, 1, 0.8)[0],
                  tint=(0.6, 0.75, 0.95), name="table"),
        rectangle(pose_at((0, -0.4, back)), (4.4, 2.6), cover, window=_windows(rng, 1, 1.0)[0],
                  tint=(0.95, 0.9, 0.8), name="wall"),
    ]  # fmt: skip
    places = [(-0.55, 1.15), (0.42, 1.05), (-0.05, 1.6), (0.65, 1.65), (-0.75, 1.75)]
    for k, (x, z) in enumerate(places):
        size = rng.uniform((0.14, 0.16, 0.14), (0.30, 0.42, 0.30))
        turn = (0.0, rng.uniform(-0.9, 0.9), 0.0)
        shapes += box(
            pose_at((x, table - 0.5 * size[1], z), turn), tuple(size), cover,
            windows=_windows(rng, 6, 0.22), tint=_tint(rng), name=f"box {k}",
        )  # fmt: skip
    for k, (x, z) in enumerate([(0.08, 1.12), (-0.3, 1.45), (0.35, 1.4)]):
        radius = rng.uniform(0.07, 0.12)
        shapes.append(
            sphere((x, table - radius, z), radius, cover, window=_windows(rng, 1, 0.5)[0], tint=_tint(rng),
                   rotation_vector=rng.uniform(-1, 1, 3), name=f"ball {k}")
        )  # fmt: skip
    return Scene(tuple(shapes), name="desk")


def corridor(rng: np.random.Generator, material: Material | None = None) -> Scene:
    """Floor, ceiling, two walls and an end 9 m away, with boxes along the sides; a robot drives along +z."""
    cover = _material(rng, material)
    long, half, low, high = 10.0, 1.0, 0.6, -1.6
    middle = 0.5 * long - 1.0
    tall = low - high
    sides = [
        (pose_at((0, low, middle), DOWN), (2 * half, long), "floor"),
        (pose_at((0, high, middle), UP), (2 * half, long), "ceiling"),
        (pose_at((-half, 0.5 * (low + high), middle), (0, -np.pi / 2, 0)), (long, tall), "left wall"),
        (pose_at((half, 0.5 * (low + high), middle), (0, np.pi / 2, 0)), (long, tall), "right wall"),
        (pose_at((0, 0.5 * (low + high), long - 1.0)), (2 * half, tall), "end"),
    ]
    shapes = [
        rectangle(pose, size, cover, window=(*rng.uniform(0, 1, 2), 0.45 * size[0], 0.45 * size[1]),
                  tint=_tint(rng), name=name)
        for pose, size, name in sides
    ]  # fmt: skip
    for k in range(6):
        size = rng.uniform((0.25, 0.3, 0.25), (0.45, 0.9, 0.5))
        x = (half - 0.5 * size[0] - 0.03) * (1 if k % 2 else -1)
        pose = pose_at((x, low - 0.5 * size[1], 1.8 + 1.1 * k), (0.0, rng.uniform(-0.3, 0.3), 0.0))
        shapes += box(
            pose, tuple(size), cover, windows=_windows(rng, 6, 0.25), tint=_tint(rng), name=f"box {k}"
        )
    return Scene(tuple(shapes), ambient=0.7, name="corridor")


def wall(rng: np.random.Generator, material: Material | None = None, *, tilt_rad: float = 0.35) -> Scene:
    """One plane 2 m away, turned about the vertical: all that two views of it tell is a homography."""
    cover = _material(rng, material)
    turned = rectangle(pose_at((0, 0, 2.0), (0.0, tilt_rad, 0.0)), (5.0, 3.6), cover, name="wall")
    return Scene((turned,), name="wall")


def repeated_wall(rng: np.random.Generator) -> Scene:
    """A wall of equal bricks 2 m away with a shelf before it: every match has many that are as good."""
    shapes = [rectangle(pose_at((0, 0, 2.0)), (5.0, 3.6), bricks(), window=(0, 0, 2.4, 1.7), name="bricks")]
    shapes += box(pose_at((0.0, 0.5, 1.6)), (2.4, 0.08, 0.3), speckles(rng, 512), name="shelf")
    return Scene(tuple(shapes), name="repeated wall")


def ground(rng: np.random.Generator, material: Material | None = None, *, height_m: float = 1.2) -> Scene:
    """Level ground `height_m` below with boxes and stones on it, and nothing behind; depths 1.5 to 15 m."""
    cover = _material(rng, material)
    shapes: list[Shape] = [
        rectangle(pose_at((0, height_m, 8.0), DOWN), (20.0, 15.0), cover,
                  window=(*rng.uniform(0, 1, 2), 4.0, 3.0), tint=(0.6, 0.85, 0.75), name="ground")
    ]  # fmt: skip
    for k in range(8):
        size = rng.uniform((0.4, 0.4, 0.4), (1.0, 1.6, 1.0))
        x, z = rng.uniform(-0.4, 0.4) * (3.0 + k), 3.0 + 1.1 * k
        shapes += box(
            pose_at((x, height_m - 0.5 * size[1], z), (0.0, rng.uniform(-0.8, 0.8), 0.0)), tuple(size), cover,
            windows=_windows(rng, 6, 0.3), tint=_tint(rng), name=f"box {k}",
        )  # fmt: skip
    for k in range(6):
        radius = rng.uniform(0.1, 0.25)
        x, z = rng.uniform(-1.2, 1.2), rng.uniform(2.2, 5.0)
        shapes.append(
            sphere((x, height_m - 0.6 * radius, z), radius, cover, window=_windows(rng, 1, 0.4)[0],
                   tint=_tint(rng), name=f"stone {k}")
        )  # fmt: skip
    return Scene(tuple(shapes), ambient=0.65, background=0.8, name="ground")


SCENES = {"desk": desk, "corridor": corridor, "wall": wall, "repeated wall": repeated_wall, "ground": ground}
"""Scenes by name, each a function of a random generator."""
