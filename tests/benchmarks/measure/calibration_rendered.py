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
FIRST = 40


class Trial(NamedTuple):
    """One set: (estimate − truth) / σ of four parameters, corner errors (px, RMS), views found."""

    z: np.ndarray
    corner_rms: float
    used: int


def trial(seed: int) -> Trial:
    """Render, find, calibrate."""
    from vision3d.calibrate import calibrate
    from vision3d.calibrate.detection import detect_views
    from vision3d.render import render_set

    rng = np.random.default_rng(7000 + seed)
    rendered = render_set(TRUTH, BOARD, VIEWS, rng)
    views = detect_views(rendered.named(), BOARD, workers=1).views
    truth = dict(zip((name for name, _ in rendered.named()), rendered.corners, strict=True))
    off = np.concatenate([view.pixels - truth[view.name][view.ids] for view in views])
    fit = calibrate(views, TRUTH.lens)
    z = (fit.camera.intrinsics - TRUTH.intrinsics) / fit.std[:4]
    return Trial(z, float(np.sqrt(np.mean(off**2))), len(views))


def rendered_figures(count: int) -> dict[str, Figure]:
    """Row 2."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        trials = list(pool.map(trial, range(count)))
    z = np.array([one.z for one in trials])
    rms = np.sqrt(np.mean(z**2, axis=0))
    first = np.sqrt(np.mean(z[:FIRST] ** 2, axis=0))
    found = sum(one.used for one in trials)
    figures = {
        "rendered_corner_error": Figure(
            float(np.sqrt(np.mean([one.corner_rms**2 for one in trials]))),
            "px",
            "a coordinate; cornerSubPix 5x5 0.039",
        ),
        "rendered_views_found": Figure(found / (VIEWS * count), "", f"of {VIEWS * count}", better="higher"),
    }
    for k, name in enumerate(NAMES):
        said = f"{rms[k]:.3f} over {count} sets; cv2 with 5x5 0.77-1.19"
        figures[f"rendered_z_{name}"] = Figure(float(rms[k]), "", said)
        del said
    return figures | {
        f"rendered_z_largest_{min(FIRST, count)}": Figure(float(first.max()), "", "of fx, fy, cx, cy", 1.35),
        f"rendered_z_smallest_{min(FIRST, count)}": Figure(float(first.min()), "", "", 0.75, None, "higher"),
        f"rendered_z_largest_{count}": Figure(float(rms.max()), "", "of fx, fy, cx, cy", 1.35, 1.2),
        f"rendered_z_smallest_{count}": Figure(float(rms.min()), "", "", 0.75, 0.85, "higher"),
    }
