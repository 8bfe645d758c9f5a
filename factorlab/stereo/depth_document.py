"""The report of `factorlab stereo depth`."""

from __future__ import annotations

import numpy as np

from factorlab.report.document import Document, Section, Table
from factorlab.stereo.depth_job import DepthRun
from factorlab.stereo.depth_numbers import accuracy_of, depth_numbers
from factorlab.stereo.depth_verdicts import depth_conclusion, depth_verdicts

__all__ = ["depth_document"]

MATCHERS = {
    "semi-global": "semi-global matching (census and colour, paths in all directions)",
    "sgbm": "OpenCV's SGBM, 5 paths",
    "sgbm-3way": "OpenCV's SGBM, 3 paths",
    "sgbm-hh": "OpenCV's SGBM, 8 paths",
    "bm": "OpenCV's block matching",
}
PAIR_READ = "A point must lie on the same line in both. Where it does not, the pair is not rectified."
DISPARITY_READ = (
    "Left: how far each pixel has moved, near is bright; what was filled in is paler. Right: its "
    "standard deviation where it was matched; little texture, or few neighbours on the same surface, make it "
    "large."
)
MASK_READ = (
    "Green: matched, and confirmed from the right picture. Blue: seen by the left camera only. Orange: "
    "matched, but not confirmed. Right: how much cheaper the best match is than the next."
)
CLOUD_READ = "Matched points in the colours of their pixels, from beside the camera and from above."
GROUND_READ = (
    "Left: height above the ground. Right: the points from the side, those on the ground in orange, the "
    "camera at the left."
)
DEPTH_READ = "Left: depth. Right: its standard deviation over depth; one dot is one matched pixel."
TRUTH_READ = (
    "Left: error of disparity, clipped at ±3 px; grey where the truth is not known. Right: error over "
    "standard deviation of matched pixels beside the normal density; the last bars hold what lies beyond."
)


def depth_document(run: DepthRun, command: str = "") -> Document:
    """Tell what was measured."""
    width, height = run.pair.size
    least, most = run.disparity.range_px
    known = "the cameras are not known" if run.geometry is None else (
        f"focal length {run.geometry.focal_px:.0f} px, baseline {1e3 * run.geometry.baseline_m:.1f} mm"
    )  # fmt: skip
    lead = (
        f"{run.pair.source or run.pair.left_name}: two pictures of {width} by {height} px; {known}; "
        f"{MATCHERS[run.disparity.matcher]}, {least} to {most} px."
    )
    return Document(
        title="Depth from two pictures",
        lead=lead,
        verdicts=tuple(depth_verdicts(run)),
        sections=tuple(_sections(run)),
        numbers=depth_numbers(run),
        command=command,
        conclusion=depth_conclusion(run),
    )


def _sections(run: DepthRun) -> list[Section]:
    from factorlab.report import depth_figures as figures

    found = [Section("The pair", figure=lambda: figures.pair(run), caption=PAIR_READ)]
    if not run.disparity.valid.any():
        return found
    found.append(Section("Disparity", figure=lambda: figures.disparity(run), caption=DISPARITY_READ))
    found.append(Section("What was matched", figure=lambda: figures.mask(run), caption=MASK_READ))
    if run.depth is not None and run.depth.measured.any():
        found.append(Section("Depth", figure=lambda: figures.depth(run), caption=DEPTH_READ))
    if run.cloud is not None and len(run.cloud) > 100:
        found.append(Section("The cloud", figure=lambda: figures.cloud(run), caption=CLOUD_READ))
    if run.ground is not None:
        found.append(Section("The ground", figure=lambda: figures.ground(run), caption=GROUND_READ))
    if run.planes:
        found.append(Section("Planes", table=_planes(run)))
    if accuracy_of(run) is not None:
        found.append(Section("Against the truth", figure=lambda: figures.truth(run), caption=TRUTH_READ))
    return found


def _planes(run: DepthRun) -> Table:
    rows = tuple(
        (
            "ground" if one is run.ground else f"plane {k}", 100 * one.share, one.distance_m,
            1e3 * one.distance_std_m, float(np.degrees(one.tilt_rad())),
            float(np.degrees(one.normal_std_rad)), 1e3 * one.rms_m,
        )
        for k, one in enumerate(run.planes, 1)
    )  # fmt: skip
    return Table(
        (
            "", ("points", "%"), ("distance", "m"), ("σ", "mm"), ("normal from up", "°"),
            ("σ of normal", "°"), ("RMS", "mm"),
        ),
        rows,
    )  # fmt: skip
