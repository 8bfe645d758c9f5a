"""What a camera's calibration is worth, in verdicts."""

from __future__ import annotations

import numpy as np

from factorlab.camera.calibrated import CalibratedCamera
from factorlab.report.document import Status, Verdict

__all__ = ["judged", "verdicts_of"]

GOOD_RATIO, FAIR_RATIO = 1.15, 1.6  # left-out views over fitted ones: good, and still of use
GOOD_FOCAL, FAIR_FOCAL = 0.002, 0.01  # standard deviation of the focal length, relative
STEEP, FLAT = np.radians(25.0), np.radians(12.0)  # largest tilt of the board: good, and too little
GOOD_PLACE, FAIR_PLACE = 0.001, 0.01  # σ of a projection where it is worst, over the image's diagonal
GOOD_SCATTER, FAIR_SCATTER = 0.5, 1.5  # RMS of residuals, px
ENOUGH_VIEWS = 8
CERTAIN, SCATTERED = 3.0, 3.2  # σ of a bend; scatter of the pictures over that of independent corners
TILT_MORE = "tilt the board by 30 to 45° about its vertical and its horizontal axis"


def verdicts_of(done: CalibratedCamera) -> tuple[Verdict, ...]:
    """Pictures, corners, residuals, left-out views, lens, uncertainty, poses: in the order of a reader."""
    found = [_pictures(done), *_window(done), *_corners(done), _residuals(done)]
    found += [
        *_left_out(done),
        *_lens(done),
        *_shape(done),
        _agreement(done),
        _fold(done),
        _focal(done),
        *_projection(done),
    ]
    found += [_tilt(done), _coverage(done), *_following(done), *_apart(done), *_others(done)]
    return tuple(found)


def _pictures(done: CalibratedCamera) -> Verdict:
    """How many took part."""
    used, given = len(done.calibration.views), done.given
    status: Status = "PASS" if used >= ENOUGH_VIEWS and used == given else "WARN"
    lost = list(done.lost)
    meaning = "the board is found in every one"
    if lost:
        meaning = f"not in {', '.join(lost[:4])}{f' and {len(lost) - 4} more' if len(lost) > 4 else ''}"
    action = "" if used >= ENOUGH_VIEWS else "take 10 to 20 pictures"
    return Verdict("pictures used", used, None, status, meaning, action, f"of {given}")


def _window(done: CalibratedCamera) -> list[Verdict]:
    """Whether a forced window is too large for the squares."""
    if (window := done.settings.window) is None:
        return []
    metric = f"corner window ±{window} px"
    large = [audit for audit in done.detections.audits if audit.window_too_large]
    if not large:
        return [
            Verdict(metric, None, None, "PASS", "smaller than 0.35 of the distance of corners everywhere")
        ]
    moved = sum(len(audit.moved) for audit in large)
    farthest = max((px for audit in large for _, px in audit.moved), default=0.0)
    spacing = min(float(audit.spacing_px.min()) for audit in large)
    meaning = (
        f"too large in {len(large)} of {len(done.detections.audits)} pictures, where corners are only "
        f"{spacing:.0f} px apart: it moves {moved} corners by up to {farthest:.1f} px"
    )
    names = ", ".join(audit.name for audit in large if audit.moved)
    action = f"leave --window out{f' (worst: {names})' if names else ''}"
    return [Verdict(metric, moved, None, "FAIL" if moved else "WARN", meaning, action, "corners moved")]


def _corners(done: CalibratedCamera) -> list[Verdict]:
    """Corners that the audit or the fit does not believe."""
    fit = done.calibration
    total, lost = fit.corner_count, len(fit.outliers)
    share = lost / max(total, 1)
    status: Status = "PASS" if share <= 0.01 else "WARN" if share <= 0.1 else "FAIL"
    if not lost:
        return [Verdict("corners left out", 0, None, "PASS", f"noise explains all of {total}")]
    columns = max(1, done.settings.board.shape[0])
    named = [f"{fit.views[k].name} ({i % columns}, {i // columns})" for k, i in fit.outliers]
    where = f"{', '.join(named[:6])}{' …' if len(named) > 6 else ''}"
    meaning = f"of {total}, which noise does not explain: {where}"
    action = "look at their cut-outs in the report: glare, a finger, blur" if status != "PASS" else ""
    return [Verdict("corners left out", lost, None, status, meaning, action)]


