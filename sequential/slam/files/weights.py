"""Numbers of a graph file in our order: poses as we store them, weights in our chart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.manifold import SE2, SE3
from sequential.manifold.so3 import quaternion_multiply
from sequential.slam.files.tags import Tag

if TYPE_CHECKING:
    from sequential.slam.files.reading import Lines

__all__ = ["WEIGHTS", "pose_rows", "roll_pitch_yaw", "weight_matrices"]

Array = NDArray[np.float64]

WEIGHTS = ("auto", "information", "covariance", "square_root", "gtsam")
ROTATION_FIRST = [3, 4, 5, 0, 1, 2]
TORO_ORDER = [0, 1, 4, 2, 5, 3]  # xx xy yy tt xt yt, taken along the rows: xx xy xt yy yt tt


def pose_rows(values: Array, tag: Tag, lines: list[int], where: str) -> Array:
    """Poses (N, 3) or (N, 7) from x y heading, x y z roll pitch yaw, or x y z qx qy qz qw."""
    if tag.axes == 2:
        return SE2().normalize(values)
    if tag.angles:
        return np.concatenate([_quaternion(values[:, 3:6]), values[:, :3]], axis=1)
    norm = np.linalg.norm(values[:, 3:7], axis=1)
    if (norm < 1e-6).any():
        line = lines[int(np.flatnonzero(norm < 1e-6)[0])]
        msg = f"{where}, line {line}: the quaternion is zero; a rotation has qx² + qy² + qz² + qw² = 1"
        raise FileFormatError(msg)
    return SE3().normalize(values[:, [6, 3, 4, 5, 0, 1, 2]])


def _quaternion(angles: Array) -> Array:
    """(N, 4) of Rz(yaw) Ry(pitch) Rx(roll), angles (N, 3) roll, pitch, yaw in rad."""
    axes = np.zeros((3, len(angles), 4))
    for k in range(3):
        axes[k, :, 0], axes[k, :, 1 + k] = np.cos(0.5 * angles[:, k]), np.sin(0.5 * angles[:, k])
    q = quaternion_multiply(quaternion_multiply(axes[2], axes[1]), axes[0])
    return np.where(q[:, :1] < 0, -q, q)


def roll_pitch_yaw(q: Array) -> Array:
    """(N, 3) angles in rad of quaternions (N, 4): Rz(yaw) Ry(pitch) Rx(roll)."""
    w, x, y, z = q.T
    sine = np.clip(2 * (w * y - z * x), -1.0, 1.0)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack([roll, np.arcsin(sine), yaw], axis=1)


def weight_matrices(table: Lines, tag: Tag, name: str, dim: int, weights: str, where: str) -> Array:
    """Information (N, dim, dim) in our chart, from the upper triangles that stand in the lines."""
    length = dim * (dim + 1) // 2
    unit = np.eye(dim)[np.triu_indices(dim)]
    rows = np.array([v[tag.numbers :] or unit.tolist() for v in table.values]).reshape(-1, length)
    if name in {"EDGE2", "EDGE"} and _is_toro(rows):
        rows = rows[:, TORO_ORDER]
    upper = np.zeros((len(rows), dim, dim))
    upper[:, *np.triu_indices(dim)] = rows
    whole = upper + np.swapaxes(np.triu(upper, 1), 1, 2)
    kind = ("covariance" if tag.as_cov else "information") if weights == "auto" else weights
    if kind == "square_root":
        whole = np.swapaxes(upper, 1, 2) @ upper
    elif kind == "covariance":
        whole = _inverse(whole, table, where)
    if dim == 6 and kind != "gtsam":
        whole = whole[:, ROTATION_FIRST][:, :, ROTATION_FIRST]
    return whole


def _is_toro(rows: Array) -> bool:
    """Whether weights of planar poses stand in TORO's order: where all of them are possible weights so."""
    upper = np.zeros((len(rows), 3, 3))
    upper[:, *np.triu_indices(3)] = rows[:, TORO_ORDER]
    return bool((np.linalg.eigvalsh(upper, UPLO="U")[:, 0] > 0).all())


def _inverse(whole: Array, table: Lines, where: str) -> Array:
    """The inverse of covariances; `FileFormatError` names the line of a singular one."""
    lowest = np.linalg.eigvalsh(whole)[:, 0]
    if (lowest <= 0).any():
        line = table.numbers[int(np.flatnonzero(lowest <= 0)[0])]
        msg = (
            f"{where}, line {line}: the covariance is not positive definite; every direction needs some noise"
        )
        raise FileFormatError(msg)
    return np.asarray(np.linalg.inv(whole))
