"""A camera file for images of one size: it is theirs, or says no size, or is refused in a sentence."""

import pytest

from sequential.errors import DataError, FileFormatError
from vision3d.camera import Camera
from vision3d.camera_files import FORMATS, write_camera
from vision3d.camera_files.sized import read_camera_for

CAMERA = Camera("brown4", [500.0, 501.0, 319.0, 241.0], [0.1, -0.2, 0.001, 0.002], (640, 480))


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_is_read_for_its_own_size_and_refused_for_others(name, tmp_path):
    path = tmp_path / FORMATS[name].file_name
    write_camera(CAMERA, path, name)
    assert read_camera_for(path, (640, 480)).size == (640, 480)
    with pytest.raises(DataError, match=r"calibration of images of 640x480 px, these are 1280x720"):
        read_camera_for(path, (1280, 720))


def test_a_file_without_a_size_is_for_the_images_that_are_there(tmp_path):
    path = tmp_path / "intrinsics.yml"
    path.write_text(
        "%YAML:1.0\n---\n"
        "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        "   data: [ 500., 0., 319., 0., 501., 241., 0., 0., 1. ]\n"
        "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n"
        "   data: [ 0.1, -0.2, 0., 0. ]\n",
        encoding="utf-8",
    )
    assert read_camera_for(path, (800, 600)).size == (800, 600)


def test_a_file_that_is_none_says_so(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text("hello: world\n", encoding="utf-8")
    with pytest.raises((DataError, FileFormatError)):
        read_camera_for(path, (640, 480))
