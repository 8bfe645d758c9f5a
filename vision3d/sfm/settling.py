"""The last adjustment of a model: gross errors leave, and what is left is fitted robustly.

A mapper keeps every observation within 4 px, which is twenty standard deviations of good features; a few of
them pull at the cameras.  Here what lies beyond eight robust standard deviations goes, and the rest is
adjusted with a soft-L1 loss whose scale is three of them.
"""

from __future__ import annotations

from sequential.errors import NotConvergedError
from vision3d.sfm.colmap import from_pycolmap, to_pycolmap
from vision3d.sfm.library import colmap
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.settings import SfmSettings

__all__ = ["adjusted", "settled", "soft_scale"]

GROSS = 8.0  # standard deviations
SOFT = 3.0
ROUNDS = 2
LEAST_PX = 0.05  # noise below which the numbers of images tell nothing


def settled(found: Reconstruction, settings: SfmSettings) -> Reconstruction:
    """The model without gross errors; cameras that were given stay as they are."""
    soft_px = soft_scale(found)
    for _ in range(ROUNDS):
        found = adjusted(found, soft_px=soft_px, fixed=settings.camera is not None)
        kept = found.errors_px() <= GROSS / SOFT * soft_px
        if kept.all():
            return found
        found = found.selected(kept)
    return adjusted(found, soft_px=soft_px, fixed=settings.camera is not None)


def soft_scale(found: Reconstruction) -> float:
    """The scale of the soft-L1 loss, px: three standard deviations of a pixel coordinate."""
    return SOFT * max(found.sigma_px, LEAST_PX)


def adjusted(found: Reconstruction, *, soft_px: float = 0.0, fixed: bool = False) -> Reconstruction:
    """COLMAP's bundle adjustment of all poses, points and, unless they are fixed, intrinsics.

    Parameters
    ----------
    soft_px : scale of a soft-L1 loss; 0: squares
    fixed : keep the intrinsics

    Raises
    ------
    NotConvergedError
        where there is no solution.
    """
    theirs = colmap()
    options = theirs.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_focal_length = options.refine_extra_params = not fixed
    losses = theirs.LossFunctionType
    options.ceres.loss_function_type = losses.SOFT_L1 if soft_px > 0.0 else losses.TRIVIAL
    options.ceres.loss_function_scale = soft_px or 1.0
    options.ceres.use_gpu = False
    solver = options.ceres.solver_options
    solver.num_threads, solver.max_num_iterations, solver.function_tolerance = 1, 200, 1e-9
    model = to_pycolmap(found)
    scope = theirs.BundleAdjustmentConfig()
    for image in model.reg_image_ids():
        scope.add_image(image)
    scope.fix_gauge(theirs.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    summary = theirs.create_default_bundle_adjuster(options, scope, model).solve()
    if not summary.is_solution_usable():
        raise NotConvergedError(f"the last bundle adjustment failed ({summary.termination_type.name})")
    lenses = {k + 1: camera.lens for k, camera in enumerate(found.cameras)}
    told = from_pycolmap(model, missing=found.missing, lenses=lenses)
    return told.replaced(graph=found.graph)