def _residuals(done: CalibratedCamera) -> Verdict:
    fit = done.calibration
    status = judged(fit.rms_px, GOOD_SCATTER, FAIR_SCATTER)
    meaning = (
        f"distance from where the camera predicts a corner; σ of a coordinate {fit.sigma_px:.3f} px, "
        f"{fit.sigma_scale:.2f} times what the pixels promise"
    )
    action = "" if status == "PASS" else "a flat board, sharp pictures, no motion; is the lens model right?"
    return Verdict("residual, RMS", fit.rms_px, None, status, meaning, action, "px")


def _left_out(done: CalibratedCamera) -> list[Verdict]:
    if done.cross is None:
        meaning = "with three views or fewer none can be left out to check the others"
        return [Verdict("left-out pictures, RMS", None, None, "WARN", meaning, "take 10 to 20 pictures")]
    ratio = done.cross.rms_px / max(done.cross.train_rms_px, 1e-12)
    status = judged(ratio, GOOD_RATIO, FAIR_RATIO)
    meaning = f"each picture predicted by a camera that has not seen it: {ratio:.3f} times the residual"
    action = "" if status == "PASS" else "more pictures, or a lens with fewer coefficients: this one overfits"
    return [Verdict("left-out pictures, RMS", done.cross.rms_px, None, status, meaning, action, "px")]


def _lens(done: CalibratedCamera) -> list[Verdict]:
    if done.choice is None:
        return []
    return [Verdict("lens model", done.choice.chosen, None, "INFO", done.choice.why)]


def _shape(done: CalibratedCamera) -> list[Verdict]:
    """Whether the board is flat."""
    fit, flat_px = done.calibration, done.fitted.flat_px
    if not fit.warp_std.any():
        return []
    axis = int(np.argmax(np.abs(fit.warp)))
    bend, sigma = 1e3 * float(fit.warp[axis]), 1e3 * float(fit.warp_std[axis])
    meaning = (
        f"± {sigma:.2f} mm: along its {'columns' if axis else 'rows'} the middle of the board stands "
        f"{'behind' if bend > 0 else 'before'} its ends"
    )
    if flat_px is not None:
        meaning += f"; taken into account, since a flat one predicts left-out pictures to {flat_px:.3f} px"
    action = "glue it to a rigid plate" if abs(bend) > CERTAIN * sigma else ""
    return [
        Verdict("bend of the board", abs(bend), None, "WARN" if action else "INFO", meaning, action, "mm")
    ]


def _agreement(done: CalibratedCamera) -> Verdict:
    """Whether the pictures ask for one camera."""
    times, remarks = done.calibration.inflation, done.calibration.report.remarks
    if times <= 1.0 and not remarks:
        meaning = "they scatter no more than independent corners do"
        return Verdict("pictures against each other", times, None, "PASS", meaning, unit="σ")
    meaning = "; ".join((*remarks, *(["every σ told here takes that in"] if times > 1.0 else [])))
    status: Status = "INFO" if times < SCATTERED else "WARN"
    action = (
        "" if times < SCATTERED else "one camera, focus and zoom fixed? A flat board? The right lens model?"
    )
    return Verdict("pictures against each other", times, None, status, meaning, action, "σ")


def _fold(done: CalibratedCamera) -> Verdict:
    fold = done.calibration.camera.check_monotonic()
    if fold.inside:
        action = "put corners into the corners of the image, or take a lens with fewer coefficients"
        return Verdict("distortion", None, None, "FAIL", str(fold), action)
    return Verdict("distortion", None, None, "PASS", str(fold))


def _focal(done: CalibratedCamera) -> Verdict:
    fit = done.calibration
    fx, fy = fit.camera.intrinsics[:2]
    relative = float(max(fit.std[0] / fx, fit.std[1] / fy))
    status = judged(relative, GOOD_FOCAL, FAIR_FOCAL)
    meaning = f"fx = {fx:.2f} ± {fit.std[0]:.2f} px, fy = {fy:.2f} ± {fit.std[1]:.2f} px (1σ)"
    action = "" if status == "PASS" else f"{TILT_MORE}, and come near"
    return Verdict("σ of the focal length", 100 * relative, None, status, meaning, action, "%")


