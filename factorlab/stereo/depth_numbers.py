"""What a pair's depth comes to, in numbers: shares, accuracy against a truth, and the keys of report.json."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from factorlab.stereo.depth_job import DepthRun
    from vision3d.stereo.planes import DepthPlane

__all__ = ["Accuracy", "accuracy_of", "depth_numbers", "share_at_edge"]


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Against a true disparity, over the pixels where that is known.

    Attributes
    ----------
    pixels : how many those are
    bad1_all, bad2_all : share off by more than 1 and 2 px, or without a disparity
    bad2_matched : the same of those that were matched
    median_px : of the absolute error of those that were matched
    z_spread : of error / std of matched pixels, by the median: 1 is honest.  A truth in whole numbers adds
        what rounding does to it
    within_2std : share of matched pixels whose error is below two standard deviations
    """

    pixels: int
    bad1_all: float
    bad2_all: float
    bad2_matched: float
    median_px: float
    z_spread: float
    within_2std: float


def accuracy_of(run: DepthRun) -> Accuracy | None:
    """Compare with the truth; None where none is known, or the pictures had to be rectified first."""
    truth = run.pair.truth_px
    if truth is None or truth.shape != run.disparity.map_px.shape:
        return None
    if run.geometry is not None and run.geometry.rectification is not None:
        return None
    known = np.isfinite(truth)
    matched = known & run.disparity.valid
    if not matched.any():
        return None
    with np.errstate(invalid="ignore"):
        error = np.abs(run.disparity.map_px - truth)
        z = error / np.hypot(run.disparity.std_px, _rounding(truth[known]))
        return Accuracy(
            int(known.sum()),
            float((~(error <= 1.0))[known].mean()),
            float((~(error <= 2.0))[known].mean()),
            float((error > 2.0)[matched].mean()),
            float(np.median(error[matched])),
            float(np.median(z[matched]) / 0.6745),
            float((z <= 2.0)[matched].mean()),
        )


def _rounding(truth: Any) -> float:
    """Standard deviation, px, that rounding gave a truth: of whole pixels, or of whole sixteenths."""
    for step in (1.0, 0.5, 0.25, 0.125, 0.0625):
        if np.all(truth % step == 0.0):
            return step / float(np.sqrt(12.0))
    return 0.0


def share_at_edge(run: DepthRun) -> float:
    """Share of the matched pixels whose disparity is one of the two largest that were looked for."""
    valid = run.disparity.valid
    if not valid.any():
        return 0.0
    return float((run.disparity.map_px[valid] >= run.disparity.range_px[1] - 1.5).mean())


def depth_numbers(run: DepthRun) -> dict[str, Any]:
    """Keys of report.json."""
    told: dict[str, Any] = {
        "pair": {
            "left": run.pair.left_name,
            "right": run.pair.right_name,
            "source": run.pair.source,
            "size": list(run.pair.size),
        },
        "rows": {
            "matches": run.rows.count,
            "mean_px": run.rows.mean_px,
            "rms_px": run.rows.rms_px,
            "noise_px": run.rows.noise_px,
            "rectified": run.rows.rectified,
        },
        "light": {"gain": run.light.gain.tolist(), "offset": run.light.offset.tolist()},
        "repetition": run.repetition._asdict(),
        "disparity": _disparity(run),
        "seconds": run.seconds,
    }
    if run.geometry is not None:
        told["geometry"] = {
            "focal_px": run.geometry.focal_px,
            "baseline_m": run.geometry.baseline_m,
            "doffs_px": run.geometry.doffs_px,
            "camera": run.geometry.camera.intrinsics.tolist(),
            "rectified_here": run.geometry.rectification is not None,
            "vertical": run.geometry.vertical,
        }
    if run.depth is not None and run.depth.measured.any():
        told["depth"] = _depth(run)
        told["planes"] = [_plane(one) for one in run.planes]
        told["ground"] = None if run.ground is None else _plane(run.ground)
    accuracy = accuracy_of(run)
    if accuracy is not None:
        told["truth"] = {name: getattr(accuracy, name) for name in accuracy.__slots__}
    return told


def _disparity(run: DepthRun) -> dict[str, Any]:
    found = run.disparity
    told: dict[str, Any] = {
        "matcher": found.matcher,
        "range_px": list(found.range_px),
        "matched": found.density,
        "occluded": float(found.occluded.mean()),
        "at_edge": share_at_edge(run),
    }
    if found.valid.any():
        told["median_px"] = float(np.median(found.map_px[found.valid]))
        told["std_median_px"] = float(np.median(found.std_px[found.valid]))
    return told


def _depth(run: DepthRun) -> dict[str, Any]:
    depth = run.depth
    assert depth is not None  # noqa: S101 - the caller has looked
    z = depth.z_m[depth.measured]
    told: dict[str, Any] = {
        "percentiles_m": dict(
            zip(("1", "5", "50", "95", "99"), np.percentile(z, [1, 5, 50, 95, 99]), strict=True)
        ),
        "std_median_m": float(np.median(depth.std_m[depth.measured])),
        "points": 0 if run.cloud is None else len(run.cloud),
    }
    if depth.systematic_m is not None:
        told["systematic_median_m"] = float(np.nanmedian(depth.systematic_m[depth.measured]))
    return told


def _plane(plane: DepthPlane) -> dict[str, Any]:
    return {
        "normal": plane.normal.tolist(),
        "distance_m": plane.distance_m,
        "distance_std_m": plane.distance_std_m,
        "normal_std_deg": float(np.degrees(plane.normal_std_rad)),
        "tilt_deg": float(np.degrees(plane.tilt_rad())),
        "rms_m": plane.rms_m,
        "share": plane.share,
    }
