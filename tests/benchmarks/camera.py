"""Figures of the camera beside OpenCV: the same pixels, their derivatives, their rays, and what they cost.

`python camera.py [--json]`.  Errors are the largest over every lens; times are ratios of CPU time taken in
turn in this process.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
from measure.figures import Figure, publish, say
from measure.timing import cpu_seconds

sys.path.append(str(Path(__file__).resolve().parents[1]))

from lens_family import EVERY_CAMERA, camera_of, points_seen

from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.pose import estimate_pose, project_object
from vision3d.undistort import undistort_maps, undistorted_camera

BOARD = 0.025 * np.array([[x, y, 0.0] for y in range(6) for x in range(9)])
POINTS, TRIALS = 10_000, 400
ZERO = np.zeros(3)


def exactness(rng: np.random.Generator) -> dict[str, Figure]:
    """Largest differences over the lenses."""
    pixels, rays, slopes = 0.0, 0.0, 0.0
    for camera in EVERY_CAMERA:
        points = points_seen(camera, rng, 2000)
        ours, d_point, d_parameters = camera.project_jacobians(points)
        project = cv2.fisheye.projectPoints if camera.lens == "fisheye4" else cv2.projectPoints
        theirs = project(points.reshape(-1, 1, 3), ZERO, ZERO, camera.matrix, camera.distortion_opencv)[0]
        pixels = max(pixels, float(np.abs(ours - theirs.reshape(-1, 2)).max()))
        unit = points / np.linalg.norm(points, axis=1, keepdims=True)
        rays = max(rays, float(np.abs(camera.unproject(ours) - unit).max()))
        for slope, difference in (
            (d_point, differences(lambda d, c=camera, p=points: c.project(p + d), np.zeros(3))),
            (
                d_parameters,
                differences(lambda p, c=camera, q=points: c.with_parameters(p).project(q), camera.parameters),
            ),
        ):
            slopes = max(slopes, float(np.abs(slope - difference).max() / np.abs(slope).max()))
    said = f"{len(EVERY_CAMERA)} lenses"
    return {
        "projection_off_opencv": Figure(pixels, "px", said, 1e-9),
        "ray_there_and_back": Figure(rays, "", said, 1e-12),
        "jacobian_off_differences": Figure(slopes, "", said, 1e-7),
    }


def differences(function: object, at: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """Central differences of fourth order, along the last axis."""
    columns = []
    for move in step * np.eye(len(at)):
        near, far = (function(at + k * move) - function(at - k * move) for k in (1, 2))
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.stack(columns, axis=-1)


def costs(rng: np.random.Generator) -> dict[str, Figure]:
    """CPU time, ours over OpenCV's."""
    camera = camera_of("brown5")
    K, d = camera.matrix, camera.distortion_opencv
    points = points_seen(camera, rng, POINTS)
    pixels = np.ascontiguousarray(camera.project(points))
    target = undistorted_camera(camera)
    pose = np.array([0.97, 0.15, -0.18, 0.05, -0.1, -0.06, 0.5])
    pose[:4] /= np.linalg.norm(pose[:4])
    seen = project_object(camera, pose, BOARD) + 0.1 * rng.standard_normal((len(BOARD), 2))
    pairs = {
        "projection_with_jacobians": (
            lambda: camera.project_jacobians(points),
            lambda: cv2.projectPoints(points, ZERO, ZERO, K, d),
        ),
        "rays": (lambda: camera.unproject(pixels), lambda: cv2.undistortPoints(pixels[:, None], K, d)),
        "undistortion_maps": (
            lambda: undistort_maps(camera, target),
            lambda: cv2.initUndistortRectifyMap(K, d, None, K, camera.size, cv2.CV_32FC1),
        ),
        "pose_of_a_board": (
            lambda: estimate_pose(camera, BOARD, seen, 0.1),
            lambda: cv2.solvePnP(BOARD, seen, K, d),
        ),
    }
    figures = {}
    for name, (ours, theirs) in pairs.items():
        spent = cpu_seconds({"ours": ours, "theirs": theirs})
        said = f"ours {1e3 * spent['ours']:.2f} ms, OpenCV {1e3 * spent['theirs']:.2f} ms"
        figures[f"{name}_time_ratio"] = Figure(spent["ours"] / spent["theirs"], "x", said)
    return figures


def honesty(rng: np.random.Generator) -> dict[str, Figure]:
    """NEES over its six degrees of freedom, of a board's pose."""
    figures = {}
    for lens in ("brown5", "fisheye4"):
        camera = camera_of(lens)
        nees = [_nees(camera, rng) for _ in range(TRIALS)]
        figures[f"pose_nees_{lens}"] = Figure(
            float(np.mean(nees)) / 6.0, "", f"{TRIALS} poses; 1 = honest", 1.15
        )
    return figures


def _nees(camera: Camera, rng: np.random.Generator, sigma_px: float = 0.2) -> float:
    truth = SE3().retract(
        np.array([1.0, 0.0, 0.0, 0.0, -0.1, -0.0625, rng.uniform(0.4, 0.8)]),
        np.array([*rng.uniform(-0.6, 0.6, 3), 0.0, 0.0, 0.0]),
    )
    pixels = project_object(camera, truth, BOARD) + sigma_px * rng.standard_normal((len(BOARD), 2))
    estimate = estimate_pose(camera, BOARD, pixels, sigma_px)
    error = SE3().local(estimate.camera_T_object, truth)
    return float(error @ np.linalg.solve(estimate.cov, error))


def main() -> int:
    """Measure everything."""
    rng = np.random.default_rng(0)
    figures: dict[str, Figure] = {}
    for what, work in (("exactness", exactness), ("honesty", honesty), ("cost", costs)):
        say(what)
        figures |= work(rng)
    return publish(figures)


if __name__ == "__main__":
    sys.exit(main())
