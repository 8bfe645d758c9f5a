"""The practical sessions on recordings of one's own: told without bands where nobody knows the truth."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from factorlab.l19.results import read_claims
from sequential.noise import ImuNoise
from sequential.readers import write_imu
from sequential.sensors import SIX_POSITIONS, ImuErrors, ImuRecording, simulate_imu, tumble, waypoints
from vision3d.boards import Checkerboard
from vision3d.camera import Camera
from vision3d.images import png_bytes
from vision3d.render import board_poses, looking_at, render_scene, render_set, wall

COURSE = Path(__file__).resolve().parents[2] / "examples" / "l19"
ERRORS = ImuErrors(
    ImuNoise(2e-4, 5e-3, 1e-6, 1e-6), accel_bias=[0.3, -0.2, 0.1], gyro_bias=[0.02, 0.0, -0.01]
)
CAMERA = Camera("pinhole", (330.0, 330.0, 159.5, 119.5), (), (320, 240))


def lesson(number, folder, *files):
    """Run an example on files of one's own; its claims by quantity."""
    script = next(COURSE.glob(f"{number}_*.py"))
    done = subprocess.run(
        [sys.executable, script, *files, "-o", "out"],
        cwd=folder, env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True, text=True, timeout=200, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    assert (folder / "out" / f"{script.stem}.png").is_file()
    claims, tables = read_claims(folder / "out" / f"{script.stem}.jsonl")
    return {claim.quantity: claim for claim in claims}, tables


def recording(motion, rng, path):
    made = simulate_imu(motion, rng, errors=ERRORS, field=None).recording
    write_imu(made, path)
    return made


def test_still_then_moving(tmp_path, rng):
    recording(tumble(70.0, rng, rest=60.0), rng, tmp_path / "imu.csv")
    claims, (table,) = lesson("41", tmp_path, "imu.csv")
    found = claims["bruit blanc du gyromètre, N moyen des axes"]
    assert found.value == pytest.approx(np.degrees(2e-4), rel=0.1)
    assert not any(claim.judged for claim in claims.values())
    assert {claim.source for claim in claims.values()} == {"imu.csv"}
    assert [row[0] for row in table.rows] == ["ax", "ay", "az", "gx", "gy", "gz"]


def test_six_positions(tmp_path, rng):
    recording(waypoints(SIX_POSITIONS, 3.0, 1.0), rng, tmp_path / "six.csv")
    claims, (table,) = lesson("42", tmp_path, "six.csv")
    assert claims["écart RMS à g, calibré"].source == "six.csv"
    assert claims["écart RMS à g, brut"].value > 0.1
    np.testing.assert_allclose(table.rows[1][4:], ERRORS.accel_bias, rtol=0, atol=0.02)


def test_shocks(tmp_path, rng):
    made = simulate_imu(tumble(40.0, rng, angle=0.1, sway=0.01, rest=10.0), rng, errors=ERRORS, field=None)
    accel = made.recording.accel.copy()
    for start in range(1800, 3900, 400):
        accel[start : start + 5] += 15.0 * rng.standard_normal(3)
    write_imu(ImuRecording(made.recording.t, accel, made.recording.gyro), tmp_path / "chocs.csv")
    claims, (table,) = lesson("43", tmp_path, "chocs.csv")
    assert claims["NIS moyen avec le Q choisi"].holds
    plain, gated = (row[1] for row in table.rows[1:])
    assert gated < 0.5 * plain, "the gate refuses the shocks"


def test_a_checkerboard(tmp_path, rng):
    board = Checkerboard(9, 6, square_m=0.03)
    poses = board_poses(CAMERA, board, 8, rng)
    for name, image in render_set(CAMERA, board, 8, rng, poses=poses).named():
        (tmp_path / f"{name}.png").write_bytes(png_bytes(image))
    names = sorted(path.name for path in tmp_path.glob("*.png"))
    claims, (table,) = lesson("45", tmp_path, *names)
    assert claims["résidu RMS des photos"].value < 0.2
    fx = float(table.rows[0][3].partition(" ±")[0].replace(",", "."))
    assert fx == pytest.approx(330.0, abs=2.0), "whatever the squares measure"


def test_two_pictures_of_the_desk(tmp_path, rng):
    scene = wall(rng)
    for name, eye in (("a", (0.0, 0.0, 0.0)), ("b", (0.4, -0.2, 0.3))):
        view = render_scene(CAMERA, looking_at(eye, (0.0, 0.0, 2.0)), scene, rng=rng)
        (tmp_path / f"{name}.png").write_bytes(png_bytes(view.image))
    claims, _ = lesson("48", tmp_path, "a.png", "b.png")
    assert claims["couples d'accord"].source == "vos photos"
    assert claims["couples d'accord"].value > 50
