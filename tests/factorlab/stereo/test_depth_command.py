"""What `factorlab stereo depth` writes, prints and refuses."""

import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.stereo.depth_pairs import rendered_pair
from vision3d.camera import Camera
from vision3d.cloud import read_ply
from vision3d.stereo import StereoRig, write_rig

SIZE = (320, 240)
CALIB = """cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]
cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]
doffs=31.086
baseline=193.001
width=741
height=500
"""


def run(*arguments):
    return CliRunner().invoke(main, ["stereo", "depth", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A rendered pair, its rig, its truth, and pictures that are no pair."""
    place = tmp_path_factory.mktemp("pair")
    pair = rendered_pair(np.random.default_rng(2), SIZE)
    for name, image in (("left", pair.left), ("right", pair.right)):
        cv2.imwrite(str(place / f"{name}.png"), image)
    write_rig(place / "rig.json", pair.rig)
    np.save(place / "truth.npy", pair.truth_px)
    cv2.imwrite(str(place / "pixel.png"), np.zeros((1, 1), np.uint8))
    cv2.imwrite(str(place / "small.png"), pair.right[:100, :100])
    cv2.imwrite(str(place / "lower.png"), np.roll(pair.right, 9, axis=0))
    cv2.imwrite(str(place / "flat.png"), np.full((240, 320, 3), 120, np.uint8))
    cv2.imwrite(str(place / "flat_too.png"), np.full((240, 320, 3), 121, np.uint8))
    (place / "corrupt.png").write_bytes((place / "left.png").read_bytes()[:2000])
    return place


def files(folder, *names):
    return [folder / f"{name}.png" for name in names]


@pytest.fixture(scope="module")
def done(folder):
    """The whole job."""
    told = run(
        *files(folder, "left", "right"), "--calib", folder / "rig.json", "--truth", folder / "truth.npy",
        "--json", "--check", "-o", folder / "out",
    )  # fmt: skip
    assert told.exit_code == 0, told.stderr
    return json.loads(told.stdout)


def verdict(document, metric):
    return next(one for one in document["verdicts"] if one["metric"] == metric)


def test_depth_is_right(done):
    assert done["truth"]["bad2_all"] < 0.08
    assert done["truth"]["median_px"] < 0.15
    assert verdict(done, "rows of the matches")["verdict"] == "PASS"
    assert verdict(done, "matched pixels")["verdict"] == "PASS"
    assert 0.5 < done["depth"]["percentiles_m"]["1"] < done["depth"]["percentiles_m"]["99"] < 2.6


def test_the_table_is_the_ground(done):
    assert done["ground"]["distance_m"] == pytest.approx(0.45, abs=0.01)
    assert done["ground"]["tilt_deg"] < 1.0


def test_files(done, folder):
    names = {path.name for path in (folder / "out").iterdir()}
    assert names == {
        "report.html", "report.json", "disparity.npz", "disparity.png", "mask.png", "depth.npz", "depth.png",
        "cloud.ply",
    }  # fmt: skip
    with np.load(folder / "out" / "depth.npz") as held:
        z, measured = held["z_m"], held["measured"]
        assert np.isfinite(held["std_m"][measured]).all()
    millimetres = cv2.imread(str(folder / "out" / "depth.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(millimetres[measured], 1e3 * z[measured], atol=0.51)
    cloud = read_ply(folder / "out" / "cloud.ply")
    assert len(cloud.points) == measured.sum() == done["depth"]["points"]
    assert cloud.colors.shape == cloud.points.shape
    assert set(cloud.scalars) == {"std_m", "height_m"}
    page = (folder / "out" / "report.html").read_text()
    for heading in ("The pair", "Disparity", "The cloud", "The ground", "Against the truth"):
        assert f">{heading}<" in page


def test_without_a_calibration_there_is_disparity_only(folder):
    told = run(*files(folder, "left", "right"), "--json", "-o", folder / "bare")
    assert told.exit_code == 0, told.stderr
    document = json.loads(told.stdout)
    assert "depth" not in document
    assert "--calib" in document["conclusion"]
    assert not (folder / "bare" / "cloud.ply").exists()


def test_a_distorted_and_turned_rig_is_rectified_first(folder):
    camera = Camera("brown5", (256.0, 256.0, 160.0, 119.0), (-0.1, 0.01, 0, 0, 0), SIZE)
    cov = np.diag([1e-7, 1e-7, 1e-7, 1e-9, 1e-9, 1e-9])
    turned = StereoRig(camera, camera, np.array([1.0, 0.0, 0.002, 0.0, -0.1, 0.0, 0.0]), cov)
    write_rig(folder / "turned.json", turned)
    told = run(
        *files(folder, "left", "right"), "--calib", folder / "turned.json", "--json", "-o", folder / "turned"
    )
    assert told.exit_code == 0, told.stderr
    document = json.loads(told.stdout)
    assert document["geometry"]["rectified_here"]
    assert document["depth"]["systematic_median_m"] > 0.0
    assert {"rectified_left.png", "rectified_right.png"} <= {
        one.name for one in (folder / "turned").iterdir()
    }
    again = run(*files(folder, "left", "right"), "--calib", folder / "turned.json", "--rectified", "--json")
    assert not json.loads(again.stdout)["geometry"]["rectified_here"]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("right", "left"), "right.png seems to be the right picture and left.png the left one"),
        (("left", "left"), "are the same"),
        (("left", "small"), "a rectified pair has one size"),
        (("pixel", "pixel"), "1x1 px are too small"),
        (("corrupt", "right"), "corrupt.png is cut off"),
        (("left", "nowhere"), "there is no file"),
    ],
)
def test_what_is_no_pair(folder, names, said):
    told = run(*files(folder, *names), "--calib", folder / "rig.json")
    assert told.exit_code == 1
    assert said in " ".join(told.stderr.split())
    assert told.stdout == ""


def test_rows_that_differ_are_measured_and_said(folder):
    told = run(*files(folder, "left", "lower"), "--calib", folder / "rig.json", "--json", "--check")
    assert told.exit_code == 3
    document = json.loads(told.stdout)
    assert document["rows"]["mean_px"] == pytest.approx(9.0, abs=0.2)
    assert not document["rows"]["rectified"]
    assert verdict(document, "rows of the matches")["verdict"] == "FAIL"
    assert "not rectified" in document["conclusion"]


def test_pictures_without_texture(folder):
    told = run(*files(folder, "flat", "flat_too"), "--calib", folder / "rig.json", "--json", "--check")
    assert told.exit_code == 3, told.stderr
    document = json.loads(told.stdout)
    assert verdict(document, "matched pixels")["verdict"] == "FAIL"
    assert "too little to see" in document["conclusion"]


def test_dim_pictures_are_brought_together(folder):
    dim = cv2.imread(str(folder / "right.png")).astype(float) * 0.6 + 8
    cv2.imwrite(str(folder / "dim.png"), dim.astype(np.uint8))
    told = run(
        *files(folder, "left", "dim"),
        "--calib",
        folder / "rig.json",
        "--truth",
        folder / "truth.npy",
        "--json",
    )
    document = json.loads(told.stdout)
    assert verdict(document, "light of the pictures")["verdict"] == "WARN"
    assert document["truth"]["bad2_all"] < 0.1


def test_a_range_that_is_too_short_is_said(folder):
    told = run(
        *files(folder, "left", "right"), "--calib", folder / "rig.json", "--max-disparity", 16, "--json"
    )
    document = json.loads(told.stdout)
    assert document["disparity"]["range_px"][1] == 16
    assert verdict(document, "at the end of the search")["verdict"] == "WARN"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "give two pictures"),
        (("left.png",), "give two pictures"),
        (("a.png", "b.png", "--rectified"), "--rectified goes with --calib"),
        (("--demo", "a.png", "b.png"), "leave out LEFT"),
        (("a.png", "b.png", "--max-disparity", "much"), "neither a whole number"),
        (("a.png", "b.png", "--min-disparity", "9", "--max-disparity", "3"), "the search covers"),
    ],
)
def test_command_lines_that_make_no_sense(arguments, said):
    told = run(*arguments)
    assert told.exit_code == 2
    assert said in " ".join(told.stderr.split())


def test_a_truth_of_another_size(folder):
    np.save(folder / "other.npy", np.ones((3, 4)))
    told = run(*files(folder, "left", "right"), "--truth", folder / "other.npy")
    assert told.exit_code == 1
    assert "(3, 4), rows by columns" in told.stderr


def test_the_motorcycle_of_scikit_image():
    told = run("--demo", "--json", "--check")
    assert told.exit_code == 0, told.stderr
    document = json.loads(told.stdout)
    assert document["truth"]["bad2_all"] < 0.065
    assert document["ground"]["distance_m"] == pytest.approx(1.086, abs=0.01)


def test_the_motorcycle_from_files(data_dir, tmp_path):
    (tmp_path / "calib.txt").write_text(CALIB)
    place = data_dir / "vision/motorcycle"
    told = run(
        place / "motorcycle_left.png", place / "motorcycle_right.png", "--calib", tmp_path / "calib.txt",
        "--truth", place / "motorcycle_disp.npz", "--json",
    )  # fmt: skip
    assert told.exit_code == 0, told.stderr
    document = json.loads(told.stdout)
    assert document["geometry"]["doffs_px"] == pytest.approx(31.086)
    assert not document["geometry"]["rectified_here"]
    assert document["truth"]["bad2_all"] < 0.065
    assert document["depth"]["percentiles_m"]["50"] == pytest.approx(2.63, abs=0.05)
    swapped = run(
        place / "motorcycle_right.png", place / "motorcycle_left.png", "--calib", tmp_path, "--json"
    )
    assert swapped.exit_code == 1
    assert "give them the other way round" in " ".join(swapped.stderr.split())
