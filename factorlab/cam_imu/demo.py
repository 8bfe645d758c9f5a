"""A rendered recording whose truth is known: the same every time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.camera.job import silent
from sequential.sensors.recording import ImuRecording
from vision3d.boards import Board, Checkerboard
from vision3d.inertial import CamImuSettings
from vision3d.inertial.simulated import Carried, Rig, read_imu, render_frames

if TYPE_CHECKING:
    from factorlab.cam_imu.job import CamImuRun

__all__ = ["BOARD", "DemoRecording", "Truth", "calibrate_demo", "demo_recording"]

Progress = Callable[[str, int, int], None]

Image = NDArray[np.uint8]
BOARD = Checkerboard(9, 6, 0.035)
BEGIN_NS = 1_700_000_000_000_000_000


@dataclass(frozen=True, eq=False)
class Truth:
    """What is so in a rendered recording: the rig, and gravity in the board's frame."""

    rig: Rig
    gravity: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DemoRecording:
    """Frames to render, an IMU's log, and the truth of both."""

    rig: Rig
    board: Board
    motion: Carried
    stamps_ns: NDArray[np.int64]
    recording: ImuRecording
    seed: int

    @property
    def truth(self) -> Truth:
        """What is to be found."""
        return Truth(self.rig, self.motion.gravity)

    def images(self) -> Iterator[tuple[str, int, Image]]:
        """Names, stamps and photographs, rendered as they are asked for."""
        rng = np.random.default_rng([self.seed, 1])
        t = 1e-9 * (self.stamps_ns - BEGIN_NS).astype(np.float64)
        for k, stamp in enumerate(self.stamps_ns.tolist()):
            yield f"frame {k}", stamp, render_frames(self.motion, self.rig, self.board, t[k : k + 1], rng)[0]


def demo_recording(
    seed: int = 0, *, seconds: float = 20.0, fps: float = 15.0, rate_hz: float = 100.0, rig: Rig | None = None
) -> DemoRecording:
    """A camera at 15 and an IMU at 100 samples a second, carried past a checkerboard by hand."""
    rng = np.random.default_rng(seed)
    own = Rig() if rig is None else rig
    motion = Carried.random(rng, own, BOARD)
    imu, _, _ = read_imu(motion, own, seconds, rate_hz, rng)
    stamps = BEGIN_NS + np.round(1e9 * np.arange(0.25, seconds - 0.25, 1.0 / fps)).astype(np.int64)
    t = BEGIN_NS + np.round(1e9 * imu.t).astype(np.int64)
    recording = ImuRecording(t=t, accel=imu.accel, gyro=imu.gyro, name="rendered demonstration")
    return DemoRecording(own, BOARD, motion, stamps, recording, seed)


def calibrate_demo(settings: CamImuSettings, *, seed: int = 0, progress: Progress = silent) -> CamImuRun:
    """Render, and calibrate from the pictures."""
    from factorlab.cam_imu.job import CamImuJob, calibrate_images

    demo = demo_recording(seed)
    job = CamImuJob(demo.rig.camera, demo.board, settings, camera_name="the rendered one")
    run = calibrate_images(
        demo.images(),
        demo.recording,
        job,
        stamps_from="rendering",
        total=len(demo.stamps_ns),
        progress=progress,
    )
    return replace(run, truth=demo.truth)
