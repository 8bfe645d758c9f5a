"""Planar monocular SLAM: a robot on a floor, one camera on it, a thousand points of space with ids.

An exercise of the course "Probabilistic Robotics" at Sapienza University of Rome, as recorded in ibiscp's
Planar-Monocular-SLAM: poses of wheel odometry, pixels of points that the camera sees up to 5 m away, and the
true path and map.  It is simulated: the odometry drifts, the pixels are as good as exact.

A pixel says along which ray a point lies and not how far, so a point begins only once the path has moved
enough to show it from elsewhere (`sequential.slam.placing`).
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Truth, require_file
from factorlab.datasets.slam import SlamDataset
from sequential.errors import DataError
from sequential.manifold import SE2, Vector, quaternion_from_matrix, rotate
from sequential.slam import Factors, SlamProblem
from sequential.slam.models import Between, PlanarProjection, Prior
from vision3d.camera import Camera

__all__ = ["load_planar_monocular"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

FOLDER = Path("robot") / "planar_monocular"
SECOND = 1_000_000_000  # ns; the recording has no times, so a step counts as a second
FIRST_SIGMAS = (1e-3, 1e-3, 1e-3)  # m, m, rad: the first pose is the origin
# Fitted to residuals of a batch, not to the truth: along, across (m), heading (rad) of a step of 0.2 m; px
STEP_SIGMAS = (0.0225, 0.0015, 0.0225)
PIXEL_SIGMA = 0.02
LEAST_PARALLAX = np.radians(10.0)  # odometry alone makes up to five of them


class _Recording(NamedTuple):
    odometry: Array  # (K, 3) poses by the wheels
    truth: Array  # (K, 3)
    pose: Ints  # (N,) which pose a point was seen from
    point: Ints  # (N,)
    pixel: Array  # (N, 2)


def load_planar_monocular(
    data: Path | None = None, *, pixel_noise: float = 0.0, seed: int = 0, steps: int | None = None
) -> list[SlamDataset]:
    """The recording as one problem.

    Parameters
    ----------
    data : folder of `camera.dat`, `world.dat` and `meas-….dat`; by default under FACTORLAB_DATA
    pixel_noise : standard deviation of noise to add to the recorded pixels, px, with `seed`
    steps : only so many of the first poses

    Raises
    ------
    DataError
        for missing files, or lines that say nothing known.
    """
    folder = _folder(data)
    camera, body_T_camera = _camera(folder / "camera.dat")
    model = PlanarProjection(camera, tuple(body_T_camera))
    recording, left_out = _with_parallax(_read(folder, steps), camera, body_T_camera)
    world = np.loadtxt(require_file(folder / "world.dat", "the map of planar_monocular", "copy it all"))
    noise = pixel_noise * np.random.default_rng(seed).standard_normal(recording.pixel.shape)
    sigma = float(np.hypot(PIXEL_SIGMA, pixel_noise))
    seen = Factors(
        model,
        ("x", "l"),
        np.column_stack([recording.pose, recording.point]),
        recording.pixel + noise,
        sigma**2,
        name="camera",
    )
    count = len(recording.odometry)
    stamps = np.arange(count, dtype=np.int64) * SECOND
    truth = Truth(stamps, recording.truth[:, :2], np.unwrap(recording.truth[:, 2]))
    problem = SlamProblem({"x": SE2(), "l": Vector(3)}, (*_driven(recording), seen), t=stamps)
    return [
        SlamDataset(
            name="planar_monocular",
            title="Planar monocular: one camera on a robot among points",
            problem=problem,
            truth=truth,
            landmarks={int(row[0]): row[1:4] for row in world},
            axes=2,
            graph_options={"initial": "incremental"},
            default_estimators=("batch", "batch_robust"),
            notes=_notes(recording, left_out, pixel_noise, sigma),
        )
    ]


def _notes(recording: _Recording, left_out: int, pixel_noise: float, sigma: float) -> tuple[str, ...]:
    """What a reader of a result should know."""
    count, points = len(recording.pixel), len(np.unique(recording.point))
    seen = f"{len(recording.odometry)} poses, {count} pixels of {points} points, association as given"
    apart = f"{left_out} points seen under less than {np.degrees(LEAST_PARALLAX):.0f}° are left out"
    added = f"noise of {pixel_noise:g} px added" if pixel_noise > 0 else "and have no noise but rounding"
    along, across, heading = STEP_SIGMAS
    return (
        f"{seen}; {apart}",
        f"simulated: the odometry drifts; the pixels are as recorded, {added}",
        "start: the true first pose, the origin; nothing else of the truth is used or aligned to",
        f"noise, by residuals: {sigma:g} px; a step {along:g} m along, {across:g} m across, {heading:g} rad",
    )


def _folder(data: Path | None) -> Path:
    root = os.environ.get("FACTORLAB_DATA")
    folder = data if data is not None else Path(root or "FACTORLAB_DATA") / FOLDER
    remedy = (
        f"set FACTORLAB_DATA to the folder that holds {FOLDER}, or give the folder itself with data=…; the "
        "recording is in ibiscp's repository Planar-Monocular-SLAM"
    )
    require_file(folder / "camera.dat", "the camera of the dataset planar_monocular", remedy)
    return folder


def _camera(path: Path) -> tuple[Camera, Array]:
    """The lens and where it sits, from `camera.dat`: a matrix 3 x 3, a transform 4 x 4, the image's size."""
    text = path.read_text()
    parts = re.split(r"camera matrix:|cam_transform:|z_near:", text)
    size = [re.search(rf"{side}:\s*(\d+)", text) for side in ("width", "height")]
    try:
        matrix = np.array(parts[1].split(), dtype=np.float64).reshape(3, 3)
        mount = np.array(parts[2].split(), dtype=np.float64).reshape(4, 4)
        width, height = (int(found.group(1)) for found in size if found)
    except (IndexError, ValueError) as error:
        msg = (
            f"{path} needs 'camera matrix:' with 9 numbers, 'cam_transform:' with 16, 'width:' and "
            f"'height:'; at fault: {error}"
        )
        raise DataError(msg) from error
    body_T_camera = np.concatenate([quaternion_from_matrix(mount[:3, :3]), mount[:3, 3]])
    return Camera.from_matrix(matrix, (), (width, height)), body_T_camera


