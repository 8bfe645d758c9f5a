"""Barfoot's "starry night": a stereo camera and an inertial unit among twenty known points.

Barfoot, "State estimation for robotics" (course AER1513, University of Toronto), data set 3: 169 s, 1900
pictures, translational and rotational velocity of the sensor head, truth by a motion-capture system.  In
four pictures of ten fewer than three points are seen, and then the velocities alone must carry the pose.

Both rows of a rectified pair say the same of a point, so their mean, weighted by the variances that the file
states, is the one row that a `StereoPixels` reads: nothing of the state is lost by it.

The variances that the file states are those of single readings about the truth, and right as such.  But the
errors are not white: all points of a picture are off together (11 px in the row, of which 2 px are a point's
own), and so are the pictures of a second.  Taken for independent they leave errors five times as large, in
variance, as an estimate then says.  No reading shows what all readings share, so how much wider the noise has
to be is set by the truth: twice the stated σ, of velocities and pixels alike.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Dataset, Truth, require_file
from sequential.driven_pose import DrivenPose
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_exp, quaternion_from_matrix
from sequential.model import Gaussian, StateSpace
from sequential.models import StereoPixels
from sequential.noise import diagonal
from sequential.tuning import Knob

__all__ = ["StarryNight", "load_starry_night", "read_starry_night"]

Array = NDArray[np.float64]

FILE = Path("robot") / "barfoot" / "dataset3.mat"
PRIOR_SIGMAS = (0.02, 0.02, 0.02, 0.01, 0.01, 0.01)  # rad, m: the start is the recorded truth's
ESTIMATORS = ("ekf", "iekf", "ukf", "ekf_rts", "ieks", "fixed_lag", "batch")
WIDER = 2.0  # times the stated σ: successive readings share errors
LAGS = (0.0, 0.2, 1.0, 5.0)  # s


class StarryNight(NamedTuple):
    """What the file holds, in this project's conventions."""

    t: NDArray[np.int64]  # (K,) ns
    world_T_body: Array  # (K, 7) truth
    twist: Array  # (K, 6) angular rate, velocity; body axes; held until the next stamp
    points: Array  # (20, 3) world
    picture: NDArray[np.int64]  # (N,) row of t at which a point was seen
    point: NDArray[np.int64]  # (N,)
    pixels: Array  # (N, 3) u_left, u_right, v
    intrinsics: tuple[float, float, float, float]  # fx, fy, cx, cy, px
    baseline: float  # m
    body_T_camera: Array  # (7,)
    twist_var: Array  # (6,) of one sample, as stated
    pixel_var: Array  # (3,) px², as stated


def load_starry_night(data: Path | None) -> Dataset:
    """All pictures are used, and the truth scores the result."""
    night = read_starry_night(data)
    interval = float(np.mean(np.diff(night.t))) * 1e-9
    turn, move = night.twist_var[:3], night.twist_var[3:]
    seen = np.bincount(night.picture, minlength=len(night.t))

    def build(values: Mapping[str, float]) -> StateSpace:
        scale = np.repeat([values["turn"], values["move"]], 3) ** 2
        process = DrivenPose(scale * np.concatenate([turn, move]) * interval)
        noise = values["pixels"] ** 2 * night.pixel_var
        sensor = StereoPixels(
            night.points, noise, night.intrinsics, night.baseline, night.body_T_camera, shared_row=True
        )
        prior = Gaussian(night.world_T_body[0], diagonal(PRIOR_SIGMAS))
        return StateSpace(SE3(), prior, process, {"stereo": sensor}, "twist", int(night.t[0]))

    knobs = tuple(Knob(name, WIDER, "times the σ stated") for name in ("turn", "move", "pixels"))
    streams = {
        "twist": Stream(night.t, night.twist, covers="after"),
        "stereo": Stream(night.t[night.picture], night.pixels, night.point[:, None].astype(np.float64)),
    }
    return Dataset(
        name="starry_night",
        title="Barfoot's starry night: a stereo camera and an IMU among twenty known points",
        log=SensorLog(streams, "starry_night"),
        model=build({knob.name: knob.initial for knob in knobs}),
        held_out=None,
        truth=Truth(night.t, night.world_T_body[:, 4:], None, night.world_T_body[:, :4]),
        axes=3,
        knobs=knobs,
        build=build,
        notes=(
            f"{len(night.pixels)} sightings in {len(night.t)} pictures, all used",
            f"in {np.sum(seen < 3)} pictures fewer than three points are seen, in {np.sum(seen == 0)} none",
            "start: the first recorded pose; nothing else of the truth is used, and nothing is aligned",
            "noise: twice the σ stated, since the pictures of a second share errors, as only the truth tells",
        ),
        default_estimators=ESTIMATORS,
        lags=LAGS,
    )


def read_starry_night(data: Path | None) -> StarryNight:
    """The recording, from `data` or from FACTORLAB_DATA.

    Raises
    ------
    DataError
        where the file is missing; the message says where it comes from.
    """
    raw = _raw(data)
    t = nanoseconds(raw["t"].ravel())
    turn = quaternion_exp(raw["theta_vk_i"].T)
    rows = raw["y_k_j"]
    picture, point = np.argwhere(rows[0] >= 0).T
    left_u, left_v, right_u, right_v = rows[:, picture, point]
    variance = raw["y_var"].ravel()
    weight = 1.0 / variance[[1, 3]]
    v = (weight[0] * left_v + weight[1] * right_v) / weight.sum()
    fx, fy, cx, cy, baseline = (float(raw[name].item()) for name in ("fu", "fv", "cu", "cv", "b"))
    u, _, w = np.linalg.svd(raw["C_c_v"])  # the file's matrix is orthogonal to nine digits
    return StarryNight(
        t=t,
        world_T_body=SE3().normalize(np.concatenate([turn, raw["r_i_vk_i"].T], axis=1)),
        twist=np.concatenate([raw["w_vk_vk_i"].T, raw["v_vk_vk_i"].T], axis=1),
        points=raw["rho_i_pj_i"].T,
        picture=picture,
        point=point,
        pixels=np.stack([left_u, right_u, v], axis=1),
        intrinsics=(fx, fy, cx, cy),
        baseline=baseline,
        body_T_camera=np.concatenate([quaternion_from_matrix((u @ w).T), raw["rho_v_c_v"].ravel()]),
        twist_var=np.concatenate([raw["w_var"].ravel(), raw["v_var"].ravel()]),
        pixel_var=np.array([variance[0], variance[2], 1.0 / weight.sum()]),
    )


def _raw(data: Path | None) -> dict[str, Any]:
    import scipy.io

    folder = Path(os.environ.get("FACTORLAB_DATA") or "FACTORLAB_DATA")
    path = folder / FILE if data is None else data / FILE.name
    remedy = (
        f"set FACTORLAB_DATA to the folder that holds {FILE}, or give the folder itself with data=…; it is "
        "data set 3 of T. Barfoot's course AER1513 at the University of Toronto"
    )
    require_file(path, "the dataset starry_night", remedy)
    return {name: v for name, v in scipy.io.loadmat(path).items() if not name.startswith("__")}
