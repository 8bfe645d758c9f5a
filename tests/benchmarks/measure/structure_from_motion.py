"""Structure from motion: Balbianello beside COLMAP alone, and rendered desks whose truth is known.

COLMAP alone is `pycolmap.incremental_mapping` with its own defaults on the same pictures in the same run.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import cv2
import numpy as np
from sfm_worlds import CAMERA, rendered_desk

from factorlab.sfm import SfmJob, run_sfm
from measure.figures import Figure, say
from vision3d.sfm import Reconstruction, SfmSettings, from_pycolmap, reconstruct
from vision3d.sfm.alignment import align
from vision3d.sfm.library import colmap

FOCAL_BUNDLER = 518.69
DISTANCE_M = 1.6  # from the cameras to the desk


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    return {**photographs(), **truths(quick=quick)}


def colmap_alone(folder: Path, *, one_camera: bool = True) -> Reconstruction:
    """What COLMAP finds by itself, in the settings of the reference: 1600 px, one camera, CPU."""
    theirs = colmap()
    names = sorted(path.name for path in folder.iterdir() if path.suffix in {".jpg", ".png"})
    options = theirs.FeatureExtractionOptions()
    options.max_image_size = 1600
    mode = theirs.CameraMode.SINGLE if one_camera else theirs.CameraMode.AUTO
    with tempfile.TemporaryDirectory() as scratch:
        database = Path(scratch) / "pictures.db"
        theirs.extract_features(
            database, folder, image_names=names, camera_mode=mode, extraction_options=options,
            device=theirs.Device.cpu,
        )  # fmt: skip
        theirs.match_exhaustive(database, device=theirs.Device.cpu)
        models = theirs.incremental_mapping(database, folder, scratch)
    return from_pycolmap(max(models.values(), key=lambda one: one.num_reg_images()))


def photographs() -> dict[str, Figure]:
    """The five photographs of Balbianello."""
    data = os.environ.get("FACTORLAB_DATA")
    if not data:
        say("without FACTORLAB_DATA the photographs of Balbianello are left out")
        return {}
    folder = Path(data) / "vision" / "balbianello"
    alone = colmap_alone(folder)
    told = f"COLMAP alone {alone.mean_error_px:.3f} px, {len(alone.pixels)} observations"
    rows = {}
    for mapper in ("incremental", "global"):
        done = run_sfm([str(folder)], SfmJob(SfmSettings(mapper=mapper)))
        found, result = done.found, done.adjusted
        focal = found.cameras[0].intrinsics[0]
        sigma = np.sqrt(result.intrinsics_covs[0][0, 0])
        say(
            f"Balbianello, {mapper}: {len(found)} of {done.given}, {len(found.points)} points, "
            f"{len(found.pixels)} observations, f {focal:.1f} ± {sigma:.1f} px (Bundler {FOCAL_BUNDLER})"
        )
        rows |= {
            f"balbianello_{mapper}_placed": Figure(
                len(found), "of 5", f"COLMAP alone {len(alone)}", 5, 5, "higher"
            ),
            f"balbianello_{mapper}_error": Figure(found.mean_error_px, "px", told, 0.26, 0.255),
            f"balbianello_{mapper}_cost_off_colmap": Figure(
                100.0 * abs(result.cost / result.initial_cost - 1.0), "%", "COLMAP 4.2", 0.5, 0.5
            ),
            f"balbianello_{mapper}_focal_off_bundler": Figure(
                100.0 * abs(focal / FOCAL_BUNDLER - 1.0), "%", "Bundler has a camera a picture"
            ),
        }
    return rows


def truths(*, quick: bool) -> dict[str, Figure]:
    """Places of cameras about rendered desks, against the truth, over their distance."""
    errors: dict[str, list[float]] = {name: [] for name in ("known", "calibrated", "global", "COLMAP alone")}
    for seed in range(1 if quick else 3):
        images, truth = rendered_desk(seed)
        with tempfile.TemporaryDirectory() as scratch:
            for name, image in images.items():
                cv2.imwrite(str(Path(scratch) / name), image)
            found = {
                "known": reconstruct(images, camera=CAMERA),
                "calibrated": reconstruct(images),
                "global": reconstruct(images, mapper="global"),
                "COLMAP alone": colmap_alone(Path(scratch)),
            }
        for name, model in found.items():
            errors[name].append(align(model, truth).ate / DISTANCE_M if len(model) == len(truth) else np.inf)
    say("ATE over distance, ppm: " + ", ".join(f"{k} {1e6 * np.median(v):.0f}" for k, v in errors.items()))
    alone = f"COLMAP alone {1e6 * np.median(errors['COLMAP alone']):.0f} ppm"
    return {
        f"rendered_desks_{name}_ate": Figure(1e6 * float(np.median(errors[name])), "ppm", alone, 500.0)
        for name in ("known", "calibrated", "global")
    }
