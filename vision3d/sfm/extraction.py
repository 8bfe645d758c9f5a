"""Features of every picture, by COLMAP's SIFT on several cores; kept in files so that work is not lost."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.sfm.library import colmap
from vision3d.sfm.patience import Patience
from vision3d.sfm.pictures import Image, Photo, read_photo
from vision3d.sfm.settings import SfmSettings

__all__ = ["PictureFeatures", "extract_all"]

HALF = 0.5


@dataclass(frozen=True, eq=False)
class PictureFeatures:
    """Features of one picture, in COLMAP's pixels of the picture as it was read.

    Parameters
    ----------
    name, size, digest, focal_px, device : of the photo
    keypoints : (n, 6) x, y and the affine shape
    descriptors : (n, 128) uint8
    colors : (n, 3) uint8, red green blue at each
    """

    name: str
    size: tuple[int, int]
    digest: str
    focal_px: float | None
    device: str
    keypoints: NDArray[np.float32]
    descriptors: NDArray[np.uint8]
    colors: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.keypoints)


def extract_all(
    sources: Mapping[str, Path | Image],
    settings: SfmSettings,
    folder: Path,
    patience: Patience,
    progress: Callable[[str, int, int], None],
) -> tuple[list[PictureFeatures], dict[str, str]]:
    """Features of all pictures that can be used, and why the others cannot.

    Features are kept in `folder`, by what the pixels and the settings are: a second call takes them from
    there.
    """
    left_out: dict[str, str] = {}
    first_of: dict[str, str] = {}
    found: list[PictureFeatures] = []
    batch: list[Photo] = []
    size = 2 * (settings.threads or _cores())

    def finish() -> None:
        found.extend(_extract(batch, settings, folder, patience))
        batch.clear()

    for done, (name, source) in enumerate(sources.items()):
        progress("features", done, len(sources))
        patience.check()
        try:
            photo = read_photo(name, source)
        except (DataError, OSError) as error:
            left_out[name] = str(error).removeprefix(f"{source} ")
            continue
        first = first_of.setdefault(photo.digest, name)
        if first != name:
            left_out[name] = f"is the same picture as {first}"
            continue
        kept = _load(photo, settings, folder)
        if kept is None:
            batch.append(photo)
        else:
            found.append(kept)
        if len(batch) == size:
            finish()
    finish()
    order = {name: k for k, name in enumerate(sources)}
    return sorted(found, key=lambda one: order[one.name]), left_out


def _cores() -> int:
    import os

    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _extract(
    batch: list[Photo], settings: SfmSettings, folder: Path, patience: Patience
) -> Iterator[PictureFeatures]:
    """Several pictures at once, through a database of their own."""
    import cv2

    if not batch:
        return
    theirs = colmap()
    scratch = folder / "scratch"
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    names = [f"{k}.pgm" for k in range(len(batch))]
    for photo, name in zip(batch, names, strict=True):
        grey = cv2.cvtColor(_reduced(photo.image, settings.max_size), cv2.COLOR_BGR2GRAY)
        cv2.imwrite(str(scratch / name), grey)
    options = theirs.FeatureExtractionOptions()
    options.num_threads = settings.threads or -1
    options.sift.max_num_features = settings.max_features
    patience.run(
        lambda token: theirs.extract_features(
            scratch / "features.db", scratch, image_names=names, camera_mode=theirs.CameraMode.PER_IMAGE,
            extraction_options=options, device=theirs.Device.cpu, cancellation_token=token,
        )
    )  # fmt: skip
    patience.check()
    with theirs.Database.open(scratch / "features.db") as database:
        numbers = {image.name: image.image_id for image in database.read_all_images()}
        for photo, name in zip(batch, names, strict=True):
            if name in numbers:
                keypoints = np.array(database.read_keypoints(numbers[name]), dtype=np.float32)
                descriptors = np.array(database.read_descriptors(numbers[name]).data, dtype=np.uint8)
            else:
                keypoints, descriptors = np.zeros((0, 6), np.float32), np.zeros((0, 128), np.uint8)
            features = _described(photo, keypoints, descriptors, settings)
            _keep(features, settings, folder)
            yield features
    shutil.rmtree(scratch, ignore_errors=True)


def _reduced(image: Image, most: int) -> Image:
    import cv2

    height, width = image.shape[:2]
    if max(height, width) <= most:
        return image
    scale = most / max(height, width)
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _described(
    photo: Photo, keypoints: NDArray[Any], descriptors: NDArray[Any], settings: SfmSettings
) -> PictureFeatures:
    """Features in the pixels of the picture itself, with the colours they lie on."""
    width, height = photo.size
    small = _reduced(photo.image, settings.max_size).shape[:2]
    keypoints = keypoints.reshape(-1, keypoints.shape[1] if keypoints.size else 6).copy()
    scale = np.array([width / small[1], height / small[0]], dtype=np.float32)
    keypoints[:, :2] *= scale
    keypoints[:, 2:] *= float(scale.mean())
    at = np.clip(np.rint(keypoints[:, :2] - HALF).astype(int), 0, [width - 1, height - 1])
    colors = np.ascontiguousarray(photo.image[at[:, 1], at[:, 0], ::-1])
    return PictureFeatures(
        photo.name, photo.size, photo.digest, photo.focal_px, photo.device, keypoints,
        descriptors.reshape(-1, 128), colors,
    )  # fmt: skip


def _file(digest: str, settings: SfmSettings, folder: Path) -> Path:
    return folder / "features" / f"{digest}-{settings.max_size}-{settings.max_features}.npz"


def _keep(features: PictureFeatures, settings: SfmSettings, folder: Path) -> None:
    path = _file(features.digest, settings, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    half_written = path.with_suffix(".part")
    with half_written.open("wb") as file:
        np.savez(file, keypoints=features.keypoints, descriptors=features.descriptors, colors=features.colors)
    half_written.replace(path)


def _load(photo: Photo, settings: SfmSettings, folder: Path) -> PictureFeatures | None:
    path = _file(photo.digest, settings, folder)
    if not path.is_file():
        return None
    with np.load(path) as kept:
        arrays = {name: kept[name] for name in ("keypoints", "descriptors", "colors")}
    return PictureFeatures(photo.name, photo.size, photo.digest, photo.focal_px, photo.device, **arrays)
