"""Videos with their truth: markers and boards that move in front of a camera, and files of them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.manifold import SE3
from vision3d.boards import Board
from vision3d.render.patterns import board_planes, marker_texture
from vision3d.render.poses import board_poses
from vision3d.render.scene import Plane, render_planes

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["RenderedFrame", "moving_board", "moving_markers", "write_video"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class RenderedFrame:
    """One frame and its truth.

    Attributes
    ----------
    t_s : time since the first frame
    image : (h, w) uint8
    poses : camera_T_marker (7,) by the marker's id; a board's under -1
    """

    t_s: float
    image: Image
    poses: Mapping[int, Array]


def moving_markers(
    camera: Camera,
    ids: Iterable[int],
    size_m: float,
    *,
    rng: np.random.Generator,
    dictionary: str = "4x4_50",
    seconds: float = 4.0,
    fps: float = 25.0,
    shutter_s: float = 0.0,
    **settings: Any,
) -> Iterator[RenderedFrame]:
    """Frames of markers that sway and turn, side by side; some tilt far, some near to none.

    Parameters
    ----------
    ids : of the markers, in one row or several
    size_m : side of each black square
    shutter_s : exposure time, which blurs what moves; 0 for none
    settings : of `render_planes`
    """
    paths = _paths(camera, list(ids), size_m, rng)
    textures = {number: marker_texture(dictionary, number, size_m) for number in paths}
    manifold = SE3()
    for k in range(round(seconds * fps)):
        t = k / fps
        poses = {number: path(t) for number, path in paths.items()}
        planes = []
        for number, pose in poses.items():
            motion = None
            if shutter_s > 0:
                half = 0.5 * shutter_s
                motion = manifold.local(paths[number](t - half), paths[number](t + half))
            planes.append(Plane(pose, textures[number], motion))
        image = render_planes(camera, planes, rng=rng, **settings)
        yield RenderedFrame(t, image, MappingProxyType(poses))


def _paths(camera: Camera, ids: list[int], size_m: float, rng: np.random.Generator) -> dict[int, Any]:
    """A smooth motion for each marker about a place of its own, in front of the camera."""
    columns = int(np.ceil(np.sqrt(len(ids) * 4 / 3)))
    rows = -(-len(ids) // columns)
    width, height = camera.size
    focal = float(np.mean(camera.intrinsics[:2]))
    cell_px = min(width / columns, height / rows)
    distance = focal * size_m / (0.45 * cell_px)
    paths = {}
    for k, number in enumerate(ids):
        pixel = np.array([(k % columns + 0.5) * width / columns, (k // columns + 0.5) * height / rows])
        ray = camera.unproject(pixel[None])[0]
        paths[number] = _sway(ray * distance / ray[2], 0.12 * size_m, rng)
    return paths


def _sway(middle: Array, reach_m: float, rng: np.random.Generator) -> Any:
    """A pose as a smooth function of time: sums of slow waves."""
    rates = 2 * np.pi * rng.uniform(0.15, 0.5, 6)
    phases = rng.uniform(0, 2 * np.pi, 6)
    reach = np.concatenate([[0.6, 0.6, 0.5], np.full(3, reach_m)])

    def pose(t: float) -> Array:
        waves = reach * np.sin(rates * t + phases)
        start = np.concatenate([[1.0, 0.0, 0.0, 0.0], middle + waves[3:]])
        return SE3().retract(start, np.concatenate([waves[:3], np.zeros(3)]))

    return pose


def moving_board(
    camera: Camera,
    board: Board,
    views: int,
    *,
    rng: np.random.Generator,
    fps: float = 25.0,
    hold_s: float = 0.8,
    move_s: float = 0.6,
    **settings: Any,
) -> Iterator[RenderedFrame]:
    """Frames of a board that is brought into one pose after the other and held still in each."""
    poses = board_poses(camera, board, views, rng)
    manifold = SE3()
    period = hold_s + move_s
    for k in range(round((views * period - move_s) * fps)):
        t = k / fps
        now, within = divmod(t, period)
        here = poses[int(now)]
        if within > hold_s:
            share = (within - hold_s) / move_s
            eased = share * share * (3.0 - 2.0 * share)
            here = manifold.retract(here, eased * manifold.local(here, poses[int(now) + 1]))
        image = render_planes(camera, board_planes(board, here), rng=rng, **settings)
        yield RenderedFrame(t, image, MappingProxyType({-1: here}))


def write_video(path: str | os.PathLike[str], images: Iterable[Image], fps: float = 25.0) -> Path:
    """Write images, (h, w) or (h, w, 3) BGR uint8, as Motion JPEG in an .avi file.

    Raises
    ------
    DataError
        where there is no image, the file cannot be written, or an image has another size than the first.
    """
    import cv2

    where = Path(path)
    writer, first = None, (0, 0)
    try:
        for k, image in enumerate(images):
            if writer is None:
                first = (image.shape[0], image.shape[1])
                writer = cv2.VideoWriter(str(where), cv2.VideoWriter.fourcc(*"MJPG"), fps, first[::-1])
                if not writer.isOpened():
                    raise DataError(
                        f"{where} cannot be written; is its folder there, and does it end in .avi?"
                    )
            if image.shape[:2] != first:
                raise DataError(
                    f"image {k} is {image.shape[:2]}, the first was {first}; a video has one size"
                )
            writer.write(image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    finally:
        if writer is not None:
            writer.release()
    if writer is None:
        raise DataError(f"no image to write into {where}")
    return where
