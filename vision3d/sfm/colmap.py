"""Reconstructions in COLMAP's own objects, and back: the one place where its pixels meet ours.

COLMAP counts pixels from the corner of the image, so the centre of the top-left pixel is (0.5, 0.5) there
and (0, 0) here.  Both look along +z and write poses as camera from world.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vision3d.camera import Camera
from vision3d.camera_files.colmap import HALF, camera_of_colmap, colmap_parameters
from vision3d.sfm.library import colmap
from vision3d.sfm.noise import noise_of
from vision3d.sfm.reconstruction import Reconstruction

if TYPE_CHECKING:
    import pycolmap

__all__ = ["from_pycolmap", "pixels_from_colmap", "pixels_to_colmap", "to_pycolmap"]

Array = NDArray[np.float64]
ONE_FOCAL = {"pinhole": "SIMPLE_PINHOLE", "brown1": "SIMPLE_RADIAL", "brown2": "RADIAL"}


def pixels_to_colmap(pixels: Array) -> Array:
    """Ours (..., 2) as COLMAP counts them."""
    return np.asarray(pixels, dtype=np.float64) + HALF


def pixels_from_colmap(pixels: Any) -> Array:
    """COLMAP's (..., 2) as counted here."""
    return np.asarray(pixels, dtype=np.float64) - HALF


def camera_to_pycolmap(camera: Camera, number: int = 1, model: str | None = None) -> pycolmap.Camera:
    """A camera in COLMAP's terms; its focal length counts as known.

    Raises
    ------
    ModelError
        where COLMAP has no model for the lens.
    """
    theirs = colmap()
    name, parameters = colmap_parameters(camera, model)
    made: pycolmap.Camera = theirs.Camera(
        model=name, width=camera.size[0], height=camera.size[1], params=parameters, camera_id=number
    )
    made.has_prior_focal_length = True
    return made


def camera_from_pycolmap(camera: pycolmap.Camera, lens: str = "") -> Camera:
    """A camera of COLMAP; `lens` is preferred where it says the same.

    Raises
    ------
    FileFormatError
        for a model that is not known here.
    """
    where = f"COLMAP's camera {camera.camera_id}"
    size = (camera.width, camera.height)
    return camera_of_colmap(camera.model_name, camera.params.tolist(), size, where=where, wanted=lens)


def from_pycolmap(
    model: pycolmap.Reconstruction,
    *,
    missing: Sequence[tuple[str, str]] = (),
    lenses: dict[int, str] | None = None,
) -> Reconstruction:
    """What COLMAP found, with pictures in the order of their names.

    Parameters
    ----------
    missing : (name, reason) of pictures without a pose, kept as they are
    lenses : by COLMAP's number of a camera, the lens to write it as where several say the same
    """
    cameras = sorted(model.cameras.items())
    images = sorted((image for image in model.images.values() if image.has_pose), key=lambda one: one.name)
    points = sorted(model.points3D.items())
    row_of_camera = {number: k for k, (number, _) in enumerate(cameras)}
    row_of_image = {image.image_id: k for k, image in enumerate(images)}
    pixels_of = {image.image_id: np.array([p.xy for p in image.points2D]) for image in images}
    views, seen, pixels = [], [], []
    for k, (_, point) in enumerate(points):
        for element in point.track.elements:
            views.append(row_of_image[element.image_id])
            seen.append(k)
            pixels.append(pixels_of[element.image_id][element.point2D_idx])
    found = Reconstruction(
        cameras=tuple(camera_from_pycolmap(one, (lenses or {}).get(number, "")) for number, one in cameras),
        names=tuple(image.name for image in images),
        camera_of=np.array([row_of_camera[image.camera_id] for image in images], dtype=np.int64),
        cameras_T_world=np.array([pose_from_pycolmap(image.cam_from_world()) for image in images]),
        points=np.array([point.xyz for _, point in points]),
        colors=np.array([point.color for _, point in points], dtype=np.uint8),
        image_index=np.array(views, dtype=np.int64),
        point_index=np.array(seen, dtype=np.int64),
        pixels=pixels_from_colmap(np.array(pixels)) if pixels else np.zeros((0, 2)),
        missing=tuple(missing),
        models=tuple(one.model_name for _, one in cameras),
    )
    return found.replaced(sigma_px=noise_of(found))


def pose_from_pycolmap(rigid: pycolmap.Rigid3d) -> Array:
    """(7,) `qw qx qy qz px py pz` of COLMAP's pose, whose quaternion has the scalar last."""
    x, y, z, w = rigid.rotation.quat
    return np.array([w, x, y, z, *rigid.translation])


def pose_to_pycolmap(pose: Array) -> pycolmap.Rigid3d:
    """COLMAP's pose of (7,) `qw qx qy qz px py pz`."""
    theirs = colmap()
    w, x, y, z = pose[:4]
    rigid: pycolmap.Rigid3d = theirs.Rigid3d(theirs.Rotation3d(np.array([x, y, z, w])), pose[4:])
    return rigid


def _one_focal(camera: Camera) -> str | None:
    """The model that keeps fx and fy one number where they are; None where they are two."""
    return ONE_FOCAL.get(camera.lens) if camera.intrinsics[0] == camera.intrinsics[1] else None


def to_pycolmap(found: Reconstruction) -> pycolmap.Reconstruction:
    """The same in COLMAP's objects: cameras, pictures and points are numbered from 1 in their order.

    Raises
    ------
    ModelError
        where COLMAP has no model for a lens.
    """
    theirs = colmap()
    made: pycolmap.Reconstruction = theirs.Reconstruction()
    models: Sequence[str | None] = found.models or [_one_focal(camera) for camera in found.cameras]
    for k, (camera, model) in enumerate(zip(found.cameras, models, strict=True)):
        made.add_camera_with_trivial_rig(camera_to_pycolmap(camera, k + 1, model))
    place = np.zeros(len(found.pixels), dtype=np.int64)  # of every observation among those of its picture
    for view, name in enumerate(found.names):
        mine = np.flatnonzero(found.image_index == view)
        place[mine] = np.arange(len(mine))
        image = theirs.Image(
            name=name,
            keypoints=pixels_to_colmap(found.pixels[mine]).reshape(-1, 2),
            camera_id=int(found.camera_of[view]) + 1,
            image_id=view + 1,
        )
        made.add_image_with_trivial_frame(image, pose_to_pycolmap(found.cameras_T_world[view]))
    order = np.argsort(found.point_index, kind="stable")
    starts = np.searchsorted(found.point_index[order], np.arange(len(found.points) + 1))
    for k, point in enumerate(found.points):
        track = theirs.Track()
        for row in order[starts[k] : starts[k + 1]]:
            track.add_element(int(found.image_index[row]) + 1, int(place[row]))
        made.add_point3D(point, track, found.colors[k])
    made.update_point_3d_errors()
    return made
