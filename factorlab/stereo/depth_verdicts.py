"""What `factorlab stereo depth` finds good or bad, and what to do about it."""

from __future__ import annotations

import numpy as np

from factorlab.report.document import Status, Verdict
from factorlab.stereo.depth_job import DepthRun
from factorlab.stereo.depth_numbers import accuracy_of, share_at_edge

__all__ = ["depth_conclusion", "depth_verdicts"]

ROWS_GOOD, ROWS_BAD = 0.5, 1.0  # px
MANY, SOME = 0.6, 0.25  # share of the pixels that are matched
AT_EDGE = 0.01
REPEATED = 0.2  # of the textured patches
BEHIND = 0.9  # of the matches, where nothing is known of the cameras
HONEST = (0.6, 1.6)


def depth_verdicts(run: DepthRun) -> list[Verdict]:
    """All of them, what is wrong with the pictures first."""
    found = [_rows(run), *_order(run), *_light(run), *_repeated(run), _matched(run), *_edge(run)]
    if run.disparity.valid.any():
        found += [_std(run), *_depth(run), *_ground(run), *_truth(run)]
    return found


def depth_conclusion(run: DepthRun) -> str:
    """The answer in one sentence."""
    share = run.disparity.density
    if not run.rows.rectified:
        return "The pair is not rectified: its rows do not match, and its disparity means nothing."
    if share < SOME:
        return f"Only {100 * share:.0f} % of the pixels could be matched: there is too little to see in them."
    if run.depth is None:
        return f"{100 * share:.0f} % of the pixels have a disparity; a calibration (--calib) makes it depth."
    if not run.depth.measured.any():
        return "No pixel has a depth in front of the cameras; the calibration does not fit the pictures."
    z = run.depth.z_m[run.depth.measured]
    near, middle, far = np.percentile(z, [5, 50, 95])
    std = float(np.median(run.depth.total_std_m[run.depth.measured]))
    return (
        f"{100 * share:.0f} % of the pixels are matched, {near:.2f} to {far:.2f} m away; half-way, at "
        f"{middle:.2f} m, depth is known to {1e3 * std:.0f} mm."
    )


def _rows(run: DepthRun) -> Verdict:
    rows = run.rows
    if not rows.known:
        return Verdict(
            "rows of the matches", None, (0.0, ROWS_GOOD), "WARN", rows.words,
            "make sure that the pictures are rectified, and show the same scene",
        )  # fmt: skip
    status: Status = "PASS" if rows.rms_px <= ROWS_GOOD else "WARN" if rows.rms_px <= ROWS_BAD else "FAIL"
    action = ""
    if status != "PASS":
        action = "rectify them: give the calibration without --rectified"
        if run.geometry is not None and run.geometry.rectification is not None:
            action = "calibrate the rig again: it moved, or the calibration is of other pictures"
        elif run.geometry is not None and not run.settings.rectified:
            action = "the calibration says that these are rectified, and they are not: was it the right one?"
    meaning = rows.words if status != "PASS" else f"rows agree, {rows.count} matches"
    return Verdict("rows of the matches", rows.rms_px, (0.0, ROWS_GOOD), status, meaning, action, "px")


def _order(run: DepthRun) -> list[Verdict]:
    if run.geometry is not None or not run.rows.known:
        return []
    behind = float(np.mean(run.rows.shifts_px < -1.0))
    if behind < BEHIND:
        return []
    return [
        Verdict(
            "order of the pictures", 100 * behind, (0.0, 50.0), "WARN",
            "matches lie farther right in the right picture: left and right may be exchanged",
            "give them the other way round", "%",
        )
    ]  # fmt: skip


def _light(run: DepthRun) -> list[Verdict]:
    if not run.light.differs:
        return []
    gain, offset = float(np.mean(run.light.gain)), float(np.mean(run.light.offset))
    strong = abs(gain - 1.0) > 0.3
    return [
        Verdict(
            "light of the pictures", gain, (0.97, 1.03), "WARN" if strong else "INFO",
            f"left = {gain:.2f} · right {offset:+.0f} levels; brought together before matching",
            "fix exposure and gain of both cameras" if strong else "",
        )
    ]  # fmt: skip


def _repeated(run: DepthRun) -> list[Verdict]:
    again = run.repetition
    if again.share < REPEATED:
        return []
    return [
        Verdict(
            "repeated texture", 100 * again.share, (0.0, 100 * REPEATED), "WARN",
            f"so many patches look the same about {again.period_px:.0f} px farther along their row: matches "
            "may be one period off, and confirm each other",
            "bound the search by --min-disparity and --max-disparity; look at the confidence", "%",
        )
    ]  # fmt: skip


