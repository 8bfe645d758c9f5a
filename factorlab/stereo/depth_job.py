"""The job behind `factorlab stereo depth`: a pair of pictures, its disparity, depth, cloud and ground."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError

if TYPE_CHECKING:
    from factorlab.stereo.depth_pairs import StereoPair
    from vision3d.stereo.back_projection import DepthCloud
    from vision3d.stereo.depth import Depth
    from vision3d.stereo.disparity import Disparity, StereoSettings
    from vision3d.stereo.geometry import PairGeometry
    from vision3d.stereo.pair import Light
    from vision3d.stereo.planes import DepthPlane
    from vision3d.stereo.repetition import Repetition
    from vision3d.stereo.rows import RowCheck

__all__ = ["DepthRun", "DepthSettings", "measure_depth"]

Image = NDArray[np.uint8]
Progress = Callable[[str, int, int], None]
STEPS = 5
SWAPPED_SHARE = 0.2  # of the matches that lie beyond infinity; a few are wrong


@dataclass(frozen=True, slots=True)
class DepthSettings:
    """What is asked for.

    Attributes
    ----------
    stereo : of the matcher
    rectified : the pictures have been rectified with the rig already
    most_m : farther points are left out of the cloud and of planes
    ground : look for planes and the ground
    """

    stereo: StereoSettings
    rectified: bool = False
    most_m: float = float("inf")
    ground: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class DepthRun:
    """What was measured; images and maps are those of the rectified left picture.

    Attributes
    ----------
    pair : the pictures as they came, with what is known of them
    left, right : rectified, (h, w, 3) BGR
    geometry : of the rectified pair; None where no calibration was given
    seconds : by step
    """

    pair: StereoPair
    settings: DepthSettings
    left: Image
    right: Image
    geometry: PairGeometry | None
    rows: RowCheck
    light: Light
    repetition: Repetition
    disparity: Disparity
    depth: Depth | None
    cloud: DepthCloud | None
    planes: tuple[DepthPlane, ...]
    ground: DepthPlane | None
    seconds: dict[str, float] = field(default_factory=dict)


def measure_depth(
    pair: StereoPair, settings: DepthSettings, progress: Progress = lambda *_: None
) -> DepthRun:
    """Rectify, check rows and light, match, and turn disparity into depth, a cloud and planes.

    Raises
    ------
    DataError
        where the pictures are no pair: of different sizes, the same one twice, left and right exchanged.
    """
    from vision3d.stereo.disparity import compute_disparity
    from vision3d.stereo.pair import light_of, require_pair
    from vision3d.stereo.repetition import repetition
    from vision3d.stereo.rows import row_check

    clock = _Clock(progress)
    require_pair(pair.left, pair.right)
    geometry, left, right = _rectified(pair, settings)
    clock.done("rectification")
    turned = geometry is not None and geometry.vertical
    a, b = (_turned(one) if turned else one for one in (left, right))
    rows = row_check(a, b)
    _require_order(pair, rows, 0.0 if geometry is None else geometry.doffs_px, known=geometry is not None)
    clock.done("row check")
    disparity = compute_disparity(a, b, settings.stereo)
    least, most = disparity.range_px
    again = repetition(a, most - least)
    if turned:
        disparity = _disparity_turned(disparity)
    clock.done("matching")
    depth = None if geometry is None else _depth(disparity, geometry)
    clock.done("depth")
    cloud: DepthCloud | None = None
    planes: tuple[DepthPlane, ...] = ()
    ground: DepthPlane | None = None
    if depth is not None and geometry is not None:
        cloud, planes, ground = _solids(depth, geometry, left, settings)
    clock.done("planes")
    return DepthRun(
        pair, settings, left, right, geometry, rows, light_of(*require_pair(a, b)), again, disparity, depth,
        cloud, planes, ground, clock.seconds,
    )  # fmt: skip


class _Clock:
    """How long each step took; tells the progress."""

    def __init__(self, progress: Progress) -> None:
        self.seconds: dict[str, float] = {}
        self._progress, self._began = progress, time.perf_counter()

    def done(self, step: str) -> None:
        now = time.perf_counter()
        self.seconds[step], self._began = now - self._began, now
        self._progress(step, len(self.seconds), STEPS)


def _rectified(pair: StereoPair, settings: DepthSettings) -> tuple[PairGeometry | None, Image, Image]:
    """Geometry and pictures of the rectified pair."""
    from vision3d.stereo.geometry import geometry_of

    if pair.rig is None:
        return None, pair.left, pair.right
    geometry = geometry_of(pair.rig, pair.size, rectified=settings.rectified)
    if geometry.rectification is None:
        return geometry, pair.left, pair.right
    return geometry, *geometry.rectification.images(pair.left, pair.right)


def _turned(image: Image) -> Image:
    """Rows for columns: the pair of a vertical rig as one side by side."""
    return np.ascontiguousarray(image.swapaxes(0, 1))


def _disparity_turned(found: Disparity) -> Disparity:
    maps: dict[str, Any] = {
        name: np.ascontiguousarray(getattr(found, name).T)
        for name in ("map_px", "std_px", "valid", "occluded", "confidence")
    }
    return replace(found, **maps)


def _require_order(pair: StereoPair, rows: RowCheck, doffs_px: float, *, known: bool) -> None:
    """Raise where much of what both pictures see lies behind the cameras, and little would if exchanged.

    Raises
    ------
    DataError
        where the pictures are exchanged.
    """
    if not rows.known or not known:
        return
    behind = float(np.mean(rows.shifts_px + doffs_px < -1.0))
    exchanged = float(np.mean(doffs_px - rows.shifts_px < -1.0))
    if behind > max(SWAPPED_SHARE, 4.0 * exchanged):
        raise DataError(
            f"{100 * behind:.0f} % of the matches lie behind the cameras: {pair.left_name} seems to be the "
            f"right picture and {pair.right_name} the left one; give them the other way round"
        )


def _depth(disparity: Disparity, geometry: PairGeometry) -> Depth:
    """Depth with both parts of its uncertainty."""
    from vision3d.stereo.calibration_error import with_calibration_error
    from vision3d.stereo.depth import depth_of

    depth = depth_of(disparity, geometry.focal_px, geometry.baseline_m, geometry.doffs_px)
    if geometry.rectification is None:
        return depth
    return with_calibration_error(depth, geometry.rectification)


def _solids(
    depth: Depth, geometry: PairGeometry, left: Image, settings: DepthSettings
) -> tuple[DepthCloud, tuple[DepthPlane, ...], DepthPlane | None]:
    """The cloud, its planes and the ground among them."""
    from vision3d.stereo.back_projection import cloud_of
    from vision3d.stereo.planes import find_ground, find_planes

    near = replace(depth, measured=depth.measured & (np.nan_to_num(depth.z_m, nan=np.inf) <= settings.most_m))
    cloud = cloud_of(near, geometry.camera, left)
    if not settings.ground or len(cloud) < 100:
        return cloud, (), None
    planes = find_planes(near, geometry.camera)
    return cloud, planes, find_ground(near, geometry.camera, planes=planes)
