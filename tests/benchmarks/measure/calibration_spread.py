"""Monte Carlo of the projection uncertainty: predicted scatter over that of a thousand calibrations."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from measure.figures import Figure
from sequential.manifold.quaternion import rotate
from vision3d.calibrate import Calibration, calibrate, projection_uncertainty
from vision3d.calibrate.uncertainty import pixel_grid, ray_jacobians
from vision3d.views import View

__all__ = ["spread_figures", "views_of"]

GRID = (10, 10)
TURN_GRID = (20, 15)
LENS = "brown5"


def views_of(files: Sequence[Path]) -> tuple[View, ...]:
    """Views of the sample images, found by the default settings."""
    from vision3d.boards import Checkerboard
    from vision3d.calibrate.detection import detect_views
    from vision3d.images import read_images

    return detect_views(read_images(files), Checkerboard(9, 6, 0.025)).views


def spread_figures(files: Sequence[Path], runs: int) -> dict[str, Figure]:
    """Row 3: shares of a 10×10 grid whose ratio of predicted to Monte-Carlo scatter is near 1."""
    truth = calibrate(views_of(files), LENS)
    rng = np.random.default_rng(3)
    pixels, turning = pixel_grid(truth.camera.size, GRID), pixel_grid(truth.camera.size, TURN_GRID)
    rays, others = truth.camera.unproject(pixels), truth.camera.unproject(turning)
    by_turn = [ray_jacobians(truth.camera, some)[0] for some in (rays, others)]
    errors: dict[str, list[np.ndarray]] = {"fixed": [], "freed": []}
    predicted: dict[str, list[np.ndarray]] = {"fixed": [], "freed": []}
    for _ in range(runs):
        fit = calibrate(noisy(truth, rng), LENS, start=truth)
        off = fit.camera.project(rays) - pixels
        turn = np.linalg.lstsq(
            by_turn[1].reshape(-1, 3), (fit.camera.project(others) - turning).ravel(), rcond=None
        )[0]
        errors["fixed"].append(off)
        errors["freed"].append(off - by_turn[0] @ turn)
        for name, kept in predicted.items():
            kept.append(projection_uncertainty(fit, pixels, freed_rotation=name == "freed").std_px ** 2)
    figures = {}
    for name, off in errors.items():
        scatter = np.sqrt(np.mean(np.sum(np.square(off), axis=-1), axis=0))
        ratio = np.sqrt(np.mean(predicted[name], axis=0)) / scatter
        figures |= _figures(name, ratio, runs)
    return figures


def noisy(truth: Calibration, rng: np.random.Generator) -> tuple[View, ...]:
    """The same views with Gaussian noise of the size that the corners have."""
    views = []
    for view, pose in zip(truth.views, truth.poses, strict=True):
        exact = truth.camera.project(rotate(pose[:4], view.points) + pose[4:])
        sigma = truth.sigma_scale * view.sigma_px
        at = exact + sigma[:, None] * rng.standard_normal(exact.shape)
        views.append(View(view.name, view.size, view.points, at, view.ids, sigma))
    return tuple(views)


def _figures(name: str, ratio: np.ndarray, runs: int) -> dict[str, Figure]:
    said = f"{np.nanmin(ratio):.3f} to {np.nanmax(ratio):.3f}, {runs} calibrations; reference 0.97-1.21"
    wide = float(np.mean((ratio > 0.85) & (ratio < 1.15)))
    narrow = float(np.mean((ratio > 0.9) & (ratio < 1.1)))
    stem = f"predicted_over_scatter_{name}_within"
    return {
        f"{stem}_085_115": Figure(wide, "of grid", said, 0.90, None, "higher"),
        f"{stem}_090_110": Figure(narrow, "of grid", said, None, 0.95, "higher"),
    }
