"""Figures of the line follower and of the renderer that judges it.

`python lines.py [--json]`.  Lines are rendered on plain floors and on floors with grain, joints, a shadow and
a lens that is out of focus; the same floors without a line count false alarms, and so do photographs where
FACTORLAB_DATA is set.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import cv2
import numpy as np
from measure.figures import Figure, publish, say
from measure.timing import cpu_seconds

from sequential.manifold import SE3
from vision3d.boards import Checkerboard
from vision3d.camera import Camera
from vision3d.lines import CameraMount, GroundHomography, find_line, find_segments, planar_pose
from vision3d.render import (
    Plane,
    board_planes,
    board_poses,
    line_pixels,
    picture,
    random_line,
    render_ground,
    render_planes,
)

CAMERA = Camera("brown5", (533.0, 533.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (640, 480))
MOUNT = CameraMount(0.2, 0.5)
FRAMES, FLOORS = 120, 60
LOOKS = ((0.1, 0.7), (0.3, 0.55), (0.9, 0.4), (0.12, 0.35))


def a_line(rng: np.random.Generator, k: int) -> tuple[object, np.ndarray]:
    """A line and a robot beside it."""
    ink, floor = LOOKS[k % len(LOOKS)]
    line = random_line(rng, width_m=rng.uniform(0.02, 0.06), bend_per_m=0.7, ink=ink, floor=floor)
    return line, line.at(rng.uniform(0.0, 2.0)) + rng.normal(0.0, [0.0, 0.03, 0.1])


def plain_floor(rng: np.random.Generator) -> dict[str, Figure]:
    """Found, and where."""
    errors, found = [], 0
    for k in range(FRAMES):
        line, pose = a_line(rng, k)
        reading = find_line(render_ground(CAMERA, MOUNT, line, pose, rng=rng, noise=(2.0, 5.0)[k % 2]))
        found += reading.found
        if reading.found:
            rows = (reading.bottom_px[1], reading.middle_px[1])
            truth = line_pixels(CAMERA, MOUNT, line, pose, rows)
            errors.append([reading.bottom_px[0] - truth[0], reading.middle_px[0] - truth[1]])
    off = np.abs(np.array(errors))
    said = f"{FRAMES} frames, dark and light lines"
    return {
        "found_on_plain_floors": Figure(100.0 * found / FRAMES, "%", said, 98.0, 100.0, "higher"),
        "bottom_error_median": Figure(float(np.median(off[:, 0])), "px", said, 0.15, 0.05),
        "middle_error_median": Figure(float(np.median(off[:, 1])), "px", said, 0.15, 0.05),
        "error_95_percent": Figure(float(np.percentile(off, 95)), "px", said, 0.5, 0.2),
    }


def floor_texture(rng: np.random.Generator) -> np.ndarray:
    """Grain of several sizes, and joints of tiles or planks: reflectance (1000, 1000)."""
    level = rng.uniform(0.4, 0.65)
    image = np.full((1000, 1000), level)
    for size in (6, 30, 120):
        coarse = rng.normal(0.0, 0.02, (1000 // size + 2, 1000 // size + 2)).astype(np.float32)
        image += cv2.resize(coarse, (1000, 1000), interpolation=cv2.INTER_CUBIC)
    pitch, angle = int(rng.integers(100, 250)), rng.uniform(0, np.pi)
    u, v = np.meshgrid(np.arange(1000), np.arange(1000))
    for turn in (angle, angle + np.pi / 2):
        along = (u * np.cos(turn) + v * np.sin(turn)) % pitch
        image[along < 1.5] -= 0.15  # 4.5 mm wide
    return np.clip(image, 0.05, 1.0)


def shaded(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A soft shadow across the image, to a half of the light."""
    angle, place = rng.uniform(0, 2 * np.pi), rng.uniform(-150, 150)
    u, v = np.meshgrid(np.arange(640) - 320.0, np.arange(480) - 240.0)
    side = u * np.cos(angle) + v * np.sin(angle) - place
    light = 1.0 - 0.5 / (1.0 + np.exp(-side / rng.uniform(15, 60)))
    return np.clip(image * light, 0, 255).astype(np.uint8)


