"""What `factorlab line` writes, prints and returns."""

import csv
import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from vision3d.camera import Camera
from vision3d.camera_files import write_camera
from vision3d.frames import open_frames
from vision3d.lines import CameraMount, planar_pose
from vision3d.render import GroundLine, drive, random_line, render_ground, write_video
from vision3d.rigid import transform

CAMERA = Camera("brown5", (266.0, 266.0, 171.0, 117.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (320, 240))
MOUNT = CameraMount(0.2, 0.5)
STRAIGHT = GroundLine(np.array([[-1.0, 0.0], [3.0, 0.0]]), 0.04)
POSE = np.array([0.0, 0.03, 0.05])
HANGS = ("--height", "20cm", "--pitch", np.degrees(0.5))


def run(*arguments):
    return CliRunner().invoke(main, ["line", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A picture of a line, a video of a drive, and the camera that took them."""
    place = tmp_path_factory.mktemp("line")
    rng = np.random.default_rng(5)
    cv2.imwrite(str(place / "line.png"), render_ground(CAMERA, MOUNT, STRAIGHT, POSE, rng=rng))
    cv2.imwrite(str(place / "floor.png"), np.full((240, 320), 130, np.uint8))
    line = random_line(rng, length_m=2.0, width_m=0.03)
    images = [view.image for view in drive(CAMERA, MOUNT, line, rng=rng, fps=10.0)][:20]
    images[7:9] = [np.full_like(images[0], 130)] * 2
    write_video(place / "drive.avi", images, fps=10.0)
    write_camera(CAMERA, place / "camera.yaml", "ros")
    return place


def test_a_picture_in_pixels(folder):
    done = run(folder / "line.png", "--json", "--check")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["line"]["found"]
    assert document["line"]["confidence"] > 0.9
    assert document["line"]["offset"] > 0, "the robot stands to the left of the line"
    assert document["verdicts"][0]["verdict"] == "PASS"
    assert not document["ground_known"]


def test_a_picture_in_metres(folder):
    done = run(
        folder / "line.png", "--camera", folder / "camera.yaml", *HANGS, "--height-sigma", "2mm",
        "--angle-sigma", 0.3, "--json", "-o", folder / "metres",
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    ground = json.loads(done.stdout)["line"]["ground"]
    left, heading = STRAIGHT.seen_from(POSE, ground["near_m"][0])
    assert ground["offset_m"] == pytest.approx(left, abs=1e-3)
    assert ground["heading_deg"] == pytest.approx(np.degrees(heading), abs=0.5)
    assert 1e-4 < ground["sigma_offset_m"] < 0.01
    assert 0.05 < ground["sigma_heading_deg"] < 2.0
    names = {path.name for path in (folder / "metres").iterdir()}
    assert names == {"report.html", "report.json", "frames.csv", "line.png", "ground.png"}
    above = cv2.imread(str(folder / "metres" / "ground.png"))
    assert min(above.shape[:2]) > 100


def test_marks_on_the_ground_do_as_well(folder):
    places = np.array([[0.25, 0.1], [0.25, -0.1], [0.6, 0.15], [0.6, -0.15], [0.4, 0.0]])
    world = MOUNT.world_pose(planar_pose(0.0, 0.0, 0.0))
    pixels = CAMERA.project(transform(world, np.column_stack([places, np.zeros(5)])))
    rows = [",".join(f"{v:.4f}" for v in (*p, *g)) for p, g in zip(pixels, places, strict=True)]
    (folder / "marks.csv").write_text("\n".join(["x_px, y_px, x_m, y_m", *rows]))
    done = run(
        folder / "line.png", "--points", folder / "marks.csv", "--camera", folder / "camera.yaml", "--json"
    )
    assert done.exit_code == 0, done.stderr
    ground = json.loads(done.stdout)["line"]["ground"]
    left, _ = STRAIGHT.seen_from(POSE, ground["near_m"][0])
    assert ground["offset_m"] == pytest.approx(left, abs=1.5e-3)


def test_a_floor_without_a_line(folder):
    done = run(folder / "floor.png", "--check", "-o", folder / "floor")
    assert done.exit_code == 3
    assert "There is no line on the ground to follow; the picture shows no straight lines." in " ".join(
        done.stdout.split()
    )
    assert (folder / "floor" / "segments.png").exists()
    assert run(folder / "floor.png").exit_code == 0


def test_a_video(folder):
    out = folder / "video"
    done = run(folder / "drive.avi", "--camera", folder / "camera.yaml", *HANGS, "--json", "-o", out)
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["source"]["frames"] == 20
    assert document["share_found"] == pytest.approx(0.9)
    by_name = {one["metric"]: one for one in document["verdicts"]}
    assert by_name["frames with a line"]["verdict"] == "WARN"
    assert by_name["longest time without it"]["value"] == pytest.approx(0.2, abs=0.01)
    with (out / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["found"] for row in rows].count("0") == 2
    assert rows[7]["offset_m"] == ""
    assert rows[7]["reason"]
    assert abs(float(rows[0]["offset_m"])) < 0.05
    with open_frames(out / "line.avi") as film:
        assert sum(1 for _ in film) == 20
    page = (out / "report.html").read_text()
    assert "Offset and heading" in page
    assert "<svg" in page


def test_a_lane(tmp_path):
    lines = [GroundLine(np.array([[-0.5, y], [6.0, y]]), 0.03, ink=0.9, floor=0.3) for y in (0.15, -0.15)]
    image = render_ground(CAMERA, CameraMount(0.25, 0.25), lines, np.zeros(3), rng=np.random.default_rng(1))
    cv2.imwrite(str(tmp_path / "lane.png"), image)
    alone = run(tmp_path / "lane.png", "--check")
    assert alone.exit_code == 3
    assert "1 other stripe looks as much like a line" in alone.stdout
    done = run(tmp_path / "lane.png", "--lane", "--json", "--check")
    assert done.exit_code == 0
    document = json.loads(done.stdout)
    assert document["lane"]["found"]
    assert document["conclusion"].startswith("A lane, its middle")
    assert abs(document["lane"]["offset"]) < 0.1


def test_a_building_is_no_line(data_dir):
    done = run(data_dir / "vision/opencv/building.jpg", "--json", "--check")
    assert done.exit_code == 3
    document = json.loads(done.stdout)
    assert not document["line"]["found"]
    assert document["line"]["confidence"] < 0.1
    assert document["scene"]["built"]
    assert document["scene"]["segments"] > 80
    kinds = [point["kind"] for point in document["scene"]["vanishing_points"]]
    assert kinds[:2] == ["upright", "level"]
    assert "as on a building" in document["conclusion"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--height", "20cm"), "metres take --camera, --height and --pitch together"),
        (("--height", "20cm", "--pitch", "30"), "metres take --camera"),
        (("--height-sigma", "2mm"), "--height-sigma goes with --height and --pitch"),
        (("--points", "marks.csv", "--pitch", "30"), "--pitch does too"),
        (("--camera", "{folder}/camera.yaml", "--height", "twenty", "--pitch", "30"), "number with a unit"),
        (("--middle", "0.3", "--top", "0.4"), "top <= middle"),
        (("--width", "0.5", "0.1"), "least < largest"),
        (("--polarity", "red"), "'red' is not one of"),
    ],
)
def test_a_command_line_that_contradicts_itself(folder, arguments, said):
    done = run(folder / "line.png", *(one.format(folder=folder) for one in arguments))
    assert done.exit_code == 2
    assert said in done.stderr


def test_files_at_fault_are_one_sentence(folder, tmp_path):
    (tmp_path / "few.csv").write_text("x_px,y_px,x_m,y_m\n1,2,3,4\n")
    (tmp_path / "words.csv").write_text("x_px,y_px,x_m,y_m\n1,2,3,far\n")
    (tmp_path / "columns.csv").write_text("u,v,x_m,y_m\n1,2,3,4\n")
    write_camera(
        Camera("pinhole", (500.0, 500.0, 320.0, 240.0), (), (640, 480)), tmp_path / "large.yaml", "ros"
    )
    for arguments, said in (
        ((tmp_path / "none.png",), "none.png"),
        ((folder / "line.png", "--points", tmp_path / "few.csv"), "four points or more"),
        ((folder / "line.png", "--points", tmp_path / "words.csv"), "line 2: expected four numbers"),
        ((folder / "line.png", "--points", tmp_path / "columns.csv"), "x_px, y_px missing"),
        ((folder / "line.png", "--points", tmp_path / "no.csv"), "there is no file"),
        (
            (folder / "line.png", "--camera", tmp_path / "large.yaml", *HANGS),
            "images of 640x480 px, these are 320x240",
        ),
    ):
        done = run(*arguments)
        assert done.exit_code == 1, said
        assert said in done.stderr
        assert done.stderr.startswith("error: ")
        assert done.stderr.count("\n") == 1


def test_results_are_not_overwritten(folder, tmp_path):
    assert run(folder / "line.png", "-o", tmp_path / "out").exit_code == 0
    assert run(folder / "line.png", "-o", tmp_path / "out").exit_code == 1
    assert run(folder / "line.png", "-o", tmp_path / "out", "--force").exit_code == 0


def test_reading_ends_when_asked_to_and_keeps_what_it_has(folder):
    from factorlab.lines import LineJob, read_lines

    seen = []
    run = read_lines(
        str(folder / "drive.avi"),
        LineJob(),
        on_frame=lambda frame, *_: seen.append(frame.index),
        stop=lambda: len(seen) == 5,
    )
    assert len(run.reads) == 5
    assert run.found.all()


def test_frames_with_a_lane_count_where_one_is_asked_for(tmp_path):
    lines = [GroundLine(np.array([[-0.5, y], [6.0, y]]), 0.03, ink=0.9, floor=0.3) for y in (0.15, -0.15)]
    mount = CameraMount(0.25, 0.25)
    images = [render_ground(CAMERA, mount, lines, np.array([0.1 * k, 0.0, 0.0])) for k in range(4)]
    write_video(tmp_path / "road.avi", images, fps=10.0)
    by_line = json.loads(run(tmp_path / "road.avi", "--json").stdout)
    by_lane = json.loads(run(tmp_path / "road.avi", "--lane", "--json").stdout)
    assert by_line["share_found"] < 0.5
    assert by_lane["share_found"] == 1.0
    assert by_lane["verdicts"][0]["metric"] == "frames with a line or lane"
