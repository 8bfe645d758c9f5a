"""Bundler's `bundle.out`: cameras, and coloured points with the pixels that saw them.

    model = read_bundler("Balbianello.out", images=["1.jpg", "2.jpg"], size=(640, 427))
    write_bundler("out/bundle.out", model)              # and out/list.txt, the names of the images

Snavely, Seitz, Szeliski 2006, "Photo tourism"; file format 0.3.  Cameras look along −z with y up, and pixels
count from the centre of the image, y up; here they look along +z with y down.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.manifold.quaternion import quaternion_from_matrix
from vision3d.camera import Camera
from vision3d.sfm.bal import radial_camera
from vision3d.sfm.bundler_file import bundler_list, bundler_text
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["read_bundler", "write_bundler"]

Array = NDArray[np.float64]

HEADER = "# Bundle file v0.3"
FLIP = np.array([1.0, -1.0, -1.0])


def read_bundler(
    path: Path | str, *, images: Sequence[str] = (), size: Sequence[int] | None = None
) -> Reconstruction:
    """Read a model.

    Parameters
    ----------
    path : of `bundle.out`
    images : names of all the cameras' images, as `list.txt` has them
    size : (width, height) of the images, px; unless given, what just holds all the observations

    Cameras that Bundler could not place (focal length 0) are listed in `missing`.

    Raises
    ------
    FileFormatError
        for a file that is not of this format, or ends early.
    """
    path = Path(path)
    numbers, V, N = _numbers(path)
    names = tuple(images) or tuple(f"image {i}" for i in range(V))
    if len(names) != V:
        raise FileFormatError(f"{path.name} has {V} cameras, but {len(names)} names of images were given")
    views = numbers[: 15 * V].reshape(V, 15)
    points, colors, tracks, observed = _points(path, numbers[15 * V :], N)
    placed = views[:, 0] > 0.0
    renumbered = np.cumsum(placed) - 1
    of = observed[:, 0].astype(np.int64)
    if len(of) and (of.min() < 0 or of.max() >= V or not placed[of].all()):
        raise FileFormatError(f"{path.name}: a point was seen by a camera that has no pose")
    pixels = observed[:, 2:] * (1.0, -1.0)
    if size is None:
        reach = np.abs(pixels).max(axis=0, initial=0.0)
        size = tuple(int(side) for side in 2.0 * np.ceil(reach) + 1.0)
    middle = 0.5 * (np.array(size) - 1.0)
    return Reconstruction(
        cameras=tuple(Camera("brown2", (f, f, *middle), (a, b), size) for f, a, b in views[placed, :3]),
        names=tuple(name for name, ok in zip(names, placed, strict=True) if ok),
        camera_of=np.arange(int(placed.sum())),
        cameras_T_world=_poses(views[placed]),
        points=points,
        colors=colors,
        image_index=renumbered[of],
        point_index=tracks,
        pixels=pixels + middle,
        models=("RADIAL",) * int(placed.sum()),
        missing=tuple(
            (name, "Bundler gave it no pose") for name, ok in zip(names, placed, strict=True) if not ok
        ),
    )


def write_bundler(path: Path | str, reconstruction: Reconstruction) -> Path:
    """Write a model, and beside it `list.txt` with the names of the images.

    Raises
    ------
    ModelError
        for a lens that the format cannot say: it has one focal length and two radial coefficients.
    """
    path = Path(path)
    for camera in reconstruction.cameras:
        radial_camera(camera)
    path.write_text(bundler_text(reconstruction), encoding="ascii")
    path.with_name("list.txt").write_text(bundler_list(reconstruction), encoding="utf-8")
    return path


def _numbers(path: Path) -> tuple[Array, int, int]:
    """All numbers after the counts, and the numbers of cameras and points."""
    what = f"{path.name} is no bundle file of version 0.3"
    try:
        header, _, text = path.read_text(encoding="ascii").partition("\n")
        words = text.split() if header.strip() == HEADER else ["0", "0"]
        V, N = (int(word) for word in words[:2])
        numbers = np.array(words[2:], dtype=np.float64)
    except (OSError, ValueError) as error:
        raise FileFormatError(f"{what}: {error}") from error
    if header.strip() != HEADER:
        raise FileFormatError(f"{what}: its first line is {header[:40]!r}, expected {HEADER!r}")
    if V < 0 or N < 0 or len(numbers) < 15 * V or not np.isfinite(numbers).all():
        raise FileFormatError(f"{what}: {V} cameras take {15 * V} finite numbers; it may have been cut off")
    return numbers, V, N


def _poses(views: Array) -> Array:
    """camera_T_world (V, 7) of Bundler's rows: focal length and coefficients, rotation, translation."""
    turns = FLIP[:, None] * views[:, 3:12].reshape(-1, 3, 3)
    return np.concatenate([quaternion_from_matrix(turns), FLIP * views[:, 12:]], axis=1)


def _points(
    path: Path, numbers: Array, count: int
) -> tuple[Array, NDArray[np.uint8], NDArray[np.int64], Array]:
    """Points (N, 3), colours (N, 3); point (K,) and camera, key, x, y (K, 4) of every observation."""
    points, colors = np.empty((count, 3)), np.empty((count, 3), dtype=np.uint8)
    tracks, rows, at = [], [], 0
    for j in range(count):
        head = numbers[at : at + 7]
        seen = int(head[6]) if len(head) == 7 else -1
        row = numbers[at + 7 : at + 7 + 4 * max(seen, 0)]
        if seen < 0 or len(row) != 4 * seen:
            raise FileFormatError(
                f"{path.name} ends inside point {j} of {count}, or its list of views is damaged"
            )
        points[j], colors[j] = head[:3], np.clip(head[3:6], 0, 255)
        rows.append(row.reshape(seen, 4))
        tracks.append(np.full(seen, j, dtype=np.int64))
        at += 7 + 4 * seen
    if not rows:
        return points, colors, np.zeros(0, dtype=np.int64), np.zeros((0, 4))
    return points, colors, np.concatenate(tracks), np.concatenate(rows)