def _matched(run: DepthRun) -> Verdict:
    share = run.disparity.density
    status: Status = "PASS" if share >= MANY else "WARN" if share >= SOME else "FAIL"
    hidden = 100 * float(run.disparity.occluded.mean())
    meaning = f"confirmed from both pictures; {hidden:.0f} % are seen by one camera only"
    action = "" if status == "PASS" else "look at the mask: is there texture, and do both cameras see it?"
    if status == "FAIL":
        meaning = "nearly nothing looks the same in both: no texture, a repeated one, or no pair"
    return Verdict("matched pixels", 100 * share, (100 * MANY, 100.0), status, meaning, action, "%")


def _edge(run: DepthRun) -> list[Verdict]:
    share = share_at_edge(run)
    if share <= AT_EDGE:
        return []
    least, most = run.disparity.range_px
    return [
        Verdict(
            "at the end of the search", 100 * share, (0.0, 100 * AT_EDGE), "WARN",
            f"disparities were looked for from {least} to {most} px; nearer things are not found",
            f"--max-disparity {2 * most - least}", "%",
        )
    ]  # fmt: skip


def _std(run: DepthRun) -> Verdict:
    std = run.disparity.std_px[run.disparity.valid]
    low, high = np.percentile(std, [5, 95])
    return Verdict(
        "σ of disparity", float(np.median(std)), None, "INFO",
        f"median of the matched pixels; {low:.2f} to {high:.2f} px for nine in ten", unit="px",
    )  # fmt: skip


def _depth(run: DepthRun) -> list[Verdict]:
    depth = run.depth
    if depth is None:
        return []
    if not depth.measured.any():
        return [
            Verdict(
                "depth", None, None, "FAIL", "every disparity lies beyond infinity",
                "the calibration does not belong to these pictures, or doffs is missing",
            )
        ]  # fmt: skip
    z, std = (values[depth.measured] for values in (depth.z_m, depth.std_m))
    middle, spread = float(np.median(z)), float(np.median(std))
    near, far = (float(v) for v in np.percentile(z, [5, 95]))
    found = [
        Verdict(
            "depth", middle, (near, far), "INFO",
            f"median; 5 to 95 % of the pixels in brackets; σ of a match {1e3 * spread:.0f} mm",
            unit="m",
        )
    ]  # fmt: skip
    if depth.systematic_m is not None:
        common = float(np.nanmedian(depth.systematic_m[depth.measured]))
        found.append(
            Verdict(
                "σ of depth from the calibration", 1e3 * common, None, "INFO",
                "shared by all points of a region: averaging does not take it away", unit="mm",
            )
        )  # fmt: skip
    return found


def _ground(run: DepthRun) -> list[Verdict]:
    if run.depth is None or not run.settings.ground:
        return []
    if run.ground is None:
        return [Verdict("ground", None, None, "INFO", "no level plane large enough is in view")]
    height, spread = run.ground.distance_m, 1.96 * run.ground.distance_std_m
    return [
        Verdict(
            "camera above the ground", height, (height - spread, height + spread), "INFO",
            f"{100 * run.ground.share:.0f} % of the points lie on it, {1e3 * run.ground.rms_m:.0f} mm RMS; "
            f"its normal is {np.degrees(run.ground.tilt_rad()):.1f}° from the camera's up", unit="m",
        )
    ]  # fmt: skip


def _truth(run: DepthRun) -> list[Verdict]:
    accuracy = accuracy_of(run)
    if accuracy is None:
        return []
    status: Status = "PASS" if accuracy.bad2_all <= 0.15 else "WARN" if accuracy.bad2_all <= 0.3 else "FAIL"
    honest = HONEST[0] <= accuracy.z_spread <= HONEST[1]
    return [
        Verdict(
            "off by more than 2 px", 100 * accuracy.bad2_all, (0.0, 15.0), status,
            f"of all {accuracy.pixels} pixels with a known disparity, filled ones too; "
            f"{100 * accuracy.bad2_matched:.1f} % of the matched ones", unit="%",
        ),
        Verdict(
            "error / σ", accuracy.z_spread, HONEST, "PASS" if honest else "WARN",
            f"spread over the matched pixels, 1 is honest; median error {accuracy.median_px:.2f} px",
        ),
    ]  # fmt: skip
