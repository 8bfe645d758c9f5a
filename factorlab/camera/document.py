"""The page of a camera's calibration: verdicts, constants, residuals, views, coverage, maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.camera.calibrated import CalibratedCamera
from factorlab.camera.numbers import numbers_of
from factorlab.camera.verdicts import verdicts_of
from factorlab.report.document import Document, Section, Table

Array = NDArray[np.float64]

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["camera_document"]

FIELD_READ = (
    "Left: every residual, orange where a corner was left out. Right: means over cells; arrows that lie "
    "together in one direction are what the lens model does not follow."
)
SCATTER_READ = (
    "Residuals in units of their σ: circles at 1, 2 and 3σ; a normal distribution is what σ claims."
)
VIEWS_READ = "A bar well above the others is a picture to look at: blur, a bent board, wrong corners."
COVERAGE_READ = (
    "Left: the image needs corners out to its borders. Right: from which side and how obliquely the board "
    "was seen; views in the middle of the circles alone do not tell the focal length."
)
LENSES_TOLD = (
    "Every lens model is fitted to all pictures, and to all but one in turn; the picture left out is then "
    "predicted. Of models that predict equally well (within 1 %), the one with fewest coefficients is taken."
)
DETECTION_TOLD = (
    "Every corner is refined in a window of at most 0.35 of the distance to its neighbour. The scatter about "
    "a smooth surface of each picture's own stands beside what the noise of the pixels alone leads to expect."
)
DIFFERENCE_READ = (
    "The same ray through both cameras, once the second is turned to fit the first best: where the other "
    "camera puts what this one sees."
)
UNCERTAINTY_READ = (
    "Standard deviation of where a direction falls in the image. Left: as an application sees it that trusts "
    "the camera's axes. Right: less the turn of the whole camera that explains most, for one that finds the "
    "camera's pose anew."
)
CUTOUTS_READ = (
    "+ as found, × as predicted, square: the window of the refinement. Doubtful corners where there are any, "
    "the largest residuals otherwise."
)
PICTURES_READ = "Every picture with its corners in their order; the dot is corner 0."


def camera_document(done: CalibratedCamera, command: str = "") -> Document:
    """Everything about a calibration, for the screen, `--json` and the page."""
    fit = done.calibration
    width, height = fit.camera.size
    lead = (
        f"{done.settings.board.name} in {len(fit.views)} of {done.given} pictures of {width}x{height}; lens "
        f"{fit.camera.lens}, {sum(int(one.sum()) for one in done.used)} corners, RMS {fit.rms_px:.3f} px."
    )
    sections, numbers = tuple(_sections(done)), numbers_of(done)
    return Document("Calibration of a camera", lead, verdicts_of(done), sections, numbers, command=command)


def _sections(done: CalibratedCamera) -> list[Section]:
    from factorlab.report import camera_figures as figures
    from factorlab.report import camera_maps as maps

    return [
        Section("Camera", "", _constants(done)),
        *([] if done.choice is None else [Section("Lens models", LENSES_TOLD, _lenses(done))]),
        Section("Residuals over the image", "", None, lambda: figures.residual_field(done), FIELD_READ),
        Section("Residuals and their σ", "", None, lambda: figures.residual_scatter(done), SCATTER_READ),
        Section("Views", "", _views(done), lambda: figures.view_errors(done), VIEWS_READ, page_only=True),
        Section("Detection", DETECTION_TOLD, _detection(done), page_only=True),
        Section("Coverage", "", None, lambda: figures.coverage(done), COVERAGE_READ),
        Section("How sure a projection is", "", None, lambda: maps.uncertainty_map(done), UNCERTAINTY_READ),
        *_compared(done),
        Section("Corners to look at", "", None, lambda: _cutouts(done), CUTOUTS_READ),
        Section("Pictures", "", None, lambda: _thumbnails(done), PICTURES_READ),
    ]


def _detection(done: CalibratedCamera) -> Table:
    """What the audit of every picture says."""
    rows = []
    for audit in done.detections.audits:
        figures = (audit.scatter_px, audit.noise_px, audit.blur_px, 2.0 * audit.contrast)
        known = [float(value) if np.isfinite(value) else None for value in figures]
        doubtful = len(audit.suspicious) + len(audit.moved)
        spans = [_span(values) for values in (audit.spacing_px, audit.window_px)]
        rows.append((audit.name, audit.finder, *spans, *known, doubtful, len(audit.lost)))
    headings = (
        "picture", "found by", ("apart", "px"), ("window, ±", "px"), ("scatter", "px"), ("noise", "px"),
        ("blur", "px"), ("contrast", "grey levels"), "doubtful", "lost",
    )  # fmt: skip
    return Table(headings, tuple(rows))


def _span(values: Array) -> str:
    """From the smallest to the largest, in whole numbers."""
    low, high = f"{values.min():.0f}", f"{values.max():.0f}"
    return low if low == high else f"{low} – {high}"


def _compared(done: CalibratedCamera) -> list[Section]:
    from factorlab.report import camera_maps as maps

    if done.difference is None or done.settings.compare is None:
        return []
    title = f"Difference from {done.settings.compare.name}"
    return [Section(title, "", None, lambda: maps.difference_map(done), DIFFERENCE_READ)]


def _lenses(done: CalibratedCamera) -> Table:
    """Every lens that was tried, the one that was taken marked."""
    assert done.choice is not None  # noqa: S101 - the caller has looked
    rows = []
    for row in done.choice.table:
        remark = "taken" if row.lens == done.choice.chosen else row.remark
        rms = [value if np.isfinite(value) else None for value in (row.train_rms_px, row.held_out_rms_px)]
        rows.append((row.lens, row.coefficients, *rms, remark))
    headings = ("lens", "coefficients", ("RMS", "px"), ("left out", "px"), "")
    return Table(headings, tuple(rows), digits=4)


def _cutouts(done: CalibratedCamera) -> Figure | None:
    from factorlab.camera.cutouts import cutouts_of
    from factorlab.report.camera_pictures import corner_cutouts

    return corner_cutouts(cutouts_of(done))


def _thumbnails(done: CalibratedCamera) -> Figure | None:
    from factorlab.camera.cutouts import thumbnails_of
    from factorlab.report.camera_pictures import thumbnails

    return thumbnails(thumbnails_of(done))


def _constants(done: CalibratedCamera) -> Table:
    fit = done.calibration
    rows = []
    for name, value, std in zip(fit.names, fit.camera.parameters.tolist(), fit.std.tolist(), strict=True):
        unit = "px" if name in ("fx", "fy", "cx", "cy") else ""
        rows.append((name, value, std, value - 1.96 * std, value + 1.96 * std, unit))
    return Table(("constant", "value", "σ", "95 % from", "to", "unit"), tuple(rows), digits=6)


def _views(done: CalibratedCamera) -> Table:
    fit = done.calibration
    rows = []
    for k, view in enumerate(fit.views):
        left_out = int((~done.used[k]).sum())
        held = None if done.cross is None else float(done.cross.view_rms[k])
        rows.append(
            (
                view.name, len(view), left_out, float(fit.view_rms[k]), held,
                float(np.degrees(done.tilts[k])), float(done.distances[k]), "; ".join(view.findings),
            )
        )  # fmt: skip
    headings = (
        "picture", "corners", "left out", ("RMS", "px"), ("predicted", "px"), ("tilt", "°"),
        ("distance", "m"), "remarks",
    )  # fmt: skip
    return Table(headings, tuple(rows))
