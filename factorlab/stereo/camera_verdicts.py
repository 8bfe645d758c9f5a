"""What the two cameras of a rig are worth, and what they see together, in verdicts."""

from __future__ import annotations

import numpy as np

from factorlab.camera.fitting import Fitted
from factorlab.camera.verdicts import judged
from factorlab.report.document import Status, Verdict
from factorlab.stereo.calibrated import CalibratedStereo

__all__ = ["camera_verdicts"]

SIDES = ("left", "right")
GOOD_DEPTH, FAIR_DEPTH = 0.005, 0.02  # σ of a depth from the rig alone at the boards' distance, relative
GOOD_FOCAL, FAIR_FOCAL = 0.002, 0.01  # σ of a focal length, relative
GOOD_OVERLAP, FAIR_OVERLAP = 0.6, 0.3  # share of the rectified image that both cameras fill


def camera_verdicts(done: CalibratedStereo) -> list[Verdict]:
    """Lenses and focal lengths, depths, the common image, and where the board was not held."""
    return [*_cameras(done), _depth(done), _overlap(done), *_coverage(done)]


def _cameras(done: CalibratedStereo) -> list[Verdict]:
    """Lens, focal length and fold of either camera."""
    fit = done.calibration
    found = []
    for side, camera, std, alone in zip(
        SIDES, (fit.rig.left, fit.rig.right), fit.camera_stds, done.fitted, strict=True
    ):
        fx, fy = camera.intrinsics[:2]
        values = f"fx = {fx:.2f} ± {std[0]:.2f} px, fy = {fy:.2f} ± {std[1]:.2f} px (1σ)"
        if not std.any():
            held = "as given" if alone is None else "calibrated alone"
            meaning = f"{camera.lens}, {held} and held: fx = {fx:.2f} px, fy = {fy:.2f} px"
            found.append(
                Verdict(f"{side} camera", None, None, "INFO", f"{meaning}; σ below leave its own out")
            )
            continue
        relative = float(max(std[0] / fx, std[1] / fy))
        fold = camera.check_monotonic()
        why = _why(camera.lens, alone)
        status = "FAIL" if fold.inside else judged(relative, GOOD_FOCAL, FAIR_FOCAL)
        meaning = f"{values}; lens {camera.lens}{why}" + (f"; {fold}" if fold.inside else "")
        action = "" if status == "PASS" else "tilt the board by 30 to 45° to every side, and come near"
        metric = f"{side} camera, σ of the focal length"
        found.append(Verdict(metric, 100 * relative, None, status, meaning, action, "%"))
    return found


def _why(lens: str, alone: Fitted | None) -> str:
    """Why this lens."""
    if alone is None or alone.choice is None:
        return ""
    if alone.choice.chosen == lens:
        return f"; {alone.choice.why}"
    return (
        f", as the other camera: rows of left-out pairs lie nearer together than with {alone.choice.chosen}"
    )


def _depth(done: CalibratedStereo) -> Verdict:
    depths, std = done.depth_spread
    at = done.distance_m
    relative = float(np.interp(at, depths, std)) / at
    status = judged(relative, GOOD_DEPTH, FAIR_DEPTH)
    far = float(np.interp(10 * at, depths, std))
    meaning = (
        f"of a depth of {at:.2f} m in the middle of the image, from the rig alone; at {10 * at:.1f} m it is "
        f"{100 * far / (10 * at):.2g} %"
    )
    action = "" if status == "PASS" else "more pairs, also from farther away; a longer baseline"
    return Verdict("σ of a depth", 100 * relative, None, status, meaning, action, "%")


def _overlap(done: CalibratedStereo) -> Verdict:
    """How much of a rectified image both cameras fill."""
    pair = done.rectification
    x0, y0, x1, y1 = pair.valid
    width, height = pair.size
    share = max(0, x1 - x0 + 1) * max(0, y1 - y0 + 1) / (width * height)
    ratio = pair.focal_px / float(np.mean(done.calibration.rig.left.intrinsics[:2]))
    status: Status = "PASS" if share >= GOOD_OVERLAP else "WARN" if share >= FAIR_OVERLAP else "FAIL"
    meaning = (
        f"rectified without black borders ({width}x{height}, focal length {pair.focal_px:.1f} px, "
        f"{ratio:.2f} times the left camera's)"
    )
    if ratio > 2.0 and status == "PASS":
        status = "WARN"
    action = "" if status == "PASS" else "turn the cameras parallel, or rectify with --alpha 1 and crop"
    return Verdict("rectified image in use", 100 * share, None, status, meaning, action, "%")


def _coverage(done: CalibratedStereo) -> list[Verdict]:
    """What the views of either camera lack."""
    from vision3d.calibrate import coverage

    found = []
    for side, alone in zip(SIDES, done.fitted, strict=True):
        if alone is None:
            continue
        seen = coverage(alone.calibration)
        status: Status = "PASS" if not seen.advice else "WARN"
        meaning = "share of the image with corners"
        found.append(
            Verdict(f"{side} coverage", 100 * seen.image, None, status, meaning, "; ".join(seen.advice), "%")
        )
    return found
