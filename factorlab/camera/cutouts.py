"""What the detector saw, to look at: pixels about doubtful corners, and every picture, small."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from factorlab.camera.calibrated import CalibratedCamera

__all__ = ["Cutout", "Thumbnail", "cutouts_of", "thumbnails_of"]

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
MOST_CUTOUTS, MOST_THUMBNAILS = 12, 36
WIDE = 260  # px of a small picture


@dataclass(frozen=True, slots=True, eq=False)
class Cutout:
    """Pixels about a corner.

    Parameters
    ----------
    image : (h, w), whose top left pixel is the pixel `origin` (2,) of the picture
    found, predicted : (2,) px in the picture, by the detector and by the calibrated camera
    window : half-width of the refinement, px
    doubtful : something is wrong with it
    """

    label: str
    image: Picture
    origin: tuple[int, int]
    found: Array
    predicted: Array
    window: float
    doubtful: bool


@dataclass(frozen=True, slots=True, eq=False)
class Thumbnail:
    """A picture, small, with its corners (N, 2) in its own pixels; none where no board was found."""

    label: str
    image: Picture
    pixels: Array


def cutouts_of(done: CalibratedCamera) -> tuple[Cutout, ...]:
    """Corners left out, carried off by a window or suspicious; else those with the largest residuals."""
    fit, images = done.calibration, dict(done.pictures.images)
    audits = {audit.name: audit for audit in done.detections.audits}
    doubtful: dict[tuple[int, int], str] = {}
    for k, view in enumerate(fit.views):
        audit = audits[view.name]
        doubtful |= {(k, i): f"moved {px:.1f} px" for i, px in audit.moved}
        doubtful |= {(k, i): "suspicious" for i in audit.suspicious if (k, i) not in doubtful}
    doubtful |= {corner: doubtful.get(corner, "left out") for corner in fit.outliers}
    pairs = zip(fit.residuals, done.sigmas, strict=True)
    sizes = [np.linalg.norm(residuals, axis=1) / sigma for residuals, sigma in pairs]
    ranked = sorted(
        ((float(sizes[k][n]), k, n) for k in range(len(sizes)) for n in range(len(sizes[k]))), reverse=True
    )
    chosen = [(k, n) for _, k, n in ranked if (k, int(fit.views[k].ids[n])) in doubtful][:MOST_CUTOUTS]
    chosen = chosen or [(k, n) for _, k, n in ranked[:6]]
    made = []
    for k, n in chosen:
        view, corner = fit.views[k], int(fit.views[k].ids[n])
        remark = doubtful.get((k, corner), "")
        label = f"{view.name} ({_column_row(done, corner)})\n{remark or f'{sizes[k][n]:.1f}σ'}"
        window = float(audits[view.name].window_px[n])
        image, origin = _around(images[view.name], view.pixels[n], window)
        predicted = view.pixels[n] - fit.residuals[k][n]
        made.append(Cutout(label, image, origin, view.pixels[n], predicted, window, bool(remark)))
    return tuple(made)


def _around(image: Picture, place: Array, window: float) -> tuple[Picture, tuple[int, int]]:
    """Pixels about a place, and which of the image is their first."""
    half = int(np.clip(np.ceil(1.8 * max(window, 4.0)), 8, 30))
    middle = np.round(place).astype(int)
    height, width = image.shape
    left, top = (int(np.clip(middle[i] - half, 0, (width, height)[i] - 1)) for i in (0, 1))
    right, bottom = (int(np.clip(middle[i] + half + 1, 1, (width, height)[i])) for i in (0, 1))
    return image[top:bottom, left:right], (left, top)


def _column_row(done: CalibratedCamera, corner: int) -> str:
    columns = max(1, done.settings.board.shape[0])
    return f"{corner % columns}, {corner // columns}"


def thumbnails_of(done: CalibratedCamera) -> tuple[Thumbnail, ...]:
    """Every picture, those without a board first, at most a few dozen."""
    import cv2

    found = {view.name: view for view in done.detections.views}
    missed = {one.name for one in done.detections.missed}
    rms = {
        view.name: float(px)
        for view, px in zip(done.calibration.views, done.calibration.view_rms, strict=True)
    }
    made = []
    for name, image in sorted(done.pictures.images, key=lambda pair: pair[0] not in missed)[:MOST_THUMBNAILS]:
        scale = min(1.0, WIDE / image.shape[1])
        small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        pixels = (found[name].pixels + 0.5) * scale - 0.5 if name in found else np.zeros((0, 2))
        label = f"{name}: {rms[name]:.2f} px" if name in rms else f"{name}: no board"
        made.append(Thumbnail(label, np.asarray(small, dtype=np.uint8), pixels))
    return tuple(made)