def real_floor(rng: np.random.Generator) -> dict[str, Figure]:
    """Found on floors that have a structure of their own, and false alarms on the same without a line."""
    found = false = 0
    for k in range(FLOORS):
        line, pose = a_line(rng, k % 3)
        ground = picture(floor_texture(rng), 3.0, centre=tuple(pose[:2]))
        place = MOUNT.world_pose(planar_pose(*pose))
        planes = [Plane(place, ground), Plane(place, line.stripe)]
        looks = {"rng": rng, "supersample": 2, "blur_px": rng.uniform(0.7, 2.5)}
        floor, with_line = (render_planes(CAMERA, planes[:count], **looks) for count in (1, 2))
        found += find_line(shaded(with_line, rng)).found
        false += find_line(shaded(floor, rng)).found
    said = f"{FLOORS} floors with grain, joints, a shadow"
    return {
        "found_on_real_floors": Figure(100.0 * found / FLOORS, "%", said, 90.0, 97.0, "higher"),
        "false_on_the_same_floors": Figure(100.0 * false / FLOORS, "%", said, 2.0, 0.5),
    }


def other_pictures(rng: np.random.Generator) -> dict[str, Figure]:
    """False alarms on boards and photographs."""
    images = [
        render_planes(CAMERA, board_planes(Checkerboard(9, 6, 0.025), pose), rng=rng)
        for pose in board_poses(CAMERA, Checkerboard(9, 6, 0.025), 20, rng)
    ]
    images += [rng.integers(0, 256, (480, 640), dtype=np.uint8) for _ in range(5)]
    folder = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision"
    images += [cv2.imread(str(path)) for path in sorted(folder.glob("*/*.[jp][pn]g"))]
    false = sum(find_line(image).found for image in images)
    value = 100.0 * false / len(images)
    return {"false_on_other_pictures": Figure(value, "%", f"{len(images)} pictures", 2.0, 0.0)}


def ground_honesty(rng: np.random.Generator) -> dict[str, Figure]:
    """NEES over two degrees of freedom of offset and heading in metres, with a mount that is off."""
    cov = np.diag(np.square([0.008, 0.008, 0.008, 0.001, 0.001, 0.002]))
    nees = []
    for k in range(FRAMES):
        line, pose = a_line(rng, k % 3)
        line = type(line)(np.array([[-1.0, 0.0], [4.0, 0.0]]), line.width_m, line.ink, line.floor)
        pose = np.array([0.3, *rng.normal(0.0, [0.03, 0.1])])
        reading = find_line(render_ground(CAMERA, MOUNT, line, pose, rng=rng))
        if not reading.found:
            continue
        guess = SE3().retract(MOUNT.pose, rng.multivariate_normal(np.zeros(6), cov))
        metres = GroundHomography.from_camera(CAMERA, guess, cov).read(reading)
        left, heading = line.seen_from(pose, float(metres.near[0]))
        error = np.array([metres.offset_m - left, metres.heading_rad - heading])
        nees.append(error @ np.linalg.solve(metres.cov, error))
    value = float(np.mean(nees)) / 2.0
    return {"ground_nees": Figure(value, "", f"{len(nees)} frames; 1 = honest", 1.3, 1.15)}


def costs(rng: np.random.Generator) -> dict[str, Figure]:
    """CPU time of one frame of 640 by 480 px."""
    line, pose = a_line(rng, 0)
    image = render_ground(CAMERA, MOUNT, line, pose, rng=rng)
    board = Checkerboard(9, 6, 0.025)
    planes = [board_planes(board, one) for one in board_poses(CAMERA, board, 8, rng)]
    spent = cpu_seconds(
        {
            "line": lambda: find_line(image),
            "segments": lambda: find_segments(image),
            "board": lambda: [render_planes(CAMERA, one, rng=rng) for one in planes],
            "ground": lambda: render_ground(CAMERA, MOUNT, line, pose, rng=rng),
        }
    )
    return {
        "line_time": Figure(1e3 * spent["line"], "ms", "640x480, one thread", 15.0, 8.0),
        "segments_time": Figure(1e3 * spent["segments"], "ms", "LSD and merging"),
        "render_board_time": Figure(1e3 * spent["board"] / 8, "ms", "a NumPy renderer takes 660", 60.0, 30.0),
        "render_ground_time": Figure(1e3 * spent["ground"], "ms", "a line on the ground", 60.0, 30.0),
    }


def main() -> int:
    """Measure everything."""
    rng = np.random.default_rng(0)
    figures: dict[str, Figure] = {}
    for work in (plain_floor, real_floor, other_pictures, ground_honesty, costs):
        say(work.__name__.replace("_", " "))
        figures |= work(rng)
    return publish(figures)


if __name__ == "__main__":
    sys.exit(main())
