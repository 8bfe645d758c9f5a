"""What `factorlab cloud` prints, writes and returns."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from sequential.manifold import SE3
from vision3d.cloud import read_ply, write_ply
from vision3d.rigid import inverse, transform

FORWARD = np.array([0.0, 0.0, 2.0])
STEP = np.array([0.02, -0.03, 0.01, 0.03, 0.02, -0.02])
TRUTH = SE3().retract(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), STEP)


def run(*arguments):
    return CliRunner().invoke(main, ["cloud", *map(str, arguments)])


@pytest.fixture
def corner(tmp_path, rng):
    """A corner of a room, 60 of 6060 points strewn about, coloured by wall."""
    wall = rng.integers(0, 3, 6000)
    points = rng.uniform(size=(6000, 3)) * [2.0, 1.0, 1.5]
    points[np.arange(6000), wall] = 0.0
    points = np.concatenate([points + 0.002 * rng.standard_normal(points.shape), rng.uniform(-3, 3, (60, 3))])
    colors = np.array([[200, 60, 60], [60, 200, 60], [60, 60, 200], [0, 0, 0]])[
        np.append(wall, np.full(60, 3))
    ]
    return write_ply(tmp_path / "corner.ply", points + FORWARD, colors=colors)


def test_a_cloud_is_described_cleaned_thinned_and_cut_into_planes(corner, tmp_path):
    done = run(
        corner, "--clean", "--voxel", "4cm", "--planes", "4", "--json", "--check", "-o", tmp_path / "out"
    )
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert whole["points_read"] == 6060
    assert 0.005 < whole["stragglers"] < 0.02
    assert len(whole["planes"]) == 3
    normals = np.abs([plane["normal"] for plane in whole["planes"]])
    np.testing.assert_allclose(np.sort(normals.argmax(axis=1)), [0, 1, 2])
    assert (tmp_path / "out" / "report.html").read_text(encoding="utf-8").count("<svg") >= 1
    cloud = read_ply(tmp_path / "out" / "cloud.ply")
    assert len(cloud.points) == whole["points"] < 4000
    assert set(cloud.scalars["plane"]) >= {1.0, 2.0, 3.0}


def test_a_cloud_is_laid_on_another(corner, tmp_path):
    cloud = read_ply(corner)
    other = write_ply(tmp_path / "moved.ply", transform(inverse(TRUTH), cloud.points[::2]))
    done = run(other, "--onto", corner, "--clean", "--json", "--check", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)["registration"]
    assert found["converged"]
    off = SE3().local(TRUTH, np.array(found["target_T_source"]))
    np.testing.assert_allclose(off, 0.0, atol=1e-3)
    laid = read_ply(tmp_path / "out" / "cloud.ply").points
    # what was at the corner is there again
    assert np.abs(np.percentile(laid, 2, axis=0) - FORWARD).max() < 0.03


def test_clouds_that_slide_fail_the_check(tmp_path, rng):
    floor = np.column_stack([rng.uniform(0, 2, (4000, 2)), np.full(4000, 2.0)])
    paths = [write_ply(tmp_path / f"{k}.ply", floor + 0.005 * k * FORWARD) for k in (0, 1)]
    done = run(paths[1], "--onto", paths[0], "--check")
    assert done.exit_code == 3
    assert "slide on each other" in done.stdout


def test_a_surface_is_written(corner, tmp_path):
    done = run(corner, "--clean", "--mesh", "--mesh-depth", "5", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    mesh = read_ply(tmp_path / "out" / "mesh.ply")
    assert len(mesh.faces) > 500
    assert "density" in mesh.scalars


def test_points_that_are_no_numbers_are_counted(tmp_path, rng):
    text = "ply\nformat ascii 1.0\nelement vertex 40\n"
    text += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    rows = [f"{x} {y} {z}" for x, y, z in rng.uniform(size=(39, 3))]
    (tmp_path / "a.ply").write_text(text + "\n".join([*rows, "nan 0 0"]) + "\n")
    done = run(tmp_path / "a.ply", "--json")
    assert done.exit_code == 0, done.stderr
    assert any("no numbers" in v["metric"] and v["value"] == 1 for v in json.loads(done.stdout)["verdicts"])


def test_real_depth_of_a_motorcycle(data_dir, tmp_path):
    """Middlebury's true disparities as a cloud; a third of it, moved, is laid on the whole again."""
    disparity = np.load(data_dir / "vision" / "motorcycle" / "motorcycle_disp.npz")["arr_0"]
    z = 994.978 * 0.193001 / (disparity + 31.086)
    y, x = np.mgrid[: z.shape[0], : z.shape[1]]
    points = np.stack([(x - 311.193) * z / 994.978, (y - 254.877) * z / 994.978, z], axis=-1)[
        np.isfinite(disparity)
    ]
    whole = write_ply(tmp_path / "whole.ply", points)
    part = write_ply(tmp_path / "part.ply", transform(inverse(TRUTH), points[::3]))
    done = run(part, "--onto", whole, "--voxel", "2cm", "--planes", "2", "--json", "--check")
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    off = SE3().local(TRUTH, np.array(told["registration"]["target_T_source"]))
    assert np.degrees(np.linalg.norm(off[:3])) < 0.02
    assert np.linalg.norm(off[3:]) < 1e-3
    # the floor of the garage is level within some degrees of the camera's own tilt, and large
    floor = max(told["planes"], key=lambda plane: abs(plane["normal"][1]))
    assert abs(floor["normal"][1]) > 0.8
    assert floor["points"] > 0.15 * told["points"]


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("nowhere.ply",), 1, "no such file"),
        (("corner.ply", "--voxel", "tiny"), 2, "is a number with a unit"),
        (("corner.ply", "--voxel", "0.00001mm"), 1, "take larger cubes"),
        (("corner.ply", "--onto", "nowhere.ply"), 1, "no such file"),
        (("few.ply",), 1, "it holds 3 points"),
        (("text.ply",), 1, "no PLY file"),
    ],
)
def test_wrong_input_is_a_sentence(corner, tmp_path, monkeypatch, arguments, code, said):
    monkeypatch.chdir(tmp_path)
    write_ply(tmp_path / "few.ply", np.eye(3))
    (tmp_path / "text.ply").write_text("hello")
    done = run(*arguments, "-o", "out")
    assert done.exit_code == code
    assert said in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
