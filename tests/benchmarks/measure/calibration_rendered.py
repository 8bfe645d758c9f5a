"""Rendered sets: is the stated σ of fx, fy, cx, cy what the errors are, detector included?"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from measure.figures import Figure
from vision3d.boards import Checkerboard
from vision3d.camera import Camera

__all__ = ["rendered_figures"]

VIEWS = 13
BOARD = Checkerboard(9, 6, 0.025)
TRUTH = Camera("brown5", (532.8, 533.0, 342.5, 233.9), (-0.281, 0.025, 0.0012, -0.0001, 0.163), (640, 480))
NAMES = ("fx", "fy", "cx", "cy")
FIRST, GRID = 40, (10, 10)


class Trial(NamedTuple):
    """One set.

    z : (4,) (estimate − truth) / σ
    corner : corner errors, px, RMS of a coordinate; corner_z : the same over their σ
    projection : errors of the projection over their σ, mean square over a grid of the image
    used : views found
    """

    z: np.ndarray
    corner: float
    corner_z: float
    projection: float
    used: int


def trial(seed: int) -> Trial:
    """Render, find, calibrate."""
    from vision3d.calibrate import calibrate, pixel_grid, projection_uncertainty
    from vision3d.calibrate.detection import detect_views
    from vision3d.render import render_set

    rng = np.random.default_rng(7000 + seed)
    rendered = render_set(TRUTH, BOARD, VIEWS, rng)
    views = detect_views(rendered.named(), BOARD, workers=1).views
    truth = dict(zip((name for name, _ in rendered.named()), rendered.corners, strict=True))
    off = [view.pixels - truth[view.name][view.ids] for view in views]
    relative = [one / view.sigma_px[:, None] for one, view in zip(off, views, strict=True)]
    fit = calibrate(views, TRUTH.lens)
    pixels = pixel_grid(TRUTH.size, GRID)
    apart = np.sum((fit.camera.project(TRUTH.unproject(pixels)) - pixels) ** 2, axis=1)
    expected = projection_uncertainty(fit, pixels).std_px ** 2
    return Trial(
        (fit.camera.intrinsics - TRUTH.intrinsics) / fit.std[:4],
        rms(np.concatenate(off)),
        rms(np.concatenate(relative)),
        float(np.mean(apart / expected)),
        len(views),
    )


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def rendered_figures(count: int) -> dict[str, Figure]:
    """Row 2: over all sets, and over 40; chance spreads the RMS of 40 honest sets by 11 %, of 200 by 5 %."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        trials = list(pool.map(trial, range(count)))
    z = np.array([one.z for one in trials])
    each, first = ({name: rms(part[:, k]) for k, name in enumerate(NAMES)} for part in (z, z[:FIRST]))
    found, total = sum(one.used for one in trials), VIEWS * count
    corner, corner_z = (
        rms(np.array([getattr(one, name) for one in trials])) for name in ("corner", "corner_z")
    )
    projection = float(np.sqrt(np.mean([one.projection for one in trials])))
    said = f"of fx, fy, cx, cy over {count} sets; cv2 with 5x5 window 0.77-1.19, SB 2.8"
    enough = count >= FIRST
    begun = " ".join(f"{name} {value:.2f}" for name, value in first.items())
    figures = {f"rendered_z_{name}": Figure(value, "", "RMS of error / σ") for name, value in each.items()}
    return figures | {
        "rendered_z_largest": Figure(max(each.values()), "", said, 1.35 if enough else None, 1.2),
        "rendered_z_smallest": Figure(min(each.values()), "", said, 0.75 if enough else None, 0.85, "higher"),
        "rendered_z_largest_first_40": Figure(max(first.values()), "", begun, 1.35 if enough else None),
        "rendered_z_smallest_first_40": Figure(
            min(first.values()), "", begun, 0.75 if enough else None, None, "higher"
        ),
        "rendered_projection_z": Figure(projection, "", "RMS of error / σ over a 10x10 grid"),
        "rendered_corner_error": Figure(corner, "px", "RMS of a coordinate; cornerSubPix 5x5 0.030"),
        "rendered_corner_z": Figure(corner_z, "", "RMS of error / σ of a corner"),
        "rendered_views_found": Figure(found, "views", f"of {total}", total, None, "higher"),
    }
