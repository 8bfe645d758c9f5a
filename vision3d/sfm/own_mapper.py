"""Our own mapper beside COLMAP's: the same features and matches, everything after them from this package."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vision3d.camera import Camera
from vision3d.sfm.adjustment import adjust
from vision3d.sfm.bundle_problem import bundle_problem, resettled
from vision3d.sfm.colmap import camera_from_pycolmap, camera_to_pycolmap, pixels_from_colmap
from vision3d.sfm.extraction import PictureFeatures
from vision3d.sfm.focal_sweep import sweep_focal
from vision3d.sfm.growing import Adjust, grow, plausible
from vision3d.sfm.growth import GrowthSettings, Scene
from vision3d.sfm.library import colmap
from vision3d.sfm.noise import noise_of
from vision3d.sfm.patience import Patience
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.seeding import verified_pairs
from vision3d.sfm.settings import SfmSettings

if TYPE_CHECKING:
    import pycolmap

__all__ = ["known_cameras", "map_by_growing"]

Integers = NDArray[np.int64]

LEAST = 15  # verified matches of a pair that is looked at
GROSS, SOFT, LEAST_PX = 8.0, 3.0, 0.05  # as in `vision3d.sfm.settling`


def map_by_growing(
    database: Path,
    pictures: Sequence[PictureFeatures],
    settings: SfmSettings,
    patience: Patience,
    progress: Callable[[str, int, int], None],
    *,
    adjust_with: Adjust | None = None,
) -> Reconstruction | None:
    """Grow a model from a matched database; None where none would grow.

    Parameters
    ----------
    database, pictures : features and matches, as COLMAP's mappers take them
    settings : how
    patience, progress : ends the work, and hears of it
    adjust_with : the bundle adjustment; None for our compiled one
    """
    scene, unknown, matches = _scene(database, pictures, settings)
    if unknown.any():
        progress("focal length", 0, 1)
        scene = replace(scene, cameras=sweep_focal(scene, matches, unknown))
    pairs = []
    for k, (pair, rows) in enumerate(sorted(matches.items())):
        progress("motions", k, len(matches))
        patience.check()
        pairs += verified_pairs(scene, {pair: rows})

    def grown(count: int) -> None:
        patience.check()
        progress("growing", count, len(pictures))

    found = grow(scene, pairs, GrowthSettings(seed=settings.seed), adjust=adjust_with, placed=grown)
    return None if found is None else _settled(found, refine=scene.calibrate)


def _scene(
    database: Path, pictures: Sequence[PictureFeatures], settings: SfmSettings
) -> tuple[Scene, NDArray[np.bool_], dict[tuple[int, int], Integers]]:
    """Images and cameras, which focal lengths are guesses, and matches of pairs with a verified geometry."""
    theirs = colmap()
    with theirs.Database.open(database) as opened:
        cameras = sorted((one.camera_id, one) for one in opened.read_all_cameras())
        of_image = {one.image_id: one.camera_id for one in opened.read_all_images()}
        numbers, kept = opened.read_two_view_geometries()
        often = {number: len(one.inlier_matches) for number, one in zip(numbers, kept, strict=True)}
        numbers, rows = opened.read_all_matches()
    row_of = {number: k for k, (number, _) in enumerate(cameras)}
    matches: dict[tuple[int, int], Integers] = {}
    for number, pairs in zip(numbers, rows, strict=True):
        if often.get(number, 0) >= LEAST:
            a, b = theirs.pair_id_to_image_pair(number)
            own = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
            matches[min(a, b) - 1, max(a, b) - 1] = own if a < b else own[:, ::-1]
    lens = "" if settings.camera is None else settings.camera.lens
    scene = Scene(
        names=tuple(one.name for one in pictures),
        cameras=tuple(camera_from_pycolmap(one, lens) for _, one in cameras),
        camera_of=np.array([row_of[of_image[k + 1]] for k in range(len(pictures))], dtype=np.int64),
        pixels=tuple(pixels_from_colmap(one.keypoints[:, :2]) for one in pictures),
        colors=tuple(one.colors for one in pictures),
        calibrate=settings.camera is None,
    )
    return scene, np.array([not one.has_prior_focal_length for _, one in cameras], dtype=bool), matches


def _settled(found: Reconstruction, *, refine: bool) -> Reconstruction:
    """The last adjustment: gross errors leave, and the loss doubts from three standard deviations on."""
    sigma_px = max(noise_of(found), LEAST_PX)
    for last in (False, False, True):
        problem, start = bundle_problem(found, refine=refine)
        solved = adjust(problem, start, loss="soft_l1", loss_px=SOFT * sigma_px)
        moved = resettled(found, problem, solved.state)
        if not all(plausible(camera) for camera in moved.cameras):
            return _settled(found, refine=False)
        found = moved
        if not last:
            found = found.selected(found.errors_px() <= GROSS * sigma_px)
    return found.replaced(sigma_px=noise_of(found))


def known_cameras(database: Path, found: Reconstruction) -> Any:
    """COLMAP's model with nothing but the cameras that were found, by their numbers in the database."""
    theirs = colmap()
    model: pycolmap.Reconstruction = theirs.Reconstruction()
    with theirs.Database.open(database) as opened:
        of_name = {one.name: one.camera_id for one in opened.read_all_images()}
    cameras: dict[int, Camera] = {
        of_name[name]: found.camera(view) for view, name in enumerate(found.names) if name in of_name
    }
    for number, camera in sorted(cameras.items()):
        model.add_camera(camera_to_pycolmap(camera, number))
    return model
