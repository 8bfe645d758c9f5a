"""Pairs of pictures with what is known of them: from files, of scikit-image's wheel, or rendered."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError, ShapeError

if TYPE_CHECKING:
    from vision3d.stereo.rig import StereoRig

__all__ = ["MOTORCYCLE", "StereoPair", "demo_pair", "pair_from_files", "read_truth", "rendered_pair"]

Image = NDArray[np.uint8]
# f, cx, cy, cx of the right image (px), baseline (m): Middlebury 2014, Scharstein et al., at a quarter size
MOTORCYCLE = (994.978, 311.193, 254.877, 311.193 + 31.086, 0.193001)


@dataclass(frozen=True, slots=True, eq=False)
class StereoPair:
    """Two pictures.

    Attributes
    ----------
    left, right : (h, w, 3) BGR uint8
    rig : that took them; None where nobody knows
    truth_px : (h, w) disparity that is known to be right, NaN where it is not known
    source : what they are, in words
    """

    left_name: str
    right_name: str
    left: Image
    right: Image
    rig: StereoRig | None
    truth_px: NDArray[np.float32] | None = None
    source: str = ""

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self.left.shape[1], self.left.shape[0]


def pair_from_files(
    left: str | os.PathLike[str],
    right: str | os.PathLike[str],
    rig: str | os.PathLike[str] | None = None,
    truth: str | os.PathLike[str] | None = None,
    truth_scale: float = 1.0,
) -> StereoPair:
    """Read two pictures, their rig (any format that `read_rig` knows), and a true disparity.

    Raises
    ------
    DataError
        where a file is missing or cannot be read.
    """
    from vision3d.images import read_image
    from vision3d.stereo.rig_files import read_rig

    a, b = (read_image(one, colour=True) for one in (left, right))
    return StereoPair(
        Path(left).name, Path(right).name, a, b,
        None if rig is None else read_rig(rig, size=(a.shape[1], a.shape[0])),
        None if truth is None else read_truth(truth, a.shape[:2], truth_scale),
        f"{Path(left).name} and {Path(right).name}",
    )  # fmt: skip


def read_truth(
    path: str | os.PathLike[str], shape: tuple[int, ...], scale: float = 1.0
) -> NDArray[np.float32]:
    """A disparity (h, w) from .npy, .npz, .pfm or .png, divided by `scale`; 0 and infinity are unknown.

    Raises
    ------
    DataError
        where there is no such file, or it is of another size.
    FileFormatError
        where it cannot be read.
    """
    where = Path(path)
    if not where.is_file():
        raise DataError(f"there is no file {where}; --truth takes a disparity as .npy, .npz, .pfm or .png")
    try:
        values = _numbers(where)
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise FileFormatError(f"{where} cannot be read as a disparity: {error}") from error
    truth = np.asarray(values, dtype=np.float32) / np.float32(scale)
    if truth.shape != tuple(shape):
        raise ShapeError(f"{where} is {truth.shape}, rows by columns, and the left picture {tuple(shape)}")
    with np.errstate(invalid="ignore"):
        truth[~(np.isfinite(truth) & (truth != 0.0))] = np.nan
    return truth


def _numbers(where: Path) -> Any:
    """The array in a file, as it is."""
    import cv2

    if where.suffix == ".npy":
        return np.load(where, allow_pickle=False)
    if where.suffix == ".npz":
        with np.load(where, allow_pickle=False) as held:
            return held[held.files[0]]
    found = cv2.imdecode(np.frombuffer(where.read_bytes(), np.uint8), cv2.IMREAD_UNCHANGED)
    if found is None:
        raise ValueError("it is no picture that OpenCV reads")
    return found if found.ndim == 2 else found[..., 0]


def demo_pair(seed: int = 0) -> StereoPair:
    """Middlebury's motorcycle where scikit-image is installed, a rendered room otherwise; with the truth."""
    try:
        from skimage.data import stereo_motorcycle
    except ImportError:
        return rendered_pair(np.random.default_rng(seed))
    loaded: Any = stereo_motorcycle
    left, right, truth = loaded()
    told = np.where(np.isfinite(truth) & (truth > 0.0), truth, np.nan).astype(np.float32)
    a, b = (np.ascontiguousarray(one[..., ::-1], dtype=np.uint8) for one in (left, right))
    return StereoPair(
        "motorcycle_left", "motorcycle_right", a, b, motorcycle_rig((a.shape[1], a.shape[0])), told,
        "Scikit-image's copy of the motorcycle (Middlebury 2014, a quarter of its size)",
    )  # fmt: skip


def rendered_pair(rng: np.random.Generator, size: tuple[int, int] = (640, 480)) -> StereoPair:
    """A desk with boxes and balls on it, photographed by two parallel cameras; with the truth."""
    from vision3d.camera import Camera
    from vision3d.render import desk, render_stereo
    from vision3d.stereo.rig import StereoRig

    width, height = size
    focal = 0.8 * width
    camera = Camera("pinhole", (focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)), (), size)
    shift = np.array([1.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.0])
    view = render_stereo(camera, camera, shift, desk(rng), rng=rng, colour=True)
    return StereoPair(
        "left", "right", view.left.image, view.right.image, StereoRig(camera, camera, shift),
        view.disparity.astype(np.float32), "A rendered desk",
    )  # fmt: skip


def motorcycle_rig(size: tuple[int, int]) -> StereoRig:
    """The rig of the motorcycle at a quarter of its size."""
    from vision3d.camera import Camera
    from vision3d.stereo.rig import StereoRig

    focal, cx, cy, cx_right, baseline = MOTORCYCLE
    left, right = (Camera("pinhole", (focal, focal, x, cy), (), size) for x in (cx, cx_right))
    return StereoRig(left, right, np.array([1.0, 0.0, 0.0, 0.0, -baseline, 0.0, 0.0]))
