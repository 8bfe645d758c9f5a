"""The drive as moving pictures: the map from above on the left, what the camera sees on the right."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower.curves import WIDTH_M
from factorlab.l19.follower.drive import Drive
from factorlab.l19.follower.eye import BOTTOM, MIDDLE
from factorlab.l19.follower.robot import PERIOD_S
from sequential.errors import DataError

__all__ = ["ellipse", "frames", "write_film"]

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
HIGH = 360  # px
PX_PER_M = 320.0
ZOOM = 9  # of the camera's pixels
# BGR
FLOOR, LINE, TRUTH, BELIEF = (240, 238, 235), (175, 175, 175), (0, 0, 0), (178, 114, 0)
ORANGE, WHITE = (0, 94, 213), (255, 255, 255)
FINE = 4  # bits below a pixel


def frames(drive: Drive, every: int = 1) -> Iterator[Picture]:
    """Pictures (360, 1020, 3) BGR of every so many steps.

    Raises
    ------
    DataError
        where the drive did not keep its images.
    """
    if len(drive.images) != len(drive.t_s):
        raise DataError("this drive has no images; simulate it with keep_images=True")
    for k in range(0, len(drive.t_s), every):
        yield np.hstack([_map(drive, k), _camera(drive, k)])


def write_film(path: Path, drive: Drive, every: int = 1, *, faster: float = 1.0) -> Path:
    """Write a film, .avi (Motion JPEG) or .gif, in the drive's own time or some times faster.

    Raises
    ------
    DataError
        for another ending, or a drive without images.
    """
    from vision3d.render import write_video

    seconds = every * PERIOD_S / faster
    if path.suffix == ".avi":
        return write_video(path, frames(drive, every), 1.0 / seconds)
    if path.suffix != ".gif":
        raise DataError(f"a film of a drive is written as .avi or .gif; {path.name} is neither")
    from PIL import Image

    small = (frame[::2, ::2, ::-1] for frame in frames(drive, every))
    pictures = [Image.fromarray(frame).quantize(48) for frame in small]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=round(1e3 * seconds), loop=0)
    return path


def _map(drive: Drive, k: int) -> Picture:
    """A square of the ground round the robot: the line, the way so far, and where it believes to be."""
    import cv2

    canvas = np.full((HIGH, HIGH + 120, 3), FLOOR, np.uint8)
    middle, closed = drive.poses[k, :2], False

    def pixels(points: Array) -> NDArray[np.int32]:
        right = (points[:, 0] - middle[0]) * PX_PER_M + 0.5 * canvas.shape[1]
        down = 0.5 * HIGH - (points[:, 1] - middle[1]) * PX_PER_M
        return np.asarray(np.round(np.column_stack([right, down]) * 2**FINE), dtype=np.int32)[:, None]

    def path(points: Array, colour: tuple[int, int, int], thickness: int) -> None:
        near = np.flatnonzero(np.abs(points[:, :2] - middle).max(axis=1) < 1.0)
        if len(near) > 1:
            for part in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1):
                cv2.polylines(canvas, [pixels(points[part])], closed, colour, thickness, cv2.LINE_AA, FINE)

    path(drive.line, LINE, round(WIDTH_M * PX_PER_M))
    path(drive.poses[: k + 1], ORANGE, 2)
    path(drive.estimates[: k + 1], BELIEF, 1)
    path(ellipse(drive.estimates[k], drive.covs[k]), BELIEF, 2)
    c, s = np.cos(drive.poses[k, 2]), np.sin(drive.poses[k, 2])
    body = np.array([[0.07, 0.0], [-0.05, 0.05], [-0.05, -0.05], [0.07, 0.0]])
    path(middle + body @ np.array([[c, s], [-s, c]]), TRUTH, 2)
    return canvas


def ellipse(pose: Array, cov: Array, sigmas: float = 3.0) -> Array:
    """(N, 2) m round the believed place."""
    angle = np.linspace(0.0, 2 * np.pi, 33)
    values, vectors = np.linalg.eigh(cov[:2, :2])
    local = sigmas * (vectors * np.sqrt(np.maximum(values, 0.0))) @ np.stack([np.cos(angle), np.sin(angle)])
    c, s = np.cos(pose[2]), np.sin(pose[2])
    round_it: Array = pose[:2] + (np.array([[c, -s], [s, c]]) @ local).T
    return round_it


def _camera(drive: Drive, k: int) -> Picture:
    """The image, its pixels made large, and the two points that the detector found."""
    import cv2

    large: Any = np.repeat(np.repeat(drive.images[k], ZOOM, axis=0), ZOOM, axis=1)
    canvas: Picture = np.ascontiguousarray(np.repeat(large[..., None], 3, axis=2))
    for column, row in zip(drive.columns[k], (BOTTOM, MIDDLE), strict=True):
        if np.isfinite(column):
            at = (round(ZOOM * (column + 0.5)), round(ZOOM * (row + 0.5)))
            cv2.circle(canvas, at, 6, WHITE, 3, cv2.LINE_AA)
            cv2.circle(canvas, at, 6, ORANGE, 2, cv2.LINE_AA)
    said = f"t = {drive.t_s[k]:.1f} s   {1000 * drive.offsets_m[k]:+.0f} mm".replace(".", ",")
    said += "   LIGNE PERDUE" if drive.lost[k] else ""
    canvas[:32] = canvas[:32] // 4  # a dark band, on which white is read
    cv2.putText(canvas, said, (8, 23), cv2.FONT_HERSHEY_SIMPLEX, 0.6, WHITE, 1, cv2.LINE_AA)
    return canvas
