"""A line painted on the ground, and what a robot's camera sees of it as it drives along."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.lines.mount import CameraMount, planar_pose
from vision3d.render.scene import Plane, render_planes
from vision3d.render.texture import Texture, distance_field
from vision3d.rigid import transform

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["GroundLine", "RobotView", "drive", "line_pixels", "random_line", "render_ground"]

Array = NDArray[np.float64]
INK, FLOOR = 0.12, 0.7
STEP_M = 0.01


@dataclass(frozen=True, eq=False)
class GroundLine:
    """A stripe on the ground z = 0 along a curve.

    Attributes
    ----------
    points : (N, 2) m along the middle of the stripe, in the frame of the world
    width_m : of the stripe
    ink, floor : reflectance of the stripe and of the ground round it
    """

    points: Array
    width_m: float = 0.05
    ink: float = INK
    floor: float = FLOOR

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
            raise ShapeError(f"a line on the ground takes points (N, 2), two or more; got {points.shape}")
        if not self.width_m > 0:
            raise ModelError(f"width_m of a line must be positive, got {self.width_m}")
        points.setflags(write=False)
        object.__setattr__(self, "points", points)

    @cached_property
    def lengths(self) -> Array:
        """Arc length (N,) at each point, m."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def at(self, s_m: float | Array) -> Array:
        """Place and direction (..., 3), x y heading, at an arc length."""
        s = np.asarray(s_m, dtype=np.float64)
        x, y = (np.interp(s, self.lengths, self.points[:, k]) for k in (0, 1))
        along = np.gradient(self.points, axis=0)
        heading = np.interp(s, self.lengths, np.unwrap(np.arctan2(along[:, 1], along[:, 0])))
        return np.stack([x, y, heading], axis=-1)

    def seen_from(self, pose: Array, ahead_m: float) -> tuple[float, float]:
        """Where the line crosses, seen from a robot at `pose` (x, y, heading).

        Returns
        -------
        tuple
            how far to the left (m) the line is where it crosses the robot's own y axis moved forward by
            `ahead_m`, and its heading (rad) there, relative to the robot's; NaN where it does not.
        """
        turn = np.array([[np.cos(pose[2]), np.sin(pose[2])], [-np.sin(pose[2]), np.cos(pose[2])]])
        local = (self.points - pose[:2]) @ turn.T
        x = local[:, 0] - ahead_m
        crossings = np.flatnonzero((x[:-1] < 0) != (x[1:] < 0))
        if not len(crossings):
            return np.nan, np.nan
        share = x[crossings] / (x[crossings] - x[crossings + 1])
        step = local[crossings + 1] - local[crossings]
        left = local[crossings, 1] + share * step[:, 1]
        nearest = int(np.argmin(np.abs(left)))
        # a line is followed forwards, whichever way its points run
        forward = step[nearest] * (1.0 if step[nearest, 0] >= 0 else -1.0)
        return float(left[nearest]), float(np.arctan2(forward[1], forward[0]))

    @cached_property
    def edges(self) -> tuple[Array, Array]:
        """Points (N, 2) along the left and along the right edge of the stripe, m."""
        along = np.gradient(self.points, axis=0)
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        aside = 0.5 * self.width_m * np.column_stack([-along[:, 1], along[:, 0]])
        return self.points + aside, self.points - aside

    @cached_property
    def texture(self) -> Texture:
        """The stripe and a metre of ground round it."""
        return self._painted(self.floor)

    @cached_property
    def stripe(self) -> Texture:
        """The stripe alone; one sees through to what lies beside it."""
        return self._painted(-1.0)

    def _painted(self, floor: float) -> Texture:
        from scipy.spatial import KDTree

        low, high = self.points.min(axis=0) - 1.0, self.points.max(axis=0) + 1.0
        x, y = (np.arange(low[k], high[k] + STEP_M, STEP_M) for k in (0, 1))
        grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        _, nearest = KDTree(self.points).query(grid)
        last = len(self.points) - 1
        distance = np.minimum(
            _to_segment(grid, self.points, np.maximum(nearest - 1, 0)),
            _to_segment(grid, self.points, np.minimum(nearest, last - 1)),
        )
        field = (distance - 0.5 * self.width_m).reshape(len(y), len(x))
        return distance_field(x, y, field, within=self.ink, without=floor)


def _to_segment(grid: Array, points: Array, first: NDArray[np.int64]) -> Array:
    """Distance (M,) of points from the segments that begin at `first`."""
    start = points[first]
    along = points[first + 1] - start
    share = np.sum((grid - start) * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-18)
    foot = start + np.clip(share, 0.0, 1.0)[:, None] * along
    distance: Array = np.linalg.norm(grid - foot, axis=1)
    return distance


