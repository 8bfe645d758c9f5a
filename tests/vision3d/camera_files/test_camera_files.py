"""Camera files there and back, and read by the programs they are for."""

import json

import cv2
import numpy as np
import pytest
import yaml
from lens_family import EVERY_CAMERA, INTRINSICS, camera_of, points_seen

from sequential.errors import DataError, FileFormatError, ModelError
from vision3d.camera import Camera
from vision3d.camera_files import FORMATS, camera_text, formats_for, read_camera, read_cameras, write_camera
from vision3d.camera_files.numbers import number

every_camera = pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
CANNOT = {
    "ros": {"thin12"},
    "kalibr": {"brown5", "rational8", "thin12"},
    "colmap": {"thin12"},
    "json": set(),
    "opencv": set(),
}


@every_camera
@pytest.mark.parametrize("name", FORMATS)
def test_a_camera_comes_back_or_is_refused(camera, name, tmp_path):
    path = tmp_path / FORMATS[name].file_name
    if camera.lens in CANNOT[name]:
        with pytest.raises(ModelError, match="calibrate with"):
            write_camera(camera, path, name)
        assert not path.exists()
        return
    back = read_camera(write_camera(camera, path, name))
    if name == "colmap":
        # cx + 0.5 - 0.5 may lose the last bit
        assert back.lens == camera.lens
        np.testing.assert_allclose(back.parameters, camera.parameters, rtol=1e-15)
    else:
        assert back == camera


@every_camera
def test_formats_that_can_say_a_camera_are_known(camera):
    assert {one.name for one in formats_for(camera)} == {n for n in FORMATS if camera.lens not in CANNOT[n]}


@every_camera
def test_opencv_reads_what_is_written_for_it(camera, tmp_path, rng):
    path = write_camera(camera, tmp_path / "camera.yml")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    K, d = storage.getNode("camera_matrix").mat(), storage.getNode("distortion_coefficients").mat()
    size = storage.getNode("image_width").real(), storage.getNode("image_height").real()
    storage.release()
    points = points_seen(camera, rng)
    project = cv2.fisheye.projectPoints if camera.lens == "fisheye4" else cv2.projectPoints
    pixels = project(points.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), K, d)[0].reshape(-1, 2)
    np.testing.assert_allclose(pixels, camera.project(points), atol=1e-9)
    assert size == camera.size


@every_camera
def test_colmap_reads_what_is_written_for_it(camera, tmp_path, rng):
    import pycolmap

    if camera.lens in CANNOT["colmap"]:
        return
    write_camera(camera, tmp_path / "cameras.txt")
    for name in ("images.txt", "points3D.txt"):
        (tmp_path / name).touch()
    reconstruction = pycolmap.Reconstruction()
    reconstruction.read_text(str(tmp_path))
    theirs = reconstruction.cameras[1]
    points = points_seen(camera, rng)
    # the centre of COLMAP's first pixel is (0.5, 0.5)
    np.testing.assert_allclose(theirs.img_from_cam(points) - 0.5, camera.project(points), atol=1e-9)
    assert (theirs.width, theirs.height) == camera.size


def test_colmap_s_own_files_are_read(tmp_path, rng):
    import pycolmap

    reconstruction = pycolmap.Reconstruction()
    given = {
        "SIMPLE_PINHOLE": [500, 320, 240],
        "PINHOLE": [500, 501, 320, 240],
        "SIMPLE_RADIAL": [500, 320, 240, -0.1],
        "RADIAL": [500, 320, 240, -0.1, 0.02],
        "OPENCV": [500, 501, 320, 240, -0.1, 0.02, 0.001, -0.002],
        "FULL_OPENCV": [500, 501, 320, 240, -0.1, 0.02, 0.001, -0.002, 0.01, 0.02, -0.01, 0.002],
        "OPENCV_FISHEYE": [500, 501, 320, 240, 0.01, 0.02, -0.01, 0.002],
        "SIMPLE_RADIAL_FISHEYE": [500, 320, 240, 0.03],
        "RADIAL_FISHEYE": [500, 320, 240, 0.03, -0.01],
    }
    for i, (model, params) in enumerate(given.items(), 1):
        reconstruction.add_camera(
            pycolmap.Camera(camera_id=i, model=model, width=640, height=480, params=params)
        )
    reconstruction.write_text(str(tmp_path))
    cameras = read_cameras(tmp_path / "cameras.txt")
    assert len(cameras) == len(given)
    points = rng.uniform((-0.4, -0.3, 1.0), (0.4, 0.3, 1.5), (40, 3))
    for number_, camera in cameras.items():
        theirs = reconstruction.cameras[int(number_)].img_from_cam(points)
        np.testing.assert_allclose(camera.project(points), theirs - 0.5, atol=1e-9, err_msg=camera.lens)


def test_ros_fields(tmp_path):
    document = yaml.safe_load(camera_text(camera_of("brown5"), "ros", "narrow_stereo"))
    assert document["camera_name"] == "narrow_stereo"
    assert document["distortion_model"] == "plumb_bob"
    assert (document["image_width"], document["image_height"]) == (640, 480)
    for key, shape in {
        "camera_matrix": (3, 3),
        "rectification_matrix": (3, 3),
        "projection_matrix": (3, 4),
        "distortion_coefficients": (1, 5),
    }.items():
        block = document[key]
        assert (block["rows"], block["cols"]) == shape
        assert len(block["data"]) == shape[0] * shape[1]
        assert all(isinstance(value, float) for value in block["data"])
    models = {
        lens: yaml.safe_load(camera_text(camera_of(lens), "ros"))["distortion_model"]
        for lens in ("pinhole", "rational8", "fisheye4")
    }
    assert models == {"pinhole": "plumb_bob", "rational8": "rational_polynomial", "fisheye4": "equidistant"}


