"""COLMAP's database of a set of pictures: cameras, pictures, features."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sequential.errors import DataError
from vision3d.camera import Camera
from vision3d.sfm.colmap import camera_to_pycolmap
from vision3d.sfm.extraction import PictureFeatures
from vision3d.sfm.library import colmap
from vision3d.sfm.settings import LENS_MODELS, SfmSettings

if TYPE_CHECKING:
    import pycolmap

__all__ = ["camera_for", "fill_database", "name_in_database"]

USUAL_FOCAL = 1.2  # of the longer side, px: 45° across, for pictures that do not say
PLAUSIBLE_FOCAL = (0.35, 4.0)  # of the longer side: 110° to 14° across
SAME_SHAPE = 0.01  # relative difference of width / height of reduced pictures of one camera


def camera_for(camera: Camera, size: tuple[int, int]) -> Camera:
    """The known camera for pictures of a size.

    Raises
    ------
    DataError
        where the pictures have another shape than its own.
    """
    if size == camera.size:
        return camera
    ratio = (size[0] / size[1]) / (camera.size[0] / camera.size[1])
    if abs(ratio - 1.0) > SAME_SHAPE:
        told, given = ("x".join(map(str, one)) for one in (camera.size, size))
        raise DataError(f"is {given} px, and the camera that was given has images of {told}")
    return camera.resized(size)


def name_in_database(picture: int) -> str:
    """What COLMAP calls a picture: a number, since its lists part names at spaces."""
    return f"{picture:06d}"


def fill_database(path: Path, pictures: Sequence[PictureFeatures], settings: SfmSettings) -> None:
    """Write cameras, pictures and features; pictures are numbered from 1 in their order."""
    theirs = colmap()
    path.unlink(missing_ok=True)
    numbers: dict[tuple[object, ...], int] = {}
    with theirs.Database.open(path) as database:
        for k, picture in enumerate(pictures):
            key = _shared_by(k, picture, settings)
            if key not in numbers:
                camera = _camera(picture, len(numbers) + 1, settings)
                numbers[key] = database.write_camera(camera, use_camera_id=True)
                rig = theirs.Rig(rig_id=numbers[key])
                rig.add_ref_sensor(camera.sensor_id)
                database.write_rig(rig, use_rig_id=True)
            _write_picture(database, picture, k + 1, numbers[key])


def _shared_by(k: int, picture: PictureFeatures, settings: SfmSettings) -> tuple[object, ...]:
    """Pictures with the same key have one camera."""
    if settings.sharing == "each":
        return (k,)
    return picture.size if settings.sharing == "one" else (picture.size, picture.device)


def _camera(picture: PictureFeatures, number: int, settings: SfmSettings) -> pycolmap.Camera:
    theirs = colmap()
    if settings.camera is not None:
        return camera_to_pycolmap(camera_for(settings.camera, picture.size), number)
    width, height = picture.size
    longer = max(width, height)
    focal_px = picture.focal_px
    told = focal_px is not None and PLAUSIBLE_FOCAL[0] < focal_px / longer < PLAUSIBLE_FOCAL[1]
    camera: pycolmap.Camera = theirs.Camera.create_from_model_name(
        number, LENS_MODELS[settings.lens], focal_px if told else USUAL_FOCAL * longer, width, height
    )
    camera.has_prior_focal_length = told
    return camera


def _write_picture(database: pycolmap.Database, picture: PictureFeatures, number: int, camera: int) -> None:
    theirs = colmap()
    image = theirs.Image(name=name_in_database(number - 1), camera_id=camera, image_id=number)
    database.write_image(image, use_image_id=True)
    frame = theirs.Frame(frame_id=number, rig_id=camera)
    frame.add_data_id(image.data_id)
    database.write_frame(frame, use_frame_id=True)
    database.write_keypoints(number, picture.keypoints)
    sift = theirs.FeatureExtractorType.SIFT
    database.write_descriptors(number, theirs.FeatureDescriptors(type=sift, data=picture.descriptors))
