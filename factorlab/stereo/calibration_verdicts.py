"""What a stereo calibration is worth, in verdicts."""

from __future__ import annotations

import numpy as np

from factorlab.camera.verdicts import judged
from factorlab.report.document import Status, Verdict
from factorlab.stereo.calibrated import CalibratedStereo
from factorlab.stereo.camera_verdicts import camera_verdicts

__all__ = ["stereo_verdicts"]

ENOUGH_PAIRS = 8
GOOD_SCATTER, FAIR_SCATTER = 0.5, 1.5  # RMS of residuals, px
GOOD_ROWS, FAIR_ROWS = 0.3, 1.0  # RMS difference of rows, px: matchers look along one row
GOOD_RATIO, FAIR_RATIO = 1.25, 2.0  # rows of left-out pairs over those of fitted ones
GOOD_SQUARE, FAIR_SQUARE = 0.005, 0.02  # side of a square, relative
SCATTERED = 3.2  # scatter of the pairs over that of independent corners
LARGE_M = 5.0  # a baseline that is rather a wrong unit


def stereo_verdicts(done: CalibratedStereo) -> tuple[Verdict, ...]:
    """Pairs, sides, a rig that moved, corners, residuals, rows, squares, uncertainty: as a reader asks."""
    found = [_pairs(done), _sides(done), *_apart(done), _steady(done), *_corners(done), _residuals(done)]
    found += [_rows(done), *_left_out(done), _square(done), *_bend(done), _baseline(done), _agreement(done)]
    found += camera_verdicts(done)
    return tuple(found)


def _pairs(done: CalibratedStereo) -> Verdict:
    """How many took part."""
    used, given = len(done.calibration.whole), done.given
    status: Status = "PASS" if used >= ENOUGH_PAIRS and used == given else "WARN"
    lost = list(done.lost)
    meaning = f"paired {done.pictures.how}; both cameras see the board in every one"
    if used < given and lost:
        more = f" and {len(lost) - 4} more" if len(lost) > 4 else ""
        meaning = f"paired {done.pictures.how}; no board, or no partner: {', '.join(lost[:4])}{more}"
    action = "" if used >= ENOUGH_PAIRS else "take 10 to 20 pairs"
    return Verdict("pairs used", used, None, status, meaning, action, f"of {given}")


def _sides(done: CalibratedStereo) -> Verdict:
    """Whether left is left."""
    rig = done.calibration.rig
    where = ("above", "below") if rig.is_vertical else ("on the left of", "on the right of")
    if rig.is_swapped:
        meaning = (
            f"the camera called right stands {where[0]} the one called left: disparities come out negative"
        )
        return Verdict("left and right", None, None, "FAIL", meaning, "give the two in the other order")
    meaning = f"the right camera stands {where[1]} the left one"
    return Verdict("left and right", None, None, "PASS", meaning)


def _apart(done: CalibratedStereo) -> list[Verdict]:
    """Pairs that the others contradict."""
    found = [
        Verdict("pair that does not belong", None, None, "WARN", f"{one}; it does not count for the rig",
                "exchange them" if one.exchanged else "leave it out, or look at it")
        for one in done.calibration.disagreeing
    ]  # fmt: skip
    if done.calibration.renumbered:
        names = ", ".join(done.calibration.renumbered[:4])
        meaning = f"{names}: the right picture counted the corners from another end; that was mended"
        action = "take a board with an odd and an even number of corners: it has one beginning"
        found.append(Verdict("board counted from two ends", None, None, "INFO", meaning, action))
    return found


def _steady(done: CalibratedStereo) -> Verdict:
    """Whether the rig stayed as it was."""
    found, fit = done.deviations, done.calibration
    if (step := found.step) is not None:
        meaning = (
            f"between {fit.pairs[step.before].name} and {fit.pairs[step.after].name} the cameras moved "
            f"against each other by {np.degrees(step.rotation_rad):.2f}° and "
            f"{1e3 * step.translation_m:.2f} mm"
        )
        action = (
            "fix the cameras to one rigid bar and take the pairs again, or calibrate the two halves apart"
        )
        return Verdict("rig rigid", None, None, "FAIL", meaning, action)
    if found.moved:
        names = ", ".join(fit.pairs[v].name for v in found.moved[:4])
        rows = [k for k, v in enumerate(found.pairs) if v in found.moved]
        turn = float(np.degrees(np.linalg.norm(found.steps[rows, :3], axis=1).max()))
        meaning = (
            f"{names}: their own pose of the cameras is off by up to {turn:.2f}°, more than the scatter of "
            "the others explains: did board or rig move between the two shutters?"
        )
        action = "leave these pairs out and compare; trigger both cameras together, the board at rest"
        return Verdict(
            "rig rigid",
            len(found.moved),
            None,
            "WARN",
            meaning,
            action,
            "pair apart" if len(rows) == 1 else "pairs apart",
        )
    meaning = "every pair alone gives the pose of the cameras that all give together"
    return Verdict("rig rigid", None, None, "PASS", meaning)


def _corners(done: CalibratedStereo) -> list[Verdict]:
    fit = done.calibration
    total, lost = fit.corner_count, len(fit.outliers)
    if not lost:
        return [Verdict("corners left out", 0, None, "PASS", f"noise explains all of {total}")]
    share = lost / total
    status: Status = "PASS" if share <= 0.01 else "WARN" if share <= 0.1 else "FAIL"
    columns = max(1, done.settings.board.shape[0])
    named = []
    for side, pair, corner in fit.outliers:
        view = fit.pairs[pair].left if side == 0 else fit.pairs[pair].right
        named.append(f"{view.name if view else ''} ({corner % columns}, {corner // columns})")
    where = f"{', '.join(named[:6])}{' …' if len(named) > 6 else ''}"
    action = "look at these pictures: glare, a finger, blur" if status != "PASS" else ""
    meaning = f"of {total}, which noise does not explain: {where}"
    return [Verdict("corners left out", lost, None, status, meaning, action)]


