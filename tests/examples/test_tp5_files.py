"""TP5 on files of one's own: a film, a CSV of the unit, a camera; the marker sits askew on the unit."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from vision_imu_worlds import CAMERA, FPS, ROTATIONS, SIZE_M, frames, turning

from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply
from sequential.readers import write_imu
from sequential.sensors import ImuRecording
from vision3d.camera_files import write_camera
from vision3d.render import Plane, marker_texture, render_planes, write_video

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "l19" / "49_tp5_vision_imu.py"
ASKEW = quaternion_exp(np.radians([5.0, -7.0, 3.0]))


def test_files_of_one_s_own(tmp_path, rng):
    motion, gyro, truth = turning(rng, seconds=6.0, angle=0.2)
    _, attitudes = frames(motion)
    texture = marker_texture("4x4_50", 7, SIZE_M)
    images = []
    for q in attitudes:
        pose = np.append(ROTATIONS.normalize(quaternion_multiply(q, ASKEW)), [0.05, 0.0, 0.5])
        images.append(render_planes(CAMERA, [Plane(pose, texture)], rng=rng))
    write_video(tmp_path / "film.avi", images, FPS)
    write_imu(ImuRecording(gyro.t, truth.specific_force, gyro.values), tmp_path / "imu.csv")
    write_camera(CAMERA, tmp_path / "camera.json")
    files = ["--video", "film.avi", "--imu", "imu.csv", "--camera", "camera.json", "--taille", str(SIZE_M)]
    done = subprocess.run(
        [sys.executable, EXAMPLE, *files, "-o", "out"],
        cwd=tmp_path, env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True, text=True, timeout=200, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    assert (tmp_path / "out" / "49_tp5_vision_imu.png").is_file()
    found = done.stdout.split("biais trouvé [")[1].split("]")[0]
    bias = np.degrees(truth.gyro_bias[-1])
    np.testing.assert_allclose(np.array(found.replace(",", ".").split(), dtype=float), bias, atol=0.6)
    assert f"{len(images)} images lues" in done.stdout
