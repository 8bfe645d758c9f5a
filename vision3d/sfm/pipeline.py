"""From photographs to a reconstruction: features, matches, a mapper, and why pictures have no place."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.sfm.colmap import from_pycolmap
from vision3d.sfm.database import camera_for, fill_database
from vision3d.sfm.explaining import NoModelError, why_missing, why_no_model
from vision3d.sfm.extraction import PictureFeatures, extract_all
from vision3d.sfm.lens_choice import with_second_coefficient
from vision3d.sfm.mapping import map_pictures
from vision3d.sfm.matching import match_all
from vision3d.sfm.pair_geometry import view_graph_of
from vision3d.sfm.patience import Patience
from vision3d.sfm.pictures import PhotoSources, photo_sources
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.settings import SfmSettings
from vision3d.sfm.settling import settled, soft_scale

if TYPE_CHECKING:
    import pycolmap

__all__ = ["reconstruct"]

Progress = Callable[[str, int, int], None]


def silent(what: str, done: int, total: int) -> None:
    """Tell nobody."""


def reconstruct(
    images: PhotoSources,
    settings: SfmSettings | None = None,
    *,
    work: Path | None = None,
    stop: threading.Event | None = None,
    progress: Progress = silent,
    **changes: Any,
) -> Reconstruction:
    """Cameras, poses and points of a set of photographs.

    Parameters
    ----------
    images : a folder, a pattern, files, or arrays (h, w[, 3]) uint8 BGR by their names
    settings : how; `changes` are fields of it: `reconstruct(folder, camera=camera, mapper="global")`
    work : folder in which features and matches are kept, so that a run that was ended goes on; None:
        nothing is kept
    stop : an event whose setting ends the work: what has its place by then is given
    progress : called with what is being done, how much is done and out of how much

    Raises
    ------
    DataError
        where fewer than two pictures can be used.
    NoModelError
        a DataError, where the pictures gave no model; it carries the view graph.
    Stopped
        where the work was ended before there was a model.
    """
    chosen = replace(settings or SfmSettings(), **changes)
    sources = photo_sources(images)
    patience = Patience(stop)
    with tempfile.TemporaryDirectory(prefix="factorlab-sfm-") as scratch:
        folder = work or Path(scratch)
        pictures, left_out = extract_all(sources, chosen, folder, patience, progress)
        pictures, odd = _of_the_camera(pictures, chosen)
        left_out |= odd
        if len(pictures) < 2:
            told = "; ".join(f"{name} {why}" for name, why in list(left_out.items())[:3])
            raise DataError(f"of {len(sources)} pictures {len(pictures)} can be used, two are needed: {told}")
        database = folder / "pictures.db"
        fill_database(database, pictures, chosen)
        match_all(database, pictures, chosen, patience, progress)
        if chosen.mapper == "own":
            return _grown(database, pictures, left_out, chosen, patience, progress)
        models = map_pictures(database, len(pictures), chosen, patience, progress)
        if not models:
            patience.check()
        return _told(database, models, pictures, left_out, chosen)


def _of_the_camera(
    pictures: Sequence[PictureFeatures], settings: SfmSettings
) -> tuple[list[PictureFeatures], dict[str, str]]:
    """Pictures that the known camera can have taken."""
    kept, left_out = [], {}
    for picture in pictures:
        try:
            if settings.camera is not None:
                camera_for(settings.camera, picture.size)
            kept.append(picture)
        except DataError as error:
            left_out[picture.name] = str(error)
    return kept, left_out


def _grown(
    database: Path,
    pictures: Sequence[PictureFeatures],
    left_out: dict[str, str],
    settings: SfmSettings,
    patience: Patience,
    progress: Progress,
) -> Reconstruction:
    """The model of our own mapper, told as those of COLMAP's are."""
    from vision3d.sfm.own_mapper import known_cameras, map_by_growing

    found = map_by_growing(database, pictures, settings, patience, progress)
    known = None if found is None else known_cameras(database, found)
    graph = view_graph_of(database, pictures, known, settings.seed)
    placed = set() if found is None else {k for k, one in enumerate(pictures) if one.name in found.names}
    others = [k for k in range(len(pictures)) if k not in placed]
    missing = (*left_out.items(), *((pictures[k].name, why_missing(graph, k, placed)) for k in others))
    if found is None:
        raise NoModelError(why_no_model(graph), graph, missing)
    return found.replaced(missing=missing, graph=graph)


def _told(
    database: Path,
    models: Sequence[pycolmap.Reconstruction],
    pictures: Sequence[PictureFeatures],
    left_out: dict[str, str],
    settings: SfmSettings,
) -> Reconstruction:
    """The largest model in our words, with colours, and with pictures that have no place in it."""
    graph = view_graph_of(database, pictures, models[0] if models else None, settings.seed)
    members = [{image - 1 for image in model.reg_image_ids()} for model in models] or [set()]
    missing = list(left_out.items())
    for k, picture in enumerate(pictures):
        if k not in members[0]:
            others: set[int] = next((one for one in members[1:] if k in one), set())
            missing.append((picture.name, why_missing(graph, k, members[0], others)))
    if not models:
        raise NoModelError(why_no_model(graph), graph, tuple(missing))
    known = {} if settings.camera is None else dict.fromkeys(models[0].cameras, settings.camera.lens)
    found = from_pycolmap(models[0], lenses=known)
    found = found.replaced(names=tuple(pictures[int(name)].name for name in found.names))
    colors = _colours(found, models[0], pictures)
    found = settled(found.replaced(missing=tuple(missing), graph=graph, colors=colors), settings)
    if settings.camera is None and settings.lens == "auto":
        larger = with_second_coefficient(found, soft_scale(found))
        found = found if larger is None else settled(larger, settings)
    return found


def _colours(
    found: Reconstruction, model: pycolmap.Reconstruction, pictures: Sequence[PictureFeatures]
) -> NDArray[np.uint8]:
    """(P, 3) mean over the pictures that see each point."""
    colours = [one.colors for one in pictures]
    means = np.zeros((len(found.points), 3), dtype=np.uint8)
    for k, (_, point) in enumerate(sorted(model.points3D.items())):
        seen = [colours[element.image_id - 1][element.point2D_idx] for element in point.track.elements]
        means[k] = np.rint(np.mean(seen, axis=0)).astype(np.uint8)
    return means