def _residuals(done: CalibratedStereo) -> Verdict:
    fit = done.calibration
    status = judged(fit.rms_px, GOOD_SCATTER, FAIR_SCATTER)
    meaning = (
        f"distance of corners from where the rig predicts them, as OpenCV states it, over both images: "
        f"{fit.rms_left_px:.3f} px left, {fit.rms_right_px:.3f} px right"
    )
    action = "" if status == "PASS" else "a flat board, sharp pictures, both taken at the same moment?"
    return Verdict("residual, RMS", fit.rms_px, None, status, meaning, action, "px")


def _rows(done: CalibratedStereo) -> Verdict:
    found = done.measured
    status = judged(found.row_px, GOOD_ROWS, FAIR_ROWS)
    worst = int(np.nanargmax(found.pair_row_px))
    kind = "columns" if done.calibration.rig.is_vertical else "rows"
    meaning = (
        f"how far apart the {kind} of a corner are in the rectified images; worst "
        f"{found.pair_row_px[worst]:.3f} px in {done.calibration.pairs[worst].name}"
    )
    action = "" if status == "PASS" else "look at the pairs with the largest bars below"
    return Verdict(f"rectified {kind} apart, RMS", found.row_px, None, status, meaning, action, "px")


def _left_out(done: CalibratedStereo) -> list[Verdict]:
    held = done.held
    if held is None:
        meaning = "with three pairs or fewer none can be left out to check the others"
        return [Verdict("left-out pairs, rows", None, None, "WARN", meaning, "take 10 to 20 pairs")]
    ratio = held.row_px / max(held.train_row_px, 1e-12)
    status = judged(ratio, GOOD_RATIO, FAIR_RATIO)
    meaning = (
        f"each pair rectified by a rig that has not seen it: {ratio:.2f} times the fitted one; corners "
        f"{held.rms_px:.3f} px from their prediction"
    )
    action = "" if status == "PASS" else "more pairs, the board in every part of both images"
    return [Verdict("left-out pairs, rows, RMS", held.row_px, None, status, meaning, action, "px")]


def _square(done: CalibratedStereo) -> Verdict:
    found = done.measured
    share = abs(found.side_m / found.true_side_m - 1.0)
    status = judged(share, GOOD_SQUARE, FAIR_SQUARE)
    meaning = (
        f"{1e3 * found.side_m:.3f} ± {1e3 * found.side_std_m:.3f} mm: {found.count} distances of "
        f"neighbouring corners, measured by the rig; the board has {1e3 * found.true_side_m:.3f} mm"
    )
    action = "" if status == "PASS" else "is the board flat, and as large as was said?"
    return Verdict("square, triangulated", 1e3 * found.side_m, None, status, meaning, action, "mm")


def _bend(done: CalibratedStereo) -> list[Verdict]:
    """How far the board is bent, where that was estimated."""
    fit = done.calibration
    std = fit.std[-2:]
    if not std.any():
        return []
    axis = int(np.argmax(np.abs(fit.warp) / np.maximum(std, 1e-12)))
    bend, sigma = 1e3 * float(fit.warp[axis]), 1e3 * float(std[axis])
    side = "behind" if bend > 0 else "before"
    meaning = (
        f"± {sigma:.2f} mm: along its {'columns' if axis else 'rows'} the middle of the board stands {side} "
        "its ends; taken into account"
    )
    bent = abs(bend) > 3.0 * sigma
    action = "glue it to a rigid plate" if bent else ""
    return [Verdict("bend of the board", abs(bend), None, "WARN" if bent else "INFO", meaning, action, "mm")]


def _baseline(done: CalibratedStereo) -> Verdict:
    rig = done.calibration.rig
    std = rig.baseline_std_m or 0.0
    size, low, high = rig.baseline_m, rig.baseline_m - 1.96 * std, rig.baseline_m + 1.96 * std
    turn = np.degrees(rig.angle_rad)
    meaning = f"distance of the cameras (σ {1e3 * std:.3f} mm), which are turned by {turn:.2f}° to each other"
    status: Status = "WARN" if size > LARGE_M else "INFO"
    action = (
        "is --square in the right unit?"
        if size > LARGE_M
        else "measure it with a ruler: the scale is the board's"
    )
    return Verdict("baseline", 1e3 * size, (1e3 * low, 1e3 * high), status, meaning, action, "mm")


def _agreement(done: CalibratedStereo) -> Verdict:
    """Whether the pairs ask for one rig."""
    fit = done.calibration
    if fit.inflation <= 1.0 and not fit.report.remarks:
        meaning = "they scatter no more than independent corners do"
        return Verdict("pairs against each other", fit.inflation, None, "PASS", meaning, unit="σ")
    parts = [*fit.report.remarks, *(["every σ told here takes that in"] if fit.inflation > 1.0 else [])]
    status: Status = "INFO" if fit.inflation < SCATTERED else "WARN"
    action = (
        "" if status == "INFO" else "is the board flat, are focus and zoom fixed, is the lens model right?"
    )
    return Verdict("pairs against each other", fit.inflation, None, status, "; ".join(parts), action, "σ")
