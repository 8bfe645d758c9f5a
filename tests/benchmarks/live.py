"""The live page on rendered 640x480 videos: frames a second of each task, and how old a picture is.

`python live.py [--json] [--quick]`.  The server is the command as a user starts it, in a process of its own;
this one takes the pictures as a browser does and notes when each came.  Frames a second are pictures that
arrived while the video was played as quickly as possible, decoding, task, marks and JPEG included; latency
runs from a frame's arrival at the server to its picture being here, and where there is a browser, to its
picture being on a canvas there, while the video plays at its own speed.
Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from measure.figures import Figure, publish, say
from measure.live_browser import browser_latency_ms, numbered
from measure.live_client import served

from vision3d.boards import Checkerboard
from vision3d.camera import Camera
from vision3d.camera_files import write_camera
from vision3d.render import moving_board, moving_markers, write_video

CAMERA = Camera("brown5", [600.0, 600.0, 320.0, 240.0], [-0.2, 0.05, 0.0, 0.0, 0.0], (640, 480))
IDS, SIZE_M = (3, 7, 12, 23, 31, 42), 0.05
FPS = 30.0
TASKS = ("calibrate", "line", "features")


def videos(folder: Path, seconds: float) -> dict[str, Path]:
    """Six markers that sway, at 30 and the same at 60 frames a second; a board that is held up."""
    rng = np.random.default_rng(0)
    markers = [
        frame.image for frame in moving_markers(CAMERA, IDS, SIZE_M, rng=rng, seconds=seconds, fps=FPS)
    ]
    board = moving_board(CAMERA, Checkerboard(9, 6, 0.025), 5, rng=rng, fps=FPS)
    return {
        "markers": write_video(folder / "markers.avi", markers, FPS),
        "markers60": write_video(folder / "markers60.avi", markers, 2.0 * FPS),
        "numbered": write_video(folder / "numbered.avi", numbered(markers), FPS),
        "board": write_video(folder / "board.avi", (frame.image for frame in board), FPS),
    }


def latency(video: Path, options: tuple[str, ...], seconds: float) -> tuple[float, float, float]:
    """Median and 95th percentile of a picture's age, ms, and pictures a second, at the video's own speed."""
    with served(video, "--loop", *options) as page:
        pictures = page.pictures(seconds)
    median, high = np.percentile(pictures.latency_ms, [50, 95])
    return float(median), float(high), pictures.fps


def speed(video: Path, options: tuple[str, ...], seconds: float) -> tuple[float, float]:
    """Pictures a second that arrive when the video is played as quickly as possible, and ms of the task."""
    with served(video, "--loop", "--fast", *options) as page:
        pictures = page.pictures(seconds)
        work = page.state()["rates"]["work_ms"]
    return pictures.fps, float(work)


def main() -> int:
    """Measure everything and publish it."""
    quick = "--quick" in sys.argv[1:]
    seconds = 4.0 if quick else 15.0
    figures: dict[str, Figure] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        say("rendering videos")
        video = videos(folder, 2.0 if quick else 6.0)
        write_camera(CAMERA, folder / "camera.json", "json")
        pose = ("--camera", str(folder / "camera.json"), "--size", "50mm", "--dictionary", "4x4_50")
        say("markers, as quickly as possible")
        fps, work = speed(video["markers"], ("--task", "markers", *pose), seconds)
        figures["markers_fps"] = Figure(fps, "1/s", "six poses a frame", 25.0, 60.0, "higher")
        figures["markers_task_ms"] = Figure(work, "ms", "corners, poses and tracks of six markers")
        say("markers, recorded as well")
        recorded, _ = speed(
            video["markers"], ("--task", "markers", *pose, "--record", str(folder / "kept")), seconds
        )
        figures["markers_recorded_fps"] = Figure(recorded, "1/s", "with --record", 25.0, better="higher")
        for name, rate in (("markers", 30), ("markers60", 60)):
            say(f"latency at {rate} frames a second")
            median, high, arrived = latency(video[name], ("--task", "markers", *pose), seconds)
            figures[f"latency_{rate}_ms"] = Figure(median, "ms", "median", 100.0)
            figures[f"latency_{rate}_high_ms"] = Figure(high, "ms", "95 % are below", 100.0)
            figures[f"arrived_{rate}_fps"] = Figure(arrived, "1/s", f"of {rate}", 25.0, better="higher")
        say("latency up to a browser's canvas")
        with served(video["numbered"], "--loop", "--task", "markers", *pose) as page:
            ages = browser_latency_ms(page, round((2.0 if quick else 6.0) * FPS), seconds)
        if ages is not None:
            median, high = np.percentile(ages, [50, 95])
            figures["latency_browser_ms"] = Figure(median, "ms", "Chromium, at 30 frames a second", 100.0)
            figures["latency_browser_high_ms"] = Figure(high, "ms", "95 % are below")
        for task in TASKS:
            say(f"{task}, as quickly as possible")
            source = video["board"] if task == "calibrate" else video["markers"]
            fps, work = speed(source, ("--task", task, "--record", str(folder / task)), seconds)
            figures[f"{task}_fps"] = Figure(fps, "1/s", "with --record", better="higher")
            figures[f"{task}_task_ms"] = Figure(work, "ms", "")
    return publish(figures)


if __name__ == "__main__":
    raise SystemExit(main())
