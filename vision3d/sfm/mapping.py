"""COLMAP's mappers: incremental, and global."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vision3d.sfm.library import colmap
from vision3d.sfm.patience import Patience, Stopped
from vision3d.sfm.settings import SfmSettings

if TYPE_CHECKING:
    import pycolmap

__all__ = ["map_pictures"]

SMALLEST_MODEL = 2
FEWEST_POINTS = 50
SMALL_ANGLE_DEG = 2.0  # between the rays of the first pair, where none has COLMAP's 16


def map_pictures(
    database: Path,
    count: int,
    settings: SfmSettings,
    patience: Patience,
    progress: Callable[[str, int, int], None],
) -> list[pycolmap.Reconstruction]:
    """Models of the pictures in a database, the one with most pictures first; none where none could grow.

    Where the work is ended early, the models hold what had its place by then.
    """
    theirs = colmap()
    with tempfile.TemporaryDirectory(prefix="factorlab-sfm-") as folder:
        if settings.mapper == "global":
            options = _global_options(theirs, settings)
            if count == 2:
                _for_two(options)
            progress("global mapping", 0, 1)

            def solve(_: Any) -> Any:
                theirs.set_random_seed(settings.seed)  # of this thread
                if settings.camera is None:
                    theirs.calibrate_view_graph(database)
                return theirs.global_mapping(database, folder, folder, options)

            models = patience.run(solve)
        else:
            incremental = _incremental_options(theirs, settings)
            if count == 2:
                incremental.triangulation.ignore_two_view_tracks = False
            placed = [2]

            def grown() -> None:
                placed[0] += 1
                progress("growing", min(placed[0], count), count)

            def grow(token: Any) -> Any:
                theirs.set_random_seed(settings.seed)  # of this thread
                return theirs.incremental_mapping(
                    database, folder, folder, incremental, next_image_callback=grown, cancellation_token=token
                )

            snapshots = Path(folder) / "snapshots"
            snapshots.mkdir()
            incremental.snapshot_path, incremental.snapshot_frames_freq = snapshots, 1
            try:
                models = patience.run(grow)
            except Stopped:
                models = _latest(snapshots)
            if not _useful(models) and not patience.over:
                # a drive straight ahead, or a short step: less is asked of the pair to start from
                incremental.mapper.init_max_forward_motion = 1.0
                incremental.mapper.init_min_tri_angle = SMALL_ANGLE_DEG
                incremental.triangulation.ignore_two_view_tracks = False
                placed[0] = 2
                models = patience.run(grow)
    return sorted(_useful(models), key=lambda one: (-one.num_reg_images(), -one.num_points3D()))


def _latest(snapshots: Path) -> dict[int, pycolmap.Reconstruction]:
    """The model as it was before the work was ended; COLMAP names snapshots by their times."""
    whole = sorted(path.parent for path in snapshots.glob("*/points3D.bin"))
    return {0: colmap().Reconstruction(whole[-1])} if whole else {}


def _useful(models: dict[int, pycolmap.Reconstruction]) -> list[pycolmap.Reconstruction]:
    """Those with points: pictures taken on the spot come back with poses and without."""
    return [one for one in models.values() if one.num_points3D() >= FEWEST_POINTS]


def _incremental_options(theirs: Any, settings: SfmSettings) -> Any:
    options = theirs.IncrementalPipelineOptions()
    options.min_model_size = SMALLEST_MODEL
    options.extract_colors = False  # they are known since the pictures were read
    options.num_threads = 1  # with more the result depends on which was first
    options.random_seed = options.mapper.random_seed = options.triangulation.random_seed = settings.seed
    if settings.camera is not None:
        options.ba_refine_focal_length = options.ba_refine_extra_params = False
        options.mapper.abs_pose_refine_focal_length = False
        options.mapper.abs_pose_refine_extra_params = False
    return options


def _for_two(options: Any) -> None:
    """Points that two pictures see are all that there is."""
    mapper = options.mapper
    options.min_model_size = 2
    mapper.track_min_num_views_per_track = mapper.global_positioning.min_num_view_per_track = 2
    mapper.bundle_adjustment.min_track_length = 2
    mapper.retriangulation.ignore_two_view_tracks = False


def _global_options(theirs: Any, settings: SfmSettings) -> Any:
    options = theirs.GlobalPipelineOptions()
    options.min_model_size = SMALLEST_MODEL
    options.num_threads = 1  # with more the result depends on which was first
    mapper = options.mapper
    mapper.num_threads = 1
    for part in (
        options, mapper, mapper.rotation_averaging, mapper.global_positioning, mapper.retriangulation
    ):  # fmt: skip
        part.random_seed = settings.seed
    mapper.global_positioning.use_gpu = mapper.bundle_adjustment.ceres.use_gpu = False
    if settings.camera is not None:
        mapper.bundle_adjustment.refine_focal_length = False
        mapper.bundle_adjustment.refine_extra_params = False
    return options
