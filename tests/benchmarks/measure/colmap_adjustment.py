"""COLMAP's bundle adjustment of the same observations, with the same loss, from the same start."""

from __future__ import annotations

from time import perf_counter

from vision3d.sfm import Reconstruction, from_pycolmap, to_pycolmap
from vision3d.sfm.library import colmap

LOSSES = {None: "TRIVIAL", "huber": "HUBER", "soft_l1": "SOFT_L1", "cauchy": "CAUCHY"}


def colmap_adjust(
    start: Reconstruction, *, loss: str | None = None, refine: bool = True
) -> tuple[Reconstruction, float, float]:
    """Where COLMAP ends, its final cost in px² and the seconds of its solve."""
    theirs, model = colmap(), to_pycolmap(start)
    options = theirs.BundleAdjustmentOptions()
    options.refine_focal_length = options.refine_extra_params = refine
    options.refine_principal_point = False
    options.print_summary = False
    options.ceres.loss_function_type = getattr(theirs.LossFunctionType, LOSSES[loss])
    options.ceres.loss_function_scale = 1.0
    solver = options.ceres.solver_options
    solver.max_num_iterations, solver.num_threads = 200, 1
    solver.function_tolerance = solver.gradient_tolerance = solver.parameter_tolerance = 1e-12
    config = theirs.BundleAdjustmentConfig()
    for image in model.reg_image_ids():
        config.add_image(image)
    config.fix_gauge(theirs.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    began = perf_counter()
    adjuster = theirs.create_default_ceres_bundle_adjuster(options, config, model)
    summary = adjuster.solve()
    seconds = perf_counter() - began
    return from_pycolmap(model), float(summary.ceres_summary.final_cost), seconds
