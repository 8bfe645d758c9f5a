"""OpenCV's matchers behind the same call: block matching and its semi-global matching."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sequential.errors import DataError
from vision3d.stereo.semi_global import RawDisparity, grey_of

if TYPE_CHECKING:
    from vision3d.stereo.disparity import StereoSettings

__all__ = ["opencv_match"]

BLOCK, BLOCK_BM = 3, 15


def opencv_match(a: Any, b: Any, first: int, last: int, how: StereoSettings) -> RawDisparity:
    """Match a (h, w, c) with b; ranges are rounded up to a multiple of 16 disparities.

    The right picture's disparity comes from a second run on the mirrored pair.

    Raises
    ------
    DataError
        where OpenCV refuses pictures of this size.
    """
    import cv2

    makers: Any = cv2  # the stubs of one of the two versions lack them
    n = -(-(last - first + 1) // 16) * 16
    width = a.shape[1]
    if n + abs(first) >= width:  # OpenCV aborts where the range is wider than the picture
        n = max(16, (width - abs(first) - 1) // 16 * 16)
    channels = a.shape[2]
    modes = {
        "sgbm": cv2.STEREO_SGBM_MODE_SGBM,
        "sgbm-3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
        "sgbm-hh": cv2.STEREO_SGBM_MODE_HH,
    }
    if how.matcher == "bm":
        matcher = makers.StereoBM_create(n, BLOCK_BM)
        matcher.setMinDisparity(first)
        a, b = (grey_of(one)[..., None] for one in (a, b))
    else:
        matcher = makers.StereoSGBM_create(
            first, n, BLOCK, P1=8 * channels * BLOCK**2, P2=32 * channels * BLOCK**2, mode=modes[how.matcher]
        )
    try:
        left = _run(matcher, a, b, first)
        mirrored = _run(matcher, np.ascontiguousarray(b[:, ::-1]), np.ascontiguousarray(a[:, ::-1]), first)
    except cv2.error as error:
        raise DataError(
            f"OpenCV's {how.matcher} cannot match {a.shape[1]}x{a.shape[0]} px over {n} disparities; "
            "take a shorter range, larger pictures, or the matcher semi-global"
        ) from error
    with np.errstate(invalid="ignore"):
        right = np.where(np.isfinite(mirrored), np.round(mirrored), first - 1).astype(np.int32)[:, ::-1]
    return RawDisparity(left, np.ascontiguousarray(right), np.full(left.shape, np.nan, np.float32))


def _run(matcher: Any, a: Any, b: Any, first: int) -> Any:
    """Disparity in pixels, NaN where there is none."""
    fixed = np.asarray(matcher.compute(a, b)).reshape(a.shape[:2])
    return np.where(fixed >= 16 * first, fixed / np.float32(16.0), np.float32(np.nan)).astype(np.float32)
