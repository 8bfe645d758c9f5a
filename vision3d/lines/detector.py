"""The line that a robot follows: threshold, morphology, centres of rows, offset and heading.

The image is compared with the median round each pixel (or with Otsu's level), what is too narrow is opened
away, and every stripe that begins near the bottom is followed upwards from row to row.  The one that stands
out from the ground on both sides, keeps its width, runs smoothly and far, and has no rivals, is the line; how
far each of these holds is the confidence.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ShapeError
from vision3d.lines.curve import Curve, fit_curve, refine_curve
from vision3d.lines.settings import LineReading, LineSettings, no_line
from vision3d.lines.sharpening import sharpened
from vision3d.lines.stripes import Stripe, find_stripes

__all__ = ["find_line"]

Grey = NDArray[np.uint8]
BROAD = 0.05  # of the width of the image
RIVAL = 0.5  # of the weight of the best stripe, from which on another one casts doubt


def find_line(image: ArrayLike, settings: LineSettings | None = None) -> LineReading:
    """Find the line on the ground in one image.

    Parameters
    ----------
    image : (h, w) grey levels or (h, w, 3) BGR, uint8
    settings : where to look, and for what

    Returns
    -------
    LineReading
        `found` is False where there is none; `reason` then says what was missing.

    Raises
    ------
    ShapeError
        where the array is no image.
    """
    own = settings or LineSettings()
    grey = as_grey(image)
    height, width = grey.shape
    factor = max(1, round(width / own.working_px))
    small, top = _scaled(grey, own, factor)
    if min(small.shape) < 16:
        return no_line(f"the image is too small: {width} by {height} px")
    stripes = find_stripes(small, own)
    rows = small.shape[0]
    middle = (own.middle * (height - 1) + 0.5) / factor - 0.5 - top
    judged = [(stripe, fit_curve(stripe, rows - 1.0, middle)) for stripe in stripes]
    usable = [(stripe, curve) for stripe, curve in judged if curve is not None]
    if not usable:
        return no_line("nothing darker or lighter than the ground reaches from the bottom to the middle")
    scored = [(_parts(stripe, curve, own), stripe, curve) for stripe, curve in usable]
    weights = [_confidence(parts) * stripe.salience for parts, stripe, _ in scored]
    best = int(np.argmax(weights))
    parts, stripe, curve = scored[best]
    rivals = {
        round(2.0 * own_curve.bottom / stripe.width): weight
        for weight, (_, other, own_curve) in zip(weights, scored, strict=True)
        if abs(own_curve.bottom - curve.bottom) > 0.5 * max(stripe.width, other.width)
        and weight > RIVAL * weights[best]
    }
    second = max(rivals.values(), default=0.0) / max(weights[best], 1e-9)
    parts = parts | {"alone": float(np.clip((1.0 - second) / (1.0 - RIVAL), 0.0, 1.0))}
    stripe = sharpened(small, stripe)  # its width and contrast stay as they were judged
    curve = refine_curve(stripe, rows - 1.0, middle, curve)
    return _reading(grey, own, factor, top, stripe, curve, parts, len(rivals))


def as_grey(image: ArrayLike) -> Grey:
    """Grey levels (h, w) of a grey or a BGR image.

    Raises
    ------
    ShapeError
        where the array is neither, or not of bytes.
    """
    pixels: NDArray[Any] = np.asarray(image)
    if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3) or (pixels.ndim == 3 and pixels.shape[2] != 3):
        raise ShapeError(
            f"expected an image (h, w) or (h, w, 3) of uint8; got shape {pixels.shape} of {pixels.dtype}"
        )
    if pixels.ndim == 2:
        return pixels
    import cv2

    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _scaled(grey: Grey, own: LineSettings, factor: int) -> tuple[Grey, int]:
    """The lower part of the image, made smaller, and the row of the small image at which it begins."""
    import cv2

    height, width = (side // factor * factor for side in grey.shape)
    lower = grey[grey.shape[0] - height :, :width]
    small = cv2.resize(lower, None, fx=1 / factor, fy=1 / factor, interpolation=cv2.INTER_AREA)
    top = int(own.top * small.shape[0])
    return np.ascontiguousarray(small[top:]), top


def _parts(stripe: Stripe, curve: Curve, own: LineSettings) -> dict[str, float]:
    """What speaks for a stripe, each 0-1."""

    def ramp(value: float, none: float, full: float) -> float:
        return float(np.clip((value - none) / (full - none), 0.0, 1.0))

    # a thin stripe takes more contrast to be believed: joints of tiles are thin and faint
    wide = min(1.2, float(np.sqrt(stripe.width / (BROAD * stripe.columns))))
    return {
        "reach": ramp(curve.coverage, 0.3, 0.7),
        "contrast": ramp(stripe.contrast * wide / own.contrast, 0.7, 1.5),
        "even width": ramp(curve.width_spread, 0.45, 0.15),
        "smooth": ramp(curve.rms / max(stripe.width, 4.0), 0.35, 0.1),
        "clear ground": ramp(stripe.share_of_edges, 0.1, 0.35),
    }


def _confidence(parts: dict[str, float]) -> float:
    """The weakest part counts most: the product."""
    return float(np.prod(list(parts.values())))


REASONS = {
    "reach": "the stripe does not reach from the bottom to the middle",
    "contrast": "the stripe hardly differs from the ground on both its sides",
    "even width": "the stripe does not keep its width",
    "smooth": "the stripe does not run smoothly",
    "clear ground": "most edges in the lower half belong to other things than this stripe",
    "alone": "other stripes look as much like a line",
}


def _reading(
    grey: Grey,
    own: LineSettings,
    factor: int,
    top: int,
    stripe: Stripe,
    curve: Curve,
    parts: dict[str, float],
    rivals: int,
) -> LineReading:
    """In pixels of the whole image."""
    confidence = _confidence(parts)
    weakest = min(parts, key=lambda name: parts[name])
    reason = REASONS[weakest] if parts[weakest] < 0.7 else ""
    if weakest == "alone" and reason:
        reason = f"{rivals} other stripe{'s look' if rivals > 1 else ' looks'} as much like a line"
    if confidence < own.least_confidence:
        return no_line(reason or "nothing speaks for it clearly", confidence, parts)
    height, width = grey.shape
    cut = height % factor  # rows that do not fill a small one are left out at the top

    def whole(x: Any) -> Any:
        return (x + 0.5) * factor - 0.5

    bottom, middle = float(whole(curve.bottom)), float(whole(curve.middle))
    y_bottom = float(whole(stripe.rows - 1.0 + top)) + cut
    y_middle = float(own.middle * (height - 1))
    seen = np.isfinite(stripe.left)
    y = whole(np.flatnonzero(seen) + top) + cut
    edges = np.column_stack([y, whole(stripe.left[seen]), whole(stripe.right[seen])])
    cov = curve.cov * factor**2
    for array in (edges, cov):
        array.setflags(write=False)
    return LineReading(
        found=True,
        bottom_px=(bottom, y_bottom),
        middle_px=(middle, y_middle),
        cov_px=cov,
        offset=(bottom - 0.5 * (width - 1)) / (0.5 * width),
        heading_rad=float(np.arctan2(middle - bottom, y_bottom - y_middle)),
        confidence=confidence,
        dark=stripe.dark,
        width_px=stripe.width * factor,
        edges_px=edges,
        reason=reason,
        parts=parts,
    )
