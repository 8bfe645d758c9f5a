"""`factorlab markers … --map`: from rendered pixels and an IMU's table to a map; what is refused."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.marker_map.world import MarkerWorld
from sequential.manifold import SE3, rotation_matrix
from sequential.readers import read_tum
from vision3d.camera_files import write_camera
from vision3d.render import Plane, marker_texture, render_planes, write_video
from vision3d.rigid import compose, inverse

DICTIONARY, FPS = "4x4_50", 12.0


def run(*arguments):
    return CliRunner().invoke(main, ["markers", *map(str, arguments)], catch_exceptions=False)


def rendered(world, poses, rng):
    """Photographs of the room from poses of the body."""
    textures = {number: marker_texture(DICTIONARY, number, world.size_m) for number in world.markers}
    for pose in poses:
        camera_T_world = inverse(compose(pose, world.body_T_camera))
        seen = {number: compose(camera_T_world, marker) for number, marker in world.markers.items()}
        far_first = sorted((n for n in seen if seen[n][6] > 0.2), key=lambda n: -seen[n][6])
        yield render_planes(world.camera, [Plane(seen[n], textures[n]) for n in far_first], rng=rng)


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """Files of two seconds in a room with five markers, and the truth."""
    rng = np.random.default_rng(4)
    folder, world = tmp_path_factory.mktemp("room"), MarkerWorld.room(rng, count=5)
    told = world.record(2.0, rng, fps=FPS)
    write_video(folder / "v.avi", rendered(world, told.truth.poses, rng), FPS)
    write_camera(world.camera, folder / "camera.json")
    camera_T_imu, matrix = inverse(world.body_T_camera), np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation_matrix(camera_T_imu[:4]), camera_T_imu[4:]
    rows = "".join(f"  - {row}\n" for row in matrix.tolist())
    (folder / "chain.yaml").write_text(f"cam0:\n  T_cam_imu:\n{rows}  timeshift_cam_imu: 0.0\n")
    lines = [
        ",".join(f"{v:.7f}" for v in (1e-9 * t, *force, *rate))
        for t, force, rate in zip(told.imu.t, told.imu.accel, told.imu.gyro, strict=True)
    ]
    (folder / "imu.csv").write_text("\n".join(["t_s,ax,ay,az,gx,gy,gz", *lines]) + "\n")
    return folder, world, told


def given(room, *, imu=True):
    folder = room[0]
    files = (
        folder / "v.avi",
        "--camera",
        folder / "camera.json",
        "--size",
        "120mm",
        "--dictionary",
        DICTIONARY,
    )
    return (*files, "--imu", folder / "imu.csv", "--extrinsics", folder / "chain.yaml") if imu else files


@pytest.mark.parametrize("imu", [True, False])
def test_from_pixels_to_a_map(room, imu, tmp_path):
    _, world, told = room
    out = tmp_path / "map"
    done = run(*given(room, imu=imu), "--reference", 7, "--map", out, "--json")
    assert done.exit_code == 0, done.stderr
    numbers = json.loads(done.stdout)
    truth = {n: compose(inverse(world.markers[7]), pose) for n, pose in world.markers.items()}
    assert numbers["reference"] == 7
    assert {one["id"] for one in numbers["markers"]} == set(world.markers)
    poses = {one["id"]: np.array(one["world_T_marker"]) for one in numbers["markers"]}
    for number, expected in truth.items():
        step = SE3().local(compose(inverse(poses[7]), poses[number]), expected)
        assert np.linalg.norm(step[3:]) < 0.02
        assert np.degrees(np.linalg.norm(step[:3])) < 1.5
    names = {"report.html", "report.json", "map.json", "map.yaml", "camera.tum", "trajectory.csv"}
    assert names | ({"body.tum"} if imu else set()) == {path.name for path in out.iterdir()}
    way = read_tum(out / "camera.tum")
    camera = compose(told.truth.poses, world.body_T_camera)
    steps = np.diff(way.position, axis=0), np.diff(camera[:, 4:], axis=0)
    np.testing.assert_allclose(*(np.linalg.norm(one, axis=1) for one in steps), atol=0.03)
    assert (numbers["imu"] is not None) == imu
    header = (out / "trajectory.csv").read_text().splitlines()[0]
    assert ("sigma_bgz_rad_s" in header) == imu


def test_the_demo_is_its_own_input(tmp_path):
    done = run("--demo", "--map", tmp_path / "map", "--check")
    assert done.exit_code == 0, done.stderr
    assert "8 of 8 markers are placed by camera and IMU" in done.stdout
    assert "FAIL" not in done.stdout
    assert json.loads((tmp_path / "map" / "map.json").read_text())["world"] == "z up"


def test_what_is_refused_as_usage(room, tmp_path):
    files, folder = given(room, imu=False), room[0]
    for arguments, words in (
        ((), "give SOURCE"),
        ((*files, "--imu", "x.csv"), "--imu goes with --map"),
        ((files[0], "--map", tmp_path), "a map needs --camera"),
        ((*files, "--map", tmp_path, "-o", tmp_path), "leave out -o"),
        ((*files, "--map", tmp_path, "--imu", folder / "imu.csv"), "--imu needs --extrinsics"),
        ((*files, "--map", tmp_path, "--time-offset", "1"), "--time-offset goes with --imu"),
        (("v.avi", "--demo", "--map", tmp_path), "leave out SOURCE"),
        (("--demo", "--size", "5cm", "--camera", "c", "--map", tmp_path), "leave out --camera"),
    ):
        done = run(*arguments)
        assert done.exit_code == 2, arguments
        assert words in done.stderr.replace("\n", " ")


def test_faults_of_the_data_are_sentences(room, tmp_path):
    folder = room[0]
    files = given(room, imu=False)
    (folder / "late.csv").write_text(
        "\n".join(
            line if k == 0 else f"{float(line.split(',')[0]) + 500.0:.6f},{line.split(',', 1)[1]}"
            for k, line in enumerate((folder / "imu.csv").read_text().splitlines())
        )
    )
    (folder / "bad.yaml").write_text("cam0:\n  T_cam_imu: [1, 2, 3]\n")
    for arguments, words in (
        (("--imu", folder / "late.csv", "--extrinsics", folder / "chain.yaml"), "no time in common"),
        (("--imu", folder / "imu.csv", "--extrinsics", folder / "bad.yaml"), "T_cam_imu is four rows"),
        (("--imu", folder / "imu.csv", "--extrinsics", folder / "camera.json"), "holds no T_cam_imu"),
        (("--reference", "44"), "marker 44 was not seen"),
    ):
        done = run(*files, "--map", tmp_path / "map", *arguments)
        assert done.exit_code == 1, arguments
        assert words in done.stderr.replace("\n", " ")
        assert not (tmp_path / "map").exists()
