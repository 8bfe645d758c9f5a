"""`factorlab match --model essential`: rendered motions, and scenes that determine none."""

import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.camera_files import formats_for
from vision3d.render import desk, looking_at, render_scene, repeated_wall, wall

CAMERA = Camera("brown4", (300.0, 300.0, 159.5, 119.5), (-0.12, 0.03, 0.0, 0.0), (320, 240))
MOVED = looking_at((0.25, -0.08, 0.02), (0.0, 0.1, 1.5))
TURNED = np.array([0.998, 0.02, 0.055, 0.01, 0.0, 0.0, 0.0])


@pytest.fixture
def shoot(tmp_path):
    """Run the command on two pictures of a scene."""

    def run(scene, pose, *arguments):
        rng = np.random.default_rng(8)
        turned = np.concatenate([pose[:4] / np.linalg.norm(pose[:4]), pose[4:]])
        for name, where in (("a", SE3().identity()), ("b", turned)):
            view = render_scene(CAMERA, where, scene, rng=rng, supersample=2)
            cv2.imwrite(str(tmp_path / f"{name}.png"), view.image)
        own = next(one for one in formats_for(CAMERA) if one.file_name.endswith(".json"))
        (tmp_path / "camera.json").write_text(own.text(CAMERA, "camera"))
        done = CliRunner().invoke(
            main,
            [
                "match",
                *(str(tmp_path / f"{n}.png") for n in "ab"),
                *("--camera", str(tmp_path / "camera.json"), "--model", "essential", "--json"),
                *map(str, arguments),
            ],
        )
        assert done.exit_code == 0, done.stderr
        return json.loads(done.stdout)

    return run


def scene_of(whole):
    return next(v for v in whole["verdicts"] if v["metric"] == "scene")


def test_a_motion_and_its_words(shoot, tmp_path):
    whole = shoot(desk(np.random.default_rng(3)), MOVED, "-o", tmp_path / "out")
    assert scene_of(whole)["value"] == "general"
    assert scene_of(whole)["verdict"] == "PASS"
    pose = np.array(whole["geometry"]["b_T_a"])
    assert np.abs(pose[:4] - MOVED[:4]).max() < 0.003
    assert pose[4:] @ MOVED[4:] / np.linalg.norm(MOVED[4:]) > 0.9995
    assert "Motion" in (tmp_path / "out" / "report.html").read_text()


def test_a_turn_has_no_translation(shoot):
    whole = shoot(desk(np.random.default_rng(3)), TURNED)
    assert scene_of(whole)["value"] == "pure rotation"
    assert scene_of(whole)["verdict"] == "WARN"


def test_a_plane_is_said(shoot):
    whole = shoot(wall(np.random.default_rng(3)), MOVED)
    assert scene_of(whole)["value"] == "planar"


def test_identical_pictures(shoot):
    whole = shoot(desk(np.random.default_rng(3)), SE3().identity())
    assert scene_of(whole)["value"] in ("identical", "pure rotation")


def test_bricks_are_no_evidence(shoot):
    """Equal bricks fit many motions: whatever is found is said to be unsure."""
    whole = shoot(repeated_wall(np.random.default_rng(3)), MOVED)
    assert {v["verdict"] for v in whole["verdicts"]} & {"WARN", "FAIL"}
