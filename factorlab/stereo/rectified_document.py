"""The page of rectified pairs: how well rows agree, what of the images is used, and the pairs to look at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from factorlab.camera.verdicts import judged
from factorlab.report.document import Document, Section, Status, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vision3d.stereo.rectification import Rectification
    from vision3d.stereo.rectify_files import Rectified

__all__ = ["RectifyJob", "rectified_document", "rectified_files"]

GOOD_ROWS, FAIR_ROWS = 0.7, 2.0  # px, that rows of features are apart
GOOD_USE, FAIR_USE = 0.6, 0.3
SHOWN = 3  # pairs on the page
PAIRS_READ = (
    "Lines go through the same things in both images: on the left the left one, on the right the right."
)


@dataclass(frozen=True, slots=True, eq=False)
class RectifyJob:
    """Rectified pairs, the rectification, the calibration's file, and the folder they stand in."""

    pair: Rectification
    done: Rectified
    calibration: Path
    folder: Path


def rectified_document(job: RectifyJob, command: str = "") -> Document:
    """Everything about the rectified pairs, for the screen, `--json` and the page."""
    pair, count = job.pair, len(job.done.pairs)
    lead = (
        f"{count} pair{'s' if count != 1 else ''} rectified with {job.calibration.name} to "
        f"{pair.size[0]}x{pair.size[1]} px: focal length {pair.focal_px:.2f} px, baseline "
        f"{1e3 * abs(pair.baseline_m):.2f} mm."
    )
    sections = (
        Section("Rectified camera", "", _camera(pair)),
        Section("Pairs to look at", "", None, lambda: _pictures(job), PAIRS_READ),
        Section("Pairs", "", _pairs(job.done), page_only=True),
    )
    return Document(
        "Rectified stereo pairs", lead, tuple(_verdicts(job)), sections, _numbers(job), command=command
    )


def rectified_files(job: RectifyJob) -> dict[str, str | bytes]:
    """The rig of the rectified images, for programs that take pinholes: ours, OpenCV's, Middlebury's."""
    from sequential.errors import ModelError
    from vision3d.stereo.rig_files import rig_texts
    from vision3d.stereo.rig_middlebury import middlebury_text

    rig = job.pair.rig_rectified
    texts: dict[str, str | bytes] = {**rig_texts(rig)}
    try:
        texts["calib.txt"] = middlebury_text(rig)
    except ModelError:  # a vertical rig
        return texts
    return texts


def _verdicts(job: RectifyJob) -> list[Verdict]:
    pair, done = job.pair, job.done
    count, lost = len(done.pairs), len(done.left_out)
    meaning = "all of them" if not lost else "; ".join(str(one) for one in done.left_out[:3])
    found = [
        Verdict(
            "pairs rectified", count, None, "WARN" if lost else "PASS", meaning, unit=f"of {count + lost}"
        )
    ]
    if pair.baseline_m < 0.0:
        meaning = "the calibration's right camera stands on the left: disparities come out negative"
        found.append(
            Verdict("left and right", None, None, "FAIL", meaning, "give the pictures in the other order")
        )
    found += _rows(job)
    x0, y0, x1, y1 = pair.valid
    share = max(0, x1 - x0 + 1) * max(0, y1 - y0 + 1) / (pair.size[0] * pair.size[1])
    status: Status = "PASS" if share >= GOOD_USE else "WARN" if share >= FAIR_USE else "FAIL"
    meaning = f"columns {x0} to {x1} and rows {y0} to {y1} are picture in both"
    found.append(Verdict("image in use", 100 * share, None, status, meaning, "", "%"))
    if pair.rig.joint_cov is not None:
        from vision3d.calibrate import pixel_grid
        from vision3d.stereo.rig_uncertainty import rig_uncertainty

        distance = 20.0 * abs(pair.baseline_m)
        std = rig_uncertainty(pair, pixel_grid(pair.size, (9, 7)), distance).row_std_px
        worst = float(np.nanmax(std))
        meaning = (
            f"from the calibration's covariance, {distance:.2g} m away; {np.nanmedian(std):.2g} px typically"
        )
        action = (
            "" if worst <= GOOD_ROWS else "put the board into the corners of both images, and calibrate again"
        )
        found.append(
            Verdict("σ of rows, worst", worst, None, judged(worst, GOOD_ROWS, 3.0), meaning, action, "px")
        )
    return found


