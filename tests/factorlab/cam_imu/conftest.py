"""A rendered recording on disk: frames named by their time, a video with stamps, the IMU's log."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from factorlab.cam_imu.demo import DemoRecording, demo_recording
from sequential.readers.imu.write import write_imu
from vision3d.camera_files import write_camera
from vision3d.render import write_video


@dataclass(frozen=True)
class OnDisk:
    folder: Path
    demo: DemoRecording

    @property
    def options(self):
        return ("--camera", self.folder / "camera.json", "--board", "9x6", "--square", "35mm")


@pytest.fixture(scope="session")
def on_disk(tmp_path_factory):
    import cv2

    folder = tmp_path_factory.mktemp("cam_imu")
    demo = demo_recording(1, seconds=8.0, fps=10.0)
    (folder / "frames").mkdir()
    images, rows = [], ["frame,t_s,captured_unix_ns"]
    for k, (_, stamp, image) in enumerate(demo.images()):
        cv2.imwrite(str(folder / "frames" / f"{stamp}.png"), image)
        images.append(image)
        rows.append(f"{k},{1e-9 * (stamp - demo.stamps_ns[0]):.9f},{stamp}")
    (folder / "film").mkdir()
    write_video(folder / "film" / "video.avi", images, 10.0)
    (folder / "film" / "frames.csv").write_text("\n".join(rows) + "\n")
    write_imu(demo.recording, folder / "imu.csv")
    write_camera(demo.rig.camera, folder / "camera.json")
    assert np.all(np.diff(demo.stamps_ns) > 0)
    return OnDisk(folder, demo)