def random_line(
    rng: np.random.Generator, *, length_m: float = 4.0, bend_per_m: float = 1.0, **looks: Any
) -> GroundLine:
    """A smooth line from the origin along x whose curvature wanders by `bend_per_m` (1/m, one sigma)."""
    step = 0.01
    s = np.arange(0.0, length_m, step)
    phases = rng.uniform(0, 2 * np.pi, 3)
    waves = np.cos(2 * np.pi * np.outer(s, [0.25, 0.4, 0.7]) + phases) @ rng.normal(0, 0.8, 3)
    heading = np.cumsum(bend_per_m * waves * np.minimum(s / 0.3, 1.0)) * step
    points = np.cumsum(step * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    return GroundLine(np.vstack([[-0.3, 0.0], [0.0, 0.0], points]), **looks)


def line_pixels(
    camera: Camera, mount: CameraMount, line: GroundLine, pose: Array, rows: Sequence[float]
) -> Array:
    """Where the middle between the stripe's edges crosses rows of the image: x (len(rows),) px, or NaN.

    `pose` is the robot's (x, y, heading); of several crossings the nearest to the robot counts.
    """
    world = mount.world_pose(planar_pose(*pose))
    sides = []
    for edge in line.edges:
        dense = np.arange(0.0, 1.0, 2e-4) * (len(edge) - 1)
        fine = np.column_stack([np.interp(dense, np.arange(len(edge)), edge[:, k]) for k in (0, 1)])
        pixels = camera.project(transform(world, np.column_stack([fine, np.zeros(len(fine))])))
        sides.append([_crossing(pixels, row) for row in rows])
    return np.asarray(np.mean(sides, axis=0))


def _crossing(pixels: Array, row: float) -> float:
    """The x at which a path of pixels first comes to a row from below."""
    y = pixels[:, 1] - row
    crossings = np.flatnonzero((y[:-1] > 0) & (y[1:] <= 0))
    if not len(crossings):
        return float("nan")
    k = int(crossings[0])
    share = y[k] / (y[k] - y[k + 1])
    return float(pixels[k, 0] + share * (pixels[k + 1, 0] - pixels[k, 0]))


@dataclass(frozen=True, slots=True, eq=False)
class RobotView:
    """One frame of a drive: its time, the image, and where the robot (x, y, heading) was."""

    t_s: float
    image: NDArray[np.uint8]
    pose: Array


def render_ground(
    camera: Camera,
    mount: CameraMount,
    line: GroundLine | Sequence[GroundLine],
    pose: Array,
    *,
    moving: tuple[float, float, float] | None = None,
    **settings: Any,
) -> NDArray[np.uint8]:
    """What a robot at `pose` (x, y, heading) sees of a line, or of several.

    Parameters
    ----------
    line : the first of several brings the ground with it
    moving : (speed m/s, turn rate rad/s, shutter s), which blurs the image; None for a robot at rest
    settings : of `render_planes`
    """
    place = mount.world_pose(planar_pose(*pose))
    motion = None
    if moving is not None:
        # the world moves against the robot: in its own frame it turns and shifts the other way
        speed, rate, shutter = moving
        spin = np.array([0.0, 0.0, -rate * shutter])
        shift = -speed * shutter * np.array([np.cos(pose[2]), np.sin(pose[2]), 0.0])
        motion = np.concatenate([spin, shift - np.cross(spin, [pose[0], pose[1], 0.0])])
    first, *others = [line] if isinstance(line, GroundLine) else line
    planes = [Plane(place, first.texture, motion), *(Plane(place, one.stripe, motion) for one in others)]
    return render_planes(camera, planes, **settings)


def drive(
    camera: Camera,
    mount: CameraMount,
    line: GroundLine,
    *,
    rng: np.random.Generator,
    speed_m_s: float = 0.5,
    fps: float = 25.0,
    sway_m: float = 0.03,
    shutter_s: float = 0.0,
    **settings: Any,
) -> Iterator[RobotView]:
    """Frames of a robot that follows a line, swaying from side to side, until a metre before its end."""
    period, phase = 2.5, rng.uniform(0, 2 * np.pi)
    count = int((line.lengths[-1] - 1.0) / speed_m_s * fps)
    rate = 2 * np.pi / period
    for k in range(count):
        t = k / fps
        x, y, heading = line.at(speed_m_s * t)
        aside = sway_m * np.sin(rate * t + phase)
        drift = sway_m * rate * np.cos(rate * t + phase)
        pose = np.array(
            [
                x - aside * np.sin(heading),
                y + aside * np.cos(heading),
                heading + np.arctan2(drift, speed_m_s),
            ]
        )
        moving = (speed_m_s, 0.0, shutter_s) if shutter_s > 0 else None
        image = render_ground(camera, mount, line, pose, moving=moving, rng=rng, **settings)
        yield RobotView(t, image, pose)
