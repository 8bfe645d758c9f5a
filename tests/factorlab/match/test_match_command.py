"""What `factorlab match` prints, writes and returns."""

import csv
import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from warped_photos import drawing, moved, noisy, warped

from factorlab.cli import main
from factorlab.cli.match import FEATURES, METHODS, MODELS
from factorlab.match import settings
from vision3d.features import KINDS


def run(*arguments):
    return CliRunner().invoke(main, ["match", *map(str, arguments)])


def said(done):
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


def verdict(whole, metric):
    (one,) = [v for v in whole["verdicts"] if v["metric"] == metric]
    return one


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Two pictures of a plane, and the homography between them."""
    folder, rng = tmp_path_factory.mktemp("pair"), np.random.default_rng(11)
    a, b, truth = warped(drawing(rng, 320, 240), rng, strength=0.12, scale=0.85, angle=0.4)
    cv2.imwrite(str(folder / "a.png"), a)
    cv2.imwrite(str(folder / "b.png"), b)
    return folder / "a.png", folder / "b.png", truth


def test_names_are_those_of_the_library():
    assert FEATURES == KINDS
    assert MODELS == settings.MODELS
    assert tuple(settings.METHODS) == METHODS


def test_a_plane_and_how_sure_it_is(pair, tmp_path):
    a, b, truth = pair
    out = tmp_path / "out"
    whole = said(run(a, b, "--json", "-o", out, "--check"))
    assert whole["overlap"]
    assert whole["geometry"]["kind"] == "homography"
    assert verdict(whole, "scene")["value"] == "planar or turned"
    corners = np.array([[0, 0], [319, 0], [319, 239], [0, 239]], float)
    error = np.array(whole["geometry"]["corners_px"]) - moved(truth, corners)
    covs = np.array(whole["geometry"]["corners_cov_px2"])
    assert np.abs(error).max() < 0.15
    assert np.einsum("ni,nij,nj->n", error, np.linalg.inv(covs), error).max() < 25.0
    assert set(whole["pictures"][0]) == {"name", "size", "features"}
    with (out / "matches.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert sum(int(row["inlier"]) for row in rows) == whole["geometry"]["inliers"]
    assert json.loads((out / "geometry.json").read_text())["matrix"] == whole["geometry"]["matrix"]
    assert cv2.imread(str(out / "matches.png")).shape[2] == 3
    assert "<svg" in (out / "report.html").read_text()


@pytest.mark.parametrize("features", FEATURES)
def test_every_kind_of_features(pair, features):
    a, b, truth = pair
    whole = said(run(a, b, "--json", "--features", features, "--model", "homography"))
    if features in ("sift", "orb"):
        middle = np.array([[160.0, 120.0]])
        place = moved(whole["geometry"]["matrix"], middle)
        assert np.abs(place - moved(truth, middle)).max() < 0.1
    assert whole["kind"] == features


@pytest.mark.parametrize("method", METHODS)
def test_every_method(pair, method):
    a, b, truth = pair
    whole = said(run(a, b, "--json", "--method", method, "--model", "homography"))
    middle = np.array([[160.0, 120.0]])
    assert np.abs(moved(whole["geometry"]["matrix"], middle) - moved(truth, middle)).max() < 0.1


def test_identical_pictures_are_said(pair):
    a, *_ = pair
    whole = said(run(a, a, "--json"))
    assert verdict(whole, "pictures")["value"] == "identical"
    assert "same picture" in whole["conclusion"]


def test_unrelated_pictures_are_said(pair, tmp_path):
    a, *_ = pair
    other = tmp_path / "other.png"
    cv2.imwrite(str(other), noisy(drawing(np.random.default_rng(77)), np.random.default_rng(1), 2.0))
    done = run(a, other, "--json", "--check")
    assert done.exit_code == 3
    whole = json.loads(done.stdout)
    assert not whole["overlap"]
    assert whole["geometry"] is None
    assert "no overlap" in verdict(whole, "overlap")["meaning"]


@pytest.mark.parametrize("size", [(1, 1), (5, 300), (60, 40)])
def test_small_pictures_are_said(pair, tmp_path, size):
    a, *_ = pair
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.full(size, 80, np.uint8))
    for order in ((small, a), (a, small), (small, small)):
        whole = said(run(*order, "--json", "-o", tmp_path / "out", "--force"))
        assert (
            "too few" in verdict(whole, "features of small.png")["meaning"] if order[0] != order[1] else True
        )
        assert not whole["overlap"]


def test_repeated_texture_is_said(tmp_path):
    rng = np.random.default_rng(0)
    tiles = np.tile(drawing(rng, 80, 60), (10, 10))
    turned = np.array([[1, 0.02, -190.0], [0.01, 1, -130], [1e-5, 0, 1]])
    second = cv2.warpPerspective(tiles.astype(np.float32), turned, (480, 360))
    cv2.imwrite(str(tmp_path / "a.png"), noisy(tiles[:360, :480], rng, 2.0))
    cv2.imwrite(str(tmp_path / "b.png"), noisy(second, rng, 2.0))
    for model in ("auto", "homography"):
        whole = said(run(tmp_path / "a.png", tmp_path / "b.png", "--json", "--model", model))
        assert verdict(whole, "repeated texture")["verdict"] == "FAIL"


def test_nine_in_ten_matches_may_be_wrong(pair, tmp_path):
    """A corner of one picture in a heap of another, with a ratio test that lets everything through."""
    a, *_ = pair
    rng = np.random.default_rng(5)
    scene = drawing(rng, 640, 480)
    image = cv2.imread(str(a), 0).astype(float)
    scene[100:190, 200:320] = cv2.resize(image, (320, 240))[60:150, 100:220]
    heap = tmp_path / "heap.png"
    cv2.imwrite(str(heap), noisy(scene, rng, 4.0))
    whole = said(run(a, heap, "--json", "--ratio", "1.0", "--model", "homography"))
    assert whole["inlier_share"] < 0.3
    assert whole["overlap"]
    place = moved(whole["geometry"]["matrix"], np.array([[160.0, 105.0]]))
    assert np.abs(place - (260.0, 145.0)).max() < 0.3


def test_colour_size_and_light_may_differ(pair, tmp_path):
    a, b, truth = pair
    image = cv2.resize(cv2.imread(str(b)), None, fx=2.5, fy=2.5, interpolation=cv2.INTER_CUBIC)
    tinted = (0.6 * image * np.array([0.8, 1.0, 0.9])).astype(np.uint8)
    large = tmp_path / "large.jpg"
    cv2.imwrite(str(large), tinted)
    whole = said(run(a, large, "--json", "--max-size", 900))
    middle = np.array([[160.0, 120.0]])
    expected = (moved(truth, middle) + 0.5) * 2.5 - 0.5
    assert np.abs(moved(whole["geometry"]["matrix"], middle) - expected).max() < 0.3


def test_faults_are_one_sentence(pair, tmp_path):
    a, b, _ = pair
    cut = tmp_path / "cut.jpg"
    cv2.imwrite(str(tmp_path / "whole.jpg"), cv2.imread(str(a)))
    cut.write_bytes((tmp_path / "whole.jpg").read_bytes()[:3000])
    for bad in (cut, tmp_path / "nowhere.png", tmp_path):
        done = run(a, bad)
        assert done.exit_code == 1
        assert done.stderr.count("\n") == 1
    assert run(a, b, "--model", "essential").exit_code == 2
    assert run(a, b, "--camera-b", cut).exit_code == 2
    assert run(a, b, "--threshold", "0").exit_code == 2
    assert run(a).exit_code == 2


def test_box_in_a_scene(data_dir):
    folder = data_dir / "vision/opencv"
    whole = said(run(folder / "box.png", folder / "box_in_scene.png", "--json", "--check"))
    assert whole["geometry"]["kind"] == "homography"
    assert whole["geometry"]["inliers"] >= 70
    assert whole["geometry"]["sigma_px"] < 0.2
    corners = np.array(whole["geometry"]["corners_px"])
    assert np.abs(corners - [(118.1, 160.9), (284.1, 175.5), (267.1, 297.2), (89.7, 271.7)]).max() < 1.0


@pytest.mark.parametrize("names", [("leuvenA.jpg", "leuvenB.jpg"), ("aloeL.jpg", "aloeR.jpg")])
def test_scenes_with_depth(data_dir, names):
    whole = said(run(*(data_dir / "vision/opencv" / name for name in names), "--json"))
    assert whole["geometry"]["kind"] == "fundamental"
    assert verdict(whole, "scene")["value"] == "depth"
    assert whole["geometry"]["inliers"] > 250