def _projection(done: CalibratedCamera) -> list[Verdict]:
    """How sure a projection is in the middle and where it is worst."""
    std = done.uncertainty.map_px
    worst, middle = float(np.nanmax(std)), float(std[std.shape[0] // 2, std.shape[1] // 2])
    status = judged(worst / float(np.hypot(*done.calibration.camera.size)), GOOD_PLACE, FAIR_PLACE)
    place = done.worst_place
    meaning = f"where the image is least known, {place}; {middle:.2g} px in the middle"
    action = "" if status == "PASS" else f"put the board into the {place}"
    return [Verdict("σ of a projection, worst", worst, None, status, meaning, action, "px")]


def _tilt(done: CalibratedCamera) -> Verdict:
    steepest = float(done.tilts.max())
    status: Status = "PASS" if steepest >= STEEP else "WARN" if steepest >= FLAT else "FAIL"
    meaning = f"the board is tilted by {np.degrees(done.tilts.min()):.0f} to {np.degrees(steepest):.0f}°"
    action = "" if status == "PASS" else TILT_MORE
    return Verdict("largest tilt", float(np.degrees(steepest)), None, status, meaning, action, "°")


def _coverage(done: CalibratedCamera) -> Verdict:
    """How much of the image holds corners, and what the views lack."""
    found = done.coverage
    status: Status = "PASS" if not found.advice else "WARN"
    meaning = "share of the image with corners; its corners, tilts and distances are all there"
    if found.advice:
        meaning = (
            f"share of the image with corners; corners in {4 * found.image_corners:.0f} of its 4 corners"
        )
    return Verdict("coverage", 100 * found.image, None, status, meaning, "; ".join(found.advice), "%")


def _following(done: CalibratedCamera) -> list[Verdict]:
    """Where the board would tell most."""
    if (found := done.following) is None:
        return []
    meaning = (
        f"σ of a projection, RMS over the image, would fall from {found.std_before_px:.2g} to "
        f"{found.std_after_px:.2g} px"
    )
    return [Verdict("most useful next picture", None, None, "INFO", meaning, found.words)]


def _apart(done: CalibratedCamera) -> list[Verdict]:
    """How far the calibration to compare with is."""
    if (found := done.difference) is None or done.settings.compare is None:
        return []
    status: Status = "PASS" if found.sigmas < 2.0 else "WARN" if found.sigmas < 4.0 else "FAIL"
    action = (
        ""
        if status == "PASS"
        else "trust the one whose pictures cover the image, and whose corners are right"
    )
    metric = f"difference from {done.settings.compare.name}, RMS"
    return [Verdict(metric, found.rms_px, None, status, found.words, action, "px")]


def _others(done: CalibratedCamera) -> list[Verdict]:
    """What the detector and the solver say besides."""
    fit = done.calibration
    found = []
    names = [audit.name for audit in done.detections.audits if audit.mirrored]
    if names:
        meaning = f"{', '.join(names[:4])}{' …' if len(names) > 4 else ''} show the board mirrored"
        found.append(Verdict("mirrored pictures", len(names), None, "FAIL", meaning, "flip them back"))
    for text in done.detections.findings:
        if "mirrored against" in text:
            found.append(Verdict("mirrored pictures", None, None, "FAIL", text))
        elif "window" not in text:
            found.append(Verdict("detection", None, None, "INFO", text))
    for view in fit.outlier_views:
        ratio = fit.view_rms[view] / float(np.median(fit.view_rms))
        meaning = f"{fit.views[view].name} fits {ratio:.1f} times worse than the others and counts less"
        action = "look at its corners, or leave it out"
        found.append(Verdict("picture that does not fit", None, None, "WARN", meaning, action))
    return found


def judged(value: float, good: float, fair: float) -> Status:
    """PASS up to good, WARN up to fair."""
    return "PASS" if value <= good else "WARN" if value <= fair else "FAIL"
