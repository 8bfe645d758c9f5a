"""Files of the output folder: matches, the geometry, and the picture with lines."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from factorlab.match.job import Matched
from factorlab.match.precision import corner_places

if TYPE_CHECKING:
    from vision3d.two_view import TwoView

__all__ = ["drawn", "geometry_numbers", "match_files"]


def match_files(done: Matched) -> dict[str, str | bytes]:
    """Names and contents."""
    import cv2

    files: dict[str, str | bytes] = {
        "matches.csv": matches_csv(done),
        "matches.png": cv2.imencode(".png", drawn(done))[1].tobytes(),
    }
    if (numbers := geometry_numbers(done)) is not None:
        from factorlab.compare.table import strict

        files["geometry.json"] = json.dumps(strict(numbers), indent=1, allow_nan=False) + "\n"
    return files


def matches_csv(done: Matched) -> str:
    """One match a row: both ends, the sigma of the second, the error, whether it agrees."""
    shown = done.geometry or done.first
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(("xa_px", "ya_px", "xb_px", "yb_px", "sigma_px", "error_px", "inlier"))
    for k, (a, b) in enumerate(zip(done.pixels_a, done.pixels_b, strict=True)):
        error = f"{shown.errors_px[k]:.4f}" if shown is not None and np.isfinite(shown.errors_px[k]) else ""
        agrees = int(shown.inliers[k]) if shown is not None else ""
        out.writerow((*(f"{v:.4f}" for v in (*a, *b)), f"{done.sigma_px[k]:.4f}", error, agrees))
    return text.getvalue()


def geometry_numbers(done: Matched) -> dict[str, Any] | None:
    """The matrix, its covariance and what follows from it, for a machine."""
    geometry = done.geometry
    if geometry is None:
        return None
    numbers: dict[str, Any] = {
        "kind": geometry.kind,
        "matrix": geometry.matrix.tolist(),
        "cov": None if geometry.cov is None else geometry.cov.tolist(),
        "inliers": geometry.count,
        "matches": len(done.pixels_a),
        "sigma_px": geometry.sigma_px,
        "iterations": geometry.iterations,
        "stopped": geometry.stopped,
        "backend": geometry.backend,
        "log10_false_alarms": done.first.chance_log10 if done.first is not None else None,
    }
    if geometry.kind == "homography":
        places, covs = corner_places(done, geometry)
        numbers["corners_px"] = places.tolist()
        numbers["corners_cov_px2"] = covs.tolist()
    if geometry.two_view is not None:
        numbers |= _motion_numbers(geometry.two_view)
    return numbers


def _motion_numbers(view: TwoView) -> dict[str, Any]:
    return {
        "verdict": view.verdict,
        "b_T_a": view.b_T_a.tolist(),
        "b_T_a_cov": view.cov.tolist(),
        "parallax_rad": view.parallax_rad,
        "rivals": view.rivals.tolist(),
    }


def drawn(done: Matched) -> NDArray[np.uint8]:
    """Both pictures with their matches."""
    from vision3d.features.drawing import draw_matches

    shown = done.geometry or done.first
    nothing = shown is None or done.by_chance
    inliers = np.zeros(len(done.pixels_a), bool) if nothing or shown is None else shown.inliers
    outline = None
    a, b = done.pixels_a, done.pixels_b
    if done.geometry is not None:
        # those that the first pass refused: the second does not match them at all
        refused = done.refused
        a, b = np.vstack([a, refused[:, :2]]), np.vstack([b, refused[:, 2:]])
        inliers = np.concatenate([inliers, np.zeros(len(refused), bool)])
        if done.geometry.kind == "homography":
            outline = corner_places(done, done.geometry)[0]
    return draw_matches(done.a.image, done.b.image, a, b, inliers, outline=outline, most=120)
