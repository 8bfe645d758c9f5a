"""Files of "Bundle Adjustment in the Large": cameras, points and observations of one problem, as text.

    problem = read_bal("problem-16-22106-pre.txt")       # .gz and .bz2 as well
    write_bal("adjusted.txt", problem)

The format (Agarwal, Snavely, Seitz, Szeliski 2010, "Bundle adjustment in the large") has a camera for every
image, with a focal length and two radial coefficients, that looks along −z with y up, and pixels from the
centre of the image, y up.  Here they become cameras `brown2` that look along +z with y down.  The size of the
images is not in the file: unless it is given, it is what just holds all the observations.
"""

from __future__ import annotations

import bz2
import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError, ModelError
from sequential.manifold.quaternion import quaternion_exp, quaternion_log, quaternion_multiply
from vision3d.camera import Camera
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["read_bal", "write_bal"]

Array = NDArray[np.float64]

HALF_TURN = np.array([0.0, 1.0, 0.0, 0.0])
"""About x: from a camera that looks along −z with y up to one that looks along +z with y down."""
OPEN = {".gz": gzip.open, ".bz2": bz2.open}


def read_bal(path: Path | str, *, size: Sequence[int] | None = None) -> Reconstruction:
    """Read a problem.

    Parameters
    ----------
    path : text, or text compressed as .gz or .bz2
    size : (width, height) of the images, px

    Raises
    ------
    FileFormatError
        for a file that is not of this format, or ends early.
    """
    path = Path(path)
    counts, observed, views, points = _parts(path)
    pixels = observed[:, 2:] * (1.0, -1.0)
    size = tuple(size) if size is not None else _size_of(pixels)
    middle = 0.5 * (np.array(size) - 1.0)
    turns = quaternion_multiply(HALF_TURN, quaternion_exp(views[:, :3]))
    places = views[:, 3:6] * (1.0, -1.0, -1.0)
    cameras = tuple(Camera("brown2", (f, f, *middle), (k1, k2), size) for f, k1, k2 in views[:, 6:])
    V, N, _ = counts
    return Reconstruction(
        cameras=cameras,
        names=tuple(f"image {i}" for i in range(V)),
        camera_of=np.arange(V),
        cameras_T_world=np.concatenate([turns, places], axis=1),
        points=points,
        colors=np.full((N, 3), 128, dtype=np.uint8),
        image_index=observed[:, 0].astype(np.int64),
        point_index=observed[:, 1].astype(np.int64),
        pixels=pixels + middle,
        models=("RADIAL",) * V,
    )


def write_bal(path: Path | str, reconstruction: Reconstruction) -> Path:
    """Write a problem; every image gets a camera of its own, as the format has it.

    Raises
    ------
    ModelError
        for a lens that the format cannot say: it has one focal length and two radial coefficients.
    """
    r, path = reconstruction, Path(path)
    intrinsics = np.array([radial_camera(camera) for camera in r.cameras])
    middles = intrinsics[:, 3:][r.camera_of[r.image_index]]
    pixels = (r.pixels - middles) * (1.0, -1.0)
    turns = quaternion_log(quaternion_multiply(HALF_TURN * (1, -1, -1, -1), r.cameras_T_world[:, :4]))
    places = r.cameras_T_world[:, 4:] * (1.0, -1.0, -1.0)
    views = np.concatenate([turns, places, intrinsics[r.camera_of, :3]], axis=1)
    lines = [f"{len(r.names)} {len(r.points)} {len(pixels)}"]
    lines += [
        f"{i} {j} {x!r} {y!r}"
        for i, j, (x, y) in zip(r.image_index, r.point_index, pixels.tolist(), strict=True)
    ]
    lines += [repr(value) for value in np.concatenate([views.ravel(), r.points.ravel()]).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def radial_camera(camera: Camera) -> tuple[float, float, float, float, float]:
    """One focal length, two radial coefficients and the principal point of a camera.

    Raises
    ------
    ModelError
        where the camera has more than that.
    """
    fx, fy, cx, cy = camera.intrinsics
    if camera.lens not in {"pinhole", "brown1", "brown2"} or abs(fx - fy) > 1e-9 * fx:
        raise ModelError(
            f"this format has one focal length and two radial coefficients; a {camera.lens} camera with "
            f"fx = {fx:.6g}, fy = {fy:.6g} px does not fit: undistort the images, or export to COLMAP"
        )
    k1, k2 = (*camera.distortion, 0.0, 0.0)[:2]
    return float(fx), float(k1), float(k2), float(cx), float(cy)


def _size_of(pixels: Array) -> tuple[int, int]:
    """Width and height of an image, centred at 0, that holds all pixels."""
    reach = np.abs(pixels).max(axis=0, initial=0.0)
    width, height = (int(side) for side in 2.0 * np.ceil(reach) + 1.0)
    return width, height


def _parts(path: Path) -> tuple[tuple[int, int, int], Array, Array, Array]:
    """Counts, observations (K, 4), cameras (V, 9) and points (N, 3)."""
    what = f"{path.name} is no problem of Bundle Adjustment in the Large"
    try:
        with OPEN.get(path.suffix, open)(path, "rt", encoding="ascii") as file:  # type: ignore[operator]
            words = file.read().split()
    except (OSError, EOFError, UnicodeDecodeError) as error:
        raise FileFormatError(f"{what}: {error}") from error
    try:
        V, N, K = (int(word) for word in words[:3])
        numbers = np.array(words[3:], dtype=np.float64)
    except ValueError as error:
        raise FileFormatError(
            f"{what}: it begins with the numbers of cameras, points and observations, then holds numbers "
            f"only ({error})"
        ) from error
    if min(V, N, K) < 1 or len(numbers) != 4 * K + 9 * V + 3 * N:
        raise FileFormatError(
            f"{what}: {V} cameras, {N} points and {K} observations take {4 * K + 9 * V + 3 * N} numbers, "
            f"but {len(numbers)} follow; it may have been cut off"
        )
    observed, rest = numbers[: 4 * K].reshape(K, 4), numbers[4 * K :]
    if not np.isfinite(numbers).all():
        raise FileFormatError(f"{what}: it holds NaN or infinity")
    if (observed[:, :2] < 0).any() or (observed[:, 0] >= V).any() or (observed[:, 1] >= N).any():
        raise FileFormatError(f"{what}: an observation names a camera or a point that does not exist")
    return (V, N, K), observed, rest[: 9 * V].reshape(V, 9), rest[9 * V :].reshape(N, 3)