def _read(folder: Path, steps: int | None) -> _Recording:
    """All pictures in order."""
    paths = sorted(folder.glob("meas-*.dat"))[:steps]
    if len(paths) < 2:
        msg = f"{folder} holds {len(paths)} files meas-….dat; a path needs two at least"
        raise DataError(msg)
    odometry, truth, found = [], [], []
    for k, path in enumerate(paths):
        words = [line.split() for line in path.read_text().splitlines()]
        try:
            named = {line[0]: line[1:] for line in words if line}
            odometry.append([float(word) for word in named["odom_pose:"][:3]])
            truth.append([float(word) for word in named["gt_pose:"][:3]])
            found += [
                (k, int(line[2]), float(line[3]), float(line[4])) for line in words if line[:1] == ["point"]
            ]
        except (KeyError, IndexError, ValueError) as error:
            msg = f"{path} needs gt_pose:, odom_pose: and lines 'point count id u v …'; at fault: {error}"
            raise DataError(msg) from error
    if not found:
        msg = f"no picture shows a point: {len(paths)} files meas-….dat in {folder}, and no line 'point'"
        raise DataError(msg)
    rows = np.array(found)
    ids = rows[:, :2].astype(np.int64)
    return _Recording(np.array(odometry), np.array(truth), ids[:, 0], ids[:, 1], rows[:, 2:4])


def _with_parallax(recording: _Recording, camera: Camera, mount: Array) -> tuple[_Recording, int]:
    """Without points that are never seen from another side, judged by odometry; and how many these are."""
    ray = rotate(mount[:4], camera.unproject(recording.pixel))
    heading = recording.odometry[recording.pose, 2]
    cos, sin = np.cos(heading), np.sin(heading)
    world = np.column_stack([cos * ray[:, 0] - sin * ray[:, 1], sin * ray[:, 0] + cos * ray[:, 1], ray[:, 2]])
    points = np.unique(recording.point)
    enough = np.zeros(int(points.max()) + 1, dtype=bool)
    for point in points.tolist():
        seen = world[recording.point == point]
        enough[point] = (seen @ seen.T).min() < np.cos(LEAST_PARALLAX)
    kept = enough[recording.point]
    return (
        recording._replace(
            pose=recording.pose[kept], point=recording.point[kept], pixel=recording.pixel[kept]
        ),
        len(points) - int(enough.sum()),
    )


def _driven(recording: _Recording) -> tuple[Factors, Factors]:
    """The first pose, and the steps of the odometry."""
    between = Between(SE2())
    steps = between.expected(recording.odometry[:-1], recording.odometry[1:])
    # The wheels err in the length and in the turn of an arc; the chart of the measurement stands at its end.
    at_end = SE2().transport(SE2().identity()[None], steps)[1]
    noise = at_end @ np.diag(np.square(STEP_SIGMAS)) @ np.swapaxes(at_end, 1, 2)
    index = np.arange(len(steps))
    first = recording.truth[:1]
    return (
        Factors(Prior(SE2()), ("x",), [[0]], first, np.square(FIRST_SIGMAS), name="first pose"),
        Factors(
            between,
            ("x", "x"),
            np.column_stack([index, index + 1]),
            steps,
            0.5 * (noise + np.swapaxes(noise, 1, 2)),
            name="odometry",
        ),
    )