def _rows(job: RectifyJob) -> list[Verdict]:
    """What features in the pictures say."""
    checks = [(one.name, one.rows) for one in job.done.pairs if one.rows is not None]
    known = [(name, rows) for name, rows in checks if rows.is_known]
    kind = "columns" if job.pair.axis else "rows"
    metric = f"{kind} of features apart"
    if not known:
        meaning = "too few features match between left and right to say: little texture, or not of one scene"
        return [Verdict(metric, None, None, "WARN", meaning, "look at the pictures in rows/")]
    offsets = np.array([rows.offset_px for _, rows in known])
    spreads = np.array([rows.spread_px for _, rows in known])
    size = float(np.sqrt(np.mean(offsets**2 + spreads**2)))
    worst = int(np.argmax(np.abs(offsets)))
    meaning = (
        f"RMS over features matched in {len(known)} pairs; the median offset is {np.median(offsets):+.2f} "
        f"px, the largest {offsets[worst]:+.2f} px in {known[worst][0]}"
    )
    tilt = float(np.median([rows.tilt[0] for _, rows in known]))
    status = judged(size, GOOD_ROWS, FAIR_ROWS)
    action = ""
    if status != "PASS":
        turn = f" (the right picture is turned by {np.degrees(tilt):+.2f}°)" if abs(tilt) > 2e-3 else ""
        action = (
            f"this calibration does not fit these pictures{turn}: the rig was bent, or it is another one's"
        )
    found = [Verdict(metric, size, None, status, meaning, action, "px")]
    swapped = [name for name, rows in known if rows.disparity_px[1] < -1.0]
    if swapped and job.pair.baseline_m > 0.0:
        meaning = f"everything in {', '.join(swapped[:3])} has moved the wrong way"
        found.append(
            Verdict("left and right", None, None, "FAIL", meaning, "give the pictures in the other order")
        )
    return found


def _camera(pair: Rectification) -> Table:
    rows: tuple[tuple[str, float, str], ...] = (
        ("focal length", pair.focal_px, "px"),
        ("cx left", float(pair.left.intrinsics[2]), "px"),
        ("cx right", float(pair.right.intrinsics[2]), "px"),
        ("cy left", float(pair.left.intrinsics[3]), "px"),
        ("cy right", float(pair.right.intrinsics[3]), "px"),
        ("doffs", pair.doffs_px, "px"),
        ("baseline", 1e3 * pair.baseline_m, "mm"),
    )
    return Table(("constant", "value", "unit"), rows, digits=7, caption="depth = f B / (disparity + doffs)")


def _pairs(done: Rectified) -> Table:
    rows = []
    for one in done.pairs:
        known = one.rows if one.rows is not None and one.rows.is_known else None
        low, high = known.disparity_px if known else (None, None)
        told = (known.offset_px, known.spread_px, known.count) if known else (None, None, None)
        rows.append((one.name, one.left.name, one.right.name, *told, low, high))
    headings = (
        "file", "left", "right", ("offset", "px"), ("spread", "px"), "matches", ("disparity from", "px"),
        ("to", "px"),
    )  # fmt: skip
    return Table(headings, tuple(rows))


def _numbers(job: RectifyJob) -> dict[str, Any]:
    from vision3d.stereo.rig_json import rig_record

    pair = job.pair
    return {
        "calibration": str(job.calibration),
        "rectified": rig_record(pair.rig_rectified),
        "left_R_rectified": pair.left_R_rectified.tolist(),
        "right_R_rectified": pair.right_R_rectified.tolist(),
        "focal_px": pair.focal_px,
        "doffs_px": pair.doffs_px,
        "baseline_signed_m": pair.baseline_m,
        "vertical": bool(pair.axis),
        "valid": list(pair.valid),
        "Q": pair.Q.tolist(),
        "pairs": [_pair(one) for one in job.done.pairs],
        "left_out": [{"pair": one.name, "reason": one.reason} for one in job.done.left_out],
    }


def _pair(one: Any) -> dict[str, Any]:
    rows = one.rows
    own: dict[str, Any] = {"name": one.name, "left": str(one.left), "right": str(one.right)}
    if rows is not None:
        own["rows"] = {
            "offset_px": rows.offset_px, "spread_px": rows.spread_px, "tilt": list(rows.tilt),
            "matches": rows.count, "disparity_px": list(rows.disparity_px),
        }  # fmt: skip
    return own


def _pictures(job: RectifyJob) -> Figure | None:
    from factorlab.report.stereo_pictures import rectified_pairs
    from vision3d.images import read_image

    chosen = job.done.pairs[:: max(1, len(job.done.pairs) // SHOWN)][:SHOWN]
    images = [
        (one.name, read_image(job.folder / "left" / one.name), read_image(job.folder / "right" / one.name))
        for one in chosen
    ]
    return rectified_pairs(images, job.pair.axis, job.pair.valid)
