"""What `factorlab objects` prints, writes and returns."""

import csv
import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from onnx_worlds import colour_detector, colour_instances, colour_segmenter, constant, scene

from factorlab.cli import main
from factorlab.cli.objects import LAYOUTS
from vision3d import objects

NAMES = {"names": {0: "red", 1: "blue"}}


def run(*arguments):
    return CliRunner().invoke(main, ["objects", *map(str, arguments)])


@pytest.fixture
def picture(tmp_path):
    """A red and a blue square on a dark ground, and where they are."""
    image, boxes = scene()
    path = tmp_path / "squares.png"
    cv2.imwrite(str(path), image)
    return path, boxes


def test_the_layouts_are_the_library_s():
    assert LAYOUTS == objects.LAYOUTS


@pytest.mark.parametrize("colour", ["red", "blue", "hsv:170-10,100-255,50-255"])
def test_a_colour(picture, colour):
    path, boxes = picture
    done = run(path, "--color", colour, "--json", "--check")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    (one,) = whole["objects"]
    box = boxes["blue" if colour == "blue" else "red"]
    assert one["box_px"] == pytest.approx(box, abs=1)
    assert one["centre_px"] == pytest.approx((box[0] + 19.5, box[1] + 19.5), abs=0.5)
    assert {v["verdict"] for v in whole["verdicts"]} == {"PASS"}


@pytest.mark.parametrize("space", [(), ("--space", "lab")])
def test_a_sample(picture, space):
    path, boxes = picture
    left, top, _, _ = boxes["blue"]
    done = run(path, "--sample", f"{left + 10},{top + 10},12,12", *space, "--json")
    assert done.exit_code == 0, done.stderr
    (one,) = json.loads(done.stdout)["objects"]
    assert one["name"] == "sample"
    assert one["box_px"] == pytest.approx(boxes["blue"], abs=1)


@pytest.mark.parametrize("rows_first", [False, True])
def test_a_detector(picture, tmp_path, rows_first):
    path, boxes = picture
    model = colour_detector(tmp_path / "net.onnx", rows_first=rows_first, notes=NAMES)
    done = run(path, "--onnx", model, "--overlap", "0.1", "--json")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert whole["network"]["layout"] == ("yolov5" if rows_first else "yolo")
    assert whole["network"]["canvas"] == [64, 64]
    found = {one["name"]: one for one in whole["objects"][::-1]}
    for name, box in boxes.items():
        middle = np.array(box[:2]) + 19.5
        assert np.hypot(*(np.array(found[name]["centre_px"]) - middle)) < 25


def test_a_map_of_classes_writes_its_files(picture, tmp_path):
    path, boxes = picture
    names = tmp_path / "names.txt"
    names.write_text("ground\nred\n\nblue\n", encoding="utf-8")
    model = colour_segmenter(tmp_path / "net.onnx")
    done = run(path, "--onnx", model, "--names", names, "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    assert "blue" in done.stdout
    files = {one.name for one in (tmp_path / "out").iterdir()}
    assert files == {"report.html", "report.json", "objects.csv", "objects.png", "mask.png"}
    rows = list(csv.DictReader((tmp_path / "out" / "objects.csv").read_text(encoding="utf-8").splitlines()))
    assert {row["name"] for row in rows} == set(boxes)
    mask = cv2.imread(str(tmp_path / "out" / "mask.png"), cv2.IMREAD_UNCHANGED)
    left, top, width, height = boxes["blue"]
    assert mask[top + height // 2, left + width // 2] == 2
    assert cv2.imread(str(tmp_path / "out" / "objects.png")).shape == (120, 200, 3)
    again = run(path, "--color", "red", "-o", tmp_path / "out")
    assert again.exit_code == 1
    assert "--force" in again.stderr


def test_masks_of_objects(picture, tmp_path):
    path, boxes = picture
    model = colour_instances(tmp_path / "net.onnx", notes=NAMES)
    done = run(path, "--onnx", model, "--overlap", "0.1", "--json", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert all(one["area_px"] > 0 for one in whole["objects"])
    mask = cv2.imread(str(tmp_path / "out" / "mask.png"), cv2.IMREAD_UNCHANGED)
    for left, top, width, height in boxes.values():
        assert mask[top + height // 2, left + width // 2] == 255
    assert mask[5, 100] == 0


def test_nothing_found_fails_only_with_check(picture):
    path, _ = picture
    assert run(path, "--color", "green").exit_code == 0
    done = run(path, "--color", "green", "--check")
    assert done.exit_code == 3
    assert "--sample" in done.stdout


def test_all_smarties_of_a_colour(data_dir):
    path = data_dir / "vision" / "opencv" / "smarties.png"
    counts = {
        colour: len(json.loads(run(path, "--color", colour, "--min-area", "800", "--json").stdout)["objects"])
        for colour in ("green", "blue")
    }
    assert counts == {"green": 3, "blue": 3}


def test_a_picture_without_colour(tmp_path):
    path = tmp_path / "grey.png"
    cv2.imwrite(str(path), np.full((20, 20), 80, np.uint8))
    assert run(path, "--color", "red").exit_code == 0
    done = run(path, "--sample", "2,2,9,9")
    assert done.exit_code == 1
    assert "no one hue" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((), 2, "--sample"),
        (("--color", "red", "--sample", "1,2,3,4"), 2, "contradict"),
        (("--color", "reddish"), 2, "known are"),
        (("--color", "hsv:1-2"), 2, "three"),
        (("--color", "red", "--confidence", "0.5"), 2, "goes with --onnx"),
        (("--color", "red", "--space", "lab"), 2, "--sample"),
        (("--sample", "1,2,x,4"), 2, "4 numbers"),
        (("--sample", "900,900,5,5"), 1, "no pixel"),
        (("--onnx", "nowhere.onnx", "--size", "0x5"), 2, "one pixel"),
        (("--onnx", "nowhere.onnx", "--size", "wide"), 2, "2 numbers"),
        (("--onnx", "nowhere.onnx"), 1, "nowhere.onnx"),
        (("--onnx", "nowhere.onnx", "--open", "5"), 2, "goes with --color"),
    ],
)
def test_bad_input_is_one_sentence(picture, arguments, code, words):
    done = run(picture[0], *arguments)
    assert done.exit_code == code
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert code == 2 or len(done.stderr.splitlines()) == 1


def test_bad_files_are_one_sentence(picture, tmp_path):
    path, _ = picture
    text = tmp_path / "text.onnx"
    text.write_text("hello", encoding="utf-8")
    for arguments, words in (
        ((path, "--onnx", text), "no ONNX network"),
        ((text, "--color", "red"), "picture"),
        ((tmp_path / "none.png", "--color", "red"), "no file"),
        ((path, "--onnx", constant(tmp_path / "odd.onnx", out=np.zeros((1, 3)))), "no family"),
        ((path, "--onnx", colour_detector(tmp_path / "n.onnx"), "--size", "96x96"), "give its size"),
        ((path, "--onnx", colour_detector(tmp_path / "m.onnx"), "--layout", "ssd"), "another layout"),
        ((path, "--onnx", colour_detector(tmp_path / "k.onnx"), "--layout", "mask"), "another layout"),
        ((path, "--onnx", colour_segmenter(tmp_path / "s.onnx"), "--layout", "yolo"), "another layout"),
        ((path, "--onnx", colour_detector(tmp_path / "l.onnx"), "--names", path), "UTF-8"),
    ):
        done = run(*arguments)
        assert done.exit_code == 1, done.stderr
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1
