"""Every file that the command writes is read back, by the programs that it is for."""

import json

import cv2
import numpy as np
import pycolmap
import pytest
import yaml
from camera_photos import OPTIONS, TRUTH, run

from vision3d.camera_files import read_camera

RAYS = np.stack(np.meshgrid(np.linspace(-0.25, 0.25, 7), np.linspace(-0.2, 0.2, 5), [1.0]), -1).reshape(-1, 3)
LENSES = ("brown4", "brown5", "rational8", "fisheye4")


@pytest.fixture(scope="module", params=LENSES)
def folder(request, photos, tmp_path_factory):
    """What the command writes with each lens."""
    out = tmp_path_factory.mktemp("exports") / request.param
    done = run(*photos.paths, *OPTIONS, "--lens", request.param, "--no-next-pose", "-o", out)
    assert done.exit_code == 0, done.stderr
    return out


def own(folder):
    return read_camera(folder / "camera.json")


def by_opencv(matrix, distortion, lens):
    """Pixels of the rays by OpenCV's own projection."""
    distortion = np.asarray(distortion, dtype=np.float64).ravel()
    if lens == "fisheye4":
        points, _ = cv2.fisheye.projectPoints(RAYS[None], np.zeros(3), np.zeros(3), matrix, distortion)
        return np.asarray(points).reshape(-1, 2)
    points, _ = cv2.projectPoints(RAYS, np.zeros(3), np.zeros(3), matrix, distortion)
    return np.asarray(points).reshape(-1, 2)


def test_every_file_says_the_same_camera(folder):
    camera = own(folder)
    for name in ("camera_opencv.yml", "camera_info.yaml", "camchain.yaml", "cameras.txt", "report.json"):
        if (folder / name).exists():
            np.testing.assert_allclose(
                read_camera(folder / name).project(RAYS), camera.project(RAYS), atol=1e-6
            )


def test_the_formats_are_those_that_can_say_the_lens(folder):
    names = {path.name for path in folder.iterdir()}
    assert {"camera.json", "camera_opencv.yml", "camera_info.yaml", "report.html", "report.json"} <= names
    assert {"corners.csv", "poses.csv"} <= names
    assert ("camchain.yaml" in names) == (folder.name in {"brown4", "fisheye4"})


def test_opencv_reads_and_projects(folder):
    storage = cv2.FileStorage(str(folder / "camera_opencv.yml"), cv2.FILE_STORAGE_READ)
    matrix, distortion = (
        storage.getNode(name).mat() for name in ("camera_matrix", "distortion_coefficients")
    )
    assert (storage.getNode("image_width").real(), storage.getNode("image_height").real()) == TRUTH.size
    storage.release()
    np.testing.assert_allclose(
        by_opencv(matrix, distortion, folder.name), own(folder).project(RAYS), atol=1e-6
    )


def test_ros_reads_and_projects(folder):
    told = yaml.safe_load((folder / "camera_info.yaml").read_text(encoding="utf-8"))
    assert (told["image_width"], told["image_height"]) == TRUTH.size
    matrix = np.array(told["camera_matrix"]["data"]).reshape(3, 3)
    pixels = by_opencv(matrix, told["distortion_coefficients"]["data"], folder.name)
    np.testing.assert_allclose(pixels, own(folder).project(RAYS), atol=1e-6)
    model = {"fisheye4": "equidistant", "rational8": "rational_polynomial"}
    assert told["distortion_model"] == model.get(folder.name, "plumb_bob")


def test_colmap_reads_and_projects(folder):
    if not (folder / "cameras.txt").exists():
        assert folder.name == "brown5"  # no model of COLMAP has k3 without the rest
        return
    words = next(
        line for line in (folder / "cameras.txt").read_text(encoding="utf-8").splitlines() if line[0] != "#"
    ).split()
    camera = pycolmap.Camera(
        model=words[1], width=int(words[2]), height=int(words[3]), params=[float(word) for word in words[4:]]
    )
    pixels = np.array([camera.img_from_cam(ray) for ray in RAYS]) - 0.5  # COLMAP's first pixel is at 0.5
    np.testing.assert_allclose(pixels, own(folder).project(RAYS), atol=1e-6)


def test_corners_read_back_give_the_same_calibration(folder):
    """corners.csv holds all that the calibration was made from."""
    from vision3d.calibrate import calibrate
    from vision3d.views import View

    table = np.genfromtxt(folder / "corners.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    views = []
    for name in dict.fromkeys(table["picture"]):
        rows = table[table["picture"] == name]
        points, pixels = (
            np.column_stack([rows[column] for column in columns])
            for columns in (("board_x_m", "board_y_m", "board_z_m"), ("x_px", "y_px"))
        )
        views.append(View(name, TRUTH.size, points, pixels, rows["corner"], rows["sigma_px"]))
    again = calibrate(views, folder.name).camera
    # the coefficients of a rational lens trade places here, by less than its σ
    np.testing.assert_allclose(again.project(RAYS), own(folder).project(RAYS), atol=2e-2)


def test_the_report_says_what_the_camera_file_says(folder):
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    np.testing.assert_array_equal(list(report["camera"]["parameters"].values()), own(folder).parameters)
    cov = np.array(report["camera"]["covariance"])
    np.testing.assert_allclose(np.sqrt(np.diag(cov)), list(report["camera"]["std"].values()))
