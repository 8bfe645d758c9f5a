"""What `factorlab match` says: verdicts, tables, the pictures, and the same numbers for a machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from factorlab.match.export import drawn, geometry_numbers
from factorlab.match.job import Matched
from factorlab.match.precision import corner_places
from factorlab.match.verdicts import CERTAIN_RIVAL, verdicts
from factorlab.report.document import Cell, Document, Section, Table

if TYPE_CHECKING:
    from factorlab.match.fitting import Geometry
    from vision3d.two_view import TwoView

__all__ = ["match_document"]

LINES_READ = (
    "Green: matches that agree. Orange: those that do not. Yellow: the border of the first picture in the "
    "second, where a homography carries it."
)
CURVES_READ = (
    "A few of the matches that agree, each in its colour, and the curve on which the motion puts it in the "
    "other picture: from the epipole (a cross, where it is in view) to infinitely far."
)
ERRORS_READ = (
    "Left: distances from the model. Right: arrows from where the model has a point to where it was seen."
)
EPIPOLAR_READ = "Left: Sampson's distances. Right: green agree, orange do not."
EACH_LIES = "A few matches that agree; each lies on the line that the other picture's point gives it."
HOMOGRAPHY_READ = (
    "Pixels of the first picture to pixels of the second, (x', y', 1) ~ H (x, y, 1); the centre of the "
    "top-left pixel is (0, 0). The covariance of its nine elements, for unit norm, is in geometry.json."
)
EPIPOLAR_MATRIX = (
    "(x', y', 1) F (x, y, 1)ᵀ = 0 for a point at (x, y) in the first picture and (x', y') in the second."
)


def match_document(done: Matched, command: str = "") -> Document:
    """Everything about two pictures, for the screen, `--json` and the page."""
    found = verdicts(done)
    return Document(
        "Match", _lead(done), tuple(found), tuple(_sections(done)), _numbers(done), command=command,
        conclusion=_conclusion(done),
    )  # fmt: skip


def _lead(done: Matched) -> str:
    sizes = ["x".join(map(str, picture.size)) for picture in (done.a, done.b)]
    asked = done.settings
    return (
        f"{done.a.name} ({sizes[0]} px) and {done.b.name} ({sizes[1]} px): {asked.features} features, "
        f"ratio {asked.ratio:g}, {asked.method} within {asked.threshold_px:g} px."
    )


def _conclusion(done: Matched) -> str:
    shown = done.geometry
    if shown is None:
        return "The pictures share nothing that can be told from chance."
    if done.identical:
        return "The two are the same picture."
    if done.rival is not None and done.rival.share > CERTAIN_RIVAL:
        return f"{shown.count} matches agree, but the texture repeats: which copy is which is a guess."
    what = {
        "homography": "one homography",
        "fundamental": "one fundamental matrix",
        "essential": "one motion",
    }
    return f"{shown.count} matches agree on {what[shown.kind]}, with {shown.sigma_px:.2g} px of error each."


def _sections(done: Matched) -> list[Section]:
    from factorlab.report import match_pictures as figures

    sections = [Section("Matches", figure=lambda: figures.lines(drawn(done)), caption=LINES_READ)]
    geometry = done.geometry
    if geometry is None:
        return sections
    caption = ERRORS_READ if geometry.kind == "homography" else EPIPOLAR_READ
    sections.append(Section("Errors", figure=lambda: figures.errors(done, geometry), caption=caption))
    if geometry.kind == "homography":
        sections += [_homography(geometry), _corners(done, geometry)]
    elif geometry.kind == "fundamental":
        sections.append(
            Section(
                "Epipolar lines", figure=lambda: figures.epipolar_lines(done, geometry), caption=EACH_LIES
            )
        )
        sections.append(_matrix("Fundamental matrix", geometry.matrix, EPIPOLAR_MATRIX))
    elif geometry.two_view is not None and np.isfinite(geometry.two_view.b_T_a).all():
        sections += [_epipolar(done, geometry.two_view), _motion(geometry)]
    sections.append(_times(done))
    return sections


def _epipolar(done: Matched, view: TwoView) -> Section:
    from factorlab.report.epipolar_pictures import epipolar_curves

    def drawn_curves() -> Any:
        if done.a.camera is None or done.b.camera is None:
            return None
        return epipolar_curves(
            (done.a.image, done.b.image), (done.a.camera, done.b.camera), (done.pixels_a, done.pixels_b), view
        )

    return Section("Epipolar curves", figure=drawn_curves, caption=CURVES_READ)


def _homography(geometry: Geometry) -> Section:
    scaled = geometry.matrix / geometry.matrix[2, 2]
    return _matrix("Homography", scaled, HOMOGRAPHY_READ)


def _matrix(heading: str, matrix: Any, text: str) -> Section:
    rows = tuple(tuple(float(v) for v in row) for row in matrix)
    return Section(heading, text, Table(("", " ", "  "), rows, digits=6))


def _corners(done: Matched, geometry: Geometry) -> Section:
    places, covs = corner_places(done, geometry)
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (name, *np.round(place, 2).tolist(), *np.round(np.sqrt(np.diagonal(cov)), 3).tolist())
        for name, place, cov in zip(
            ("top left", "top right", "bottom right", "bottom left"), places, covs, strict=True
        )
    )
    headings = ("corner", ("x", "px"), ("y", "px"), ("σx", "px"), ("σy", "px"))
    return Section(f"Corners of {done.a.name} in {done.b.name}", table=Table(headings, rows, digits=5))


def _motion(geometry: Geometry) -> Section:
    view = geometry.two_view
    if view is None:
        return Section("Motion")
    sigma = np.degrees(np.sqrt(np.diagonal(view.cov)))
    qw = float(np.clip(abs(view.b_T_a[0]), 0.0, 1.0))
    rows: tuple[tuple[Cell, ...], ...] = (
        ("rotation", float(np.degrees(2.0 * np.arccos(qw))), float(np.sqrt((sigma[:3] ** 2).mean()))),
        (
            "direction of x, y, z",
            " ".join(f"{v:.4f}" for v in view.b_T_a[4:]),
            float(np.sqrt((sigma[3:] ** 2).mean())),
        ),
        ("median parallax", float(np.degrees(view.parallax_rad)), None),
    )
    return Section("Motion, b_T_a", view.words, Table(("", ("value", "°"), ("σ", "°")), rows))


def _times(done: Matched) -> Section:
    rows = tuple((name, value) for name, value in done.seconds.items())
    return Section("Time", table=Table(("step", ("time", "s")), rows), page_only=True)


def _numbers(done: Matched) -> dict[str, Any]:
    first = done.first
    return {
        "pictures": [
            {"name": one.name, "size": list(one.size), "features": len(one.features)}
            for one in (done.a, done.b)
        ],
        "kind": done.settings.features,
        "tentative": done.tentative,
        "overlap": first is not None and not done.by_chance,
        "inlier_share": None if first is None or not done.tentative else first.count / done.tentative,
        "log10_false_alarms": None if first is None else first.chance_log10,
        "geometry": geometry_numbers(done),
        "log_odds_of_kind": done.gain if done.other is not None else None,
        "repeated_within": list(done.repeated),
        "repeated": None
        if done.rival is None
        else {
            "share": done.rival.repeated,
            "rival_share": done.rival.share,
            "rival_shift_px": done.rival.shift_px.tolist(),
        },
        "seconds": dict(done.seconds),
    }
