"""Camera and IMU: errors against rendered truth, and whether the stated σ are what the errors are."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from measure.figures import Figure, say

__all__ = ["figures"]

PROJECTED, RENDERED = 24, 8
SECONDS = 11.0


class Trial(NamedTuple):
    """One recording: errors in °, mm, ms; z (7,) errors over their σ; NEES of the seven."""

    rotation: float
    translation: float
    offset: float
    z: np.ndarray
    nees: float
    settled: bool


def projected(seed: int) -> Trial:
    """Corners projected with noise, 15 frames and 100 samples a second."""
    from cam_imu_worlds import errors, recorded

    world = recorded(500 + seed, seconds=SECONDS, sigma_px=0.1)
    found = world.calibrated()
    return _trial(errors(world, found), found)


def rendered(seed: int) -> Trial:
    """Photographs rendered, the board found in them."""
    from factorlab.cam_imu.demo import demo_recording
    from factorlab.cam_imu.job import CamImuJob, calibrate_images
    from sequential.manifold import SE3

    demo = demo_recording(seed, seconds=SECONDS)
    run = calibrate_images(
        demo.images(), demo.recording, CamImuJob(demo.rig.camera, demo.board, checks=False)
    )
    pose = SE3().local(demo.rig.camera_T_imu, run.found.camera_T_imu)
    return _trial(np.append(pose, run.time_offset_s - demo.rig.time_offset_s), run.found)


def _trial(error: np.ndarray, found: object) -> Trial:
    return Trial(
        float(np.degrees(np.linalg.norm(error[:3]))),
        1e3 * float(np.linalg.norm(error[3:6])),
        1e3 * abs(float(error[6])),
        error / found.std[:7],
        float(error @ np.linalg.solve(found.cov[:7, :7], error)) / 7.0,
        found.adjusted.settled,
    )


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Rows of rotation, translation and offset, rendered; and honesty, rendered and projected."""
    counts = (6, 1) if quick else (PROJECTED, RENDERED)
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        many = list(pool.map(projected, range(counts[0])))
        few = list(pool.map(rendered, range(counts[1])))
    for one in few:
        sizes = f"{one.rotation:.4f}°, {one.translation:.3f} mm, {one.offset:.4f} ms"
        say(f"rendered: {sizes}, NEES/7 {one.nees:.2f}")
    told = f"largest of {len(few)} rendered recordings of {SECONDS:.0f} s, 15 and 100 Hz; Kalibr-class"
    rows = {
        "camera_imu_rotation": Figure(max(one.rotation for one in few), "deg", told, 0.1, 0.03),
        "camera_imu_translation": Figure(max(one.translation for one in few), "mm", told, 5.0, 2.0),
        "camera_imu_time_offset": Figure(max(one.offset for one in few), "ms", told, 0.5, 0.1),
    }
    for name, trials in (("projected", many), ("rendered", few)):
        z = float(np.sqrt(np.mean([one.z**2 for one in trials])))
        enough = len(trials) >= 4
        said = f"RMS of error / σ of the seven, {len(trials)} {name} recordings"
        rows |= {
            f"camera_imu_z_{name}": Figure(z, "", said, 1.4 if enough else None),
            f"camera_imu_z_{name}_least": Figure(z, "", said, 0.7 if enough else None, None, "higher"),
            f"camera_imu_nees_{name}": Figure(
                float(np.mean([one.nees for one in trials])), "", "NEES a degree of freedom, mean"
            ),
        }
    rows["camera_imu_median_rotation"] = Figure(
        float(np.median([one.rotation for one in many])), "deg", "projected corners, σ 0.1 px"
    )
    settled = float(np.mean([one.settled for one in (*many, *few)]))
    rows["camera_imu_settled"] = Figure(settled, "", "share of solves that settled", 1.0, None, "higher")
    return rows