def test_a_file_of_ros_s_calibrator(tmp_path):
    """Without our comment, with entries that we do not write, and integers among the numbers."""
    path = tmp_path / "ost.yaml"
    path.write_text(
        "image_width: 640\nimage_height: 480\ncamera_name: narrow_stereo/left\n"
        "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [438.78, 0, 305.59, 0, 437.35, 243.73, 0, 0, 1]\n"
        "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
        "  data: [-0.361, 0.148, 1e-05, -0.0012, 0.0]\nbinning_x: 0\n"
    )
    camera = read_camera(path)
    assert camera == Camera(
        "brown5", (438.78, 437.35, 305.59, 243.73), (-0.361, 0.148, 1e-5, -0.0012, 0.0), (640, 480)
    )
    assert list(read_cameras(path)) == ["narrow_stereo/left"]


CAMCHAIN = """\
cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 2.0e-4, 1.7e-05]
  distortion_model: radtan
  intrinsics: [458.6, 457.3, 367.2, 248.4]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: 0.0
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.01, 0.02, 0.0, 0.0]
  distortion_model: equidistant
  intrinsics: [457.5, 456.1, 379.9, 255.2]
  resolution: [752, 480]
"""


def test_a_chain_of_kalibr(tmp_path):
    path = tmp_path / "camchain-imucam.yaml"
    path.write_text(CAMCHAIN)
    cameras = read_cameras(path)
    assert {name: camera.lens for name, camera in cameras.items()} == {"cam0": "brown4", "cam1": "fisheye4"}
    assert cameras["cam0"].size == (752, 480)
    assert read_camera(path, which="cam1") == cameras["cam1"]
    with pytest.raises(DataError, match="several cameras; choose one of cam0, cam1"):
        read_camera(path)
    with pytest.raises(DataError, match="no camera 'cam2'"):
        read_camera(path, which="cam2")
    path.write_text(path.read_text().replace("camera_model: pinhole", "camera_model: ds"))
    with pytest.raises(FileFormatError, match="cam0: ds with radtan is not read"):
        read_cameras(path)


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
@pytest.mark.parametrize("count", [4, 5, 8, 12, 14])
def test_whatever_opencv_writes(tmp_path, suffix, count):
    path = tmp_path / f"calibration.{suffix}"
    vector = np.linspace(-0.1, 0.1, count)
    vector[12:] = 0.0
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 800)
    storage.write("image_height", 600)
    storage.write("cameraMatrix", camera_of("pinhole").matrix)
    storage.write("distCoeffs", vector.reshape(1, -1))
    storage.release()
    camera = read_camera(path)
    assert camera.size == (800, 600)
    np.testing.assert_allclose(camera.intrinsics, INTRINSICS, rtol=1e-14)
    np.testing.assert_allclose(camera.distortion, vector[:12], rtol=1e-14)


ORB_SLAM = """\
%YAML:1.0
---
Camera.type: "PinHole"
Camera1.fx: 458.654
Camera1.fy: 457.296
Camera1.cx: 367.215
Camera1.cy: 248.375
Camera1.k1: -0.28340811
Camera1.k2: 0.07395907
Camera1.p1: 0.00019359
Camera1.p2: 1.76187114e-05
Camera.width: 752
Camera.height: 480
"""


def test_orb_slam_s_settings(tmp_path):
    path = tmp_path / "EuRoC.yaml"
    path.write_text(ORB_SLAM)
    camera = read_camera(path)
    assert (camera.lens, camera.size) == ("brown5", (752, 480))
    np.testing.assert_allclose(camera.distortion, (-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0))


def test_files_of_opencv_s_samples(data_dir):
    folder = data_dir / "vision" / "opencv"
    camera = read_camera(folder / "left_intrinsics.yml")
    assert (camera.lens, camera.size) == ("brown5", (640, 480))
    np.testing.assert_allclose(camera.intrinsics, (535.91573396, 535.91573396, 342.28315473, 235.57082910))
    np.testing.assert_allclose(camera.distortion[[0, 4]], (-0.26637260910, 0.23839153081))
    with pytest.raises(FileFormatError, match="does not say how large its images are"):
        read_cameras(folder / "intrinsics.yml")
    pair = read_cameras(folder / "intrinsics.yml", size=(640, 480))
    assert list(pair) == ["left", "right"]
    assert pair["right"].intrinsics[2] == pytest.approx(334.55744527912015)
    marker = read_camera(data_dir / "vision" / "aruco" / "tutorial_camera_params.yml", size=(640, 480))
    np.testing.assert_allclose(marker.parameters[:5], (628.158, 628.156, 324.099, 260.908, 0.0995485))


def test_a_calibration_holds_its_camera(tmp_path):
    path = tmp_path / "calibration.json"
    record = json.loads(camera_text(camera_of("thin12"), "json"))
    path.write_text(json.dumps({"rms_px": 0.2, "camera": record}))
    assert read_camera(path) == camera_of("thin12")


@pytest.mark.parametrize("value", [0.0, 1.0, -3.0, 1e-5, 1.5e-7, 1e22, 123456789.125, 0.1, 5e-324])
def test_numbers_are_numbers_to_yaml(value):
    read = yaml.safe_load(f"x: {number(value)}")["x"]
    assert isinstance(read, float)
    assert read == value
