"""What the directions of a magnetometer recording leave unknown, and what its residuals say, in sentences."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.direction_cells import CELLS, CellMeans, cell_words
from sequential.sensors.ellipsoid_fit import EllipsoidFit
from sequential.sensors.finding import Finding
from sequential.sensors.recording import ImuRecording

__all__ = ["doubts_of", "weakest"]

Array = NDArray[np.float64]
ENOUGH_CELLS = 16
SOFT = 1.5  # largest over smallest radius of an ordinary board
UNEVEN = 1.5  # scatter over that of the noise alone


def _direction(vector: Array) -> str:
    k = int(np.argmax(np.abs(vector)))
    if abs(vector[k]) > 0.9:
        return f"the sensor's {'xyz'[k]} axis"
    return f"({', '.join(f'{v:+.2f}' for v in vector)})"


def weakest(points: Array, fit: EllipsoidFit | None, basis: Array, name: str) -> str:
    """Which gain the directions leave free, and how to turn."""
    if fit is None:
        centred = points - points.mean(axis=0)
        vector = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    else:
        dim = len(fit.centre)
        spread = fit.cov[: dim * (dim + 1) // 2, : dim * (dim + 1) // 2]
        worst = np.linalg.eigh(spread)[1][:, -1]
        index = int(np.argmax(np.abs(worst[:dim])))
        vector = basis[:, index]
    return (
        f"the readings of recording {name!r} leave the ellipsoid free along {_direction(vector)}: they cover "
        "too few directions; point every axis up, down and to each side, and turn once about each"
        "; or find the hard iron alone (sphere)"
    )


def doubts_of(
    fit: EllipsoidFit,
    radii: Array,
    cells: CellMeans,
    normal: Array | None,
    recording: ImuRecording,
    *,
    sphere: bool,
) -> list[Finding]:
    """Everything that a reader of the constants should know."""
    found = [_frame(normal), *_coverage(cells, normal)]
    if sphere:
        what = "hard iron alone: all gains are taken to be equal, and axes square"
        found.append(Finding("note", what, "", "turn in every direction to find soft iron too"))
    share = float((fit.weights == 0).mean())
    if share > 0:
        found.append(
            Finding(
                "warn" if share > 0.05 else "note",
                f"{int((fit.weights == 0).sum())} readings left out as outliers ({100 * share:.1f} %)",
                recording.name,
                "keep away from iron, motors and currents" if share > 0.05 else "",
            )
        )
    if radii[-1] > SOFT * radii[0]:
        found.append(
            Finding(
                "warn",
                f"the largest gain is {radii[-1] / radii[0]:.2f} times the smallest: more than soft iron of "
                "a board makes as a rule",
                recording.name,
                "look for a wrong range of one axis, or iron fixed beside the sensor",
            )
        )
    if fit.sigma > UNEVEN * fit.expected and fit.sigma > 0.005:
        found.append(
            Finding(
                "warn",
                f"the norm scatters by {100 * fit.sigma:.1f} %, the sensor's noise explains "
                f"{100 * fit.expected:.1f} %: the field is not the same everywhere the sensor was",
                recording.name,
                "turn about one point, outdoors or in the middle of a room",
            )
        )
    return found


def _frame(normal: Array | None) -> Finding:
    if normal is None:
        return Finding(
            "note",
            "norms alone leave a rotation free: the matrix is the symmetric one of all that fit",
            "",
            "align with the accelerometer or the gyro where they were recorded",
        )
    return Finding(
        "warn",
        f"a planar turn: gain, offset and cross-axis along {_direction(normal)} are not observed but assumed",
        "",
        "headings hold while the sensor stays in this plane; turn it in every direction for use in space",
    )


def _coverage(cells: CellMeans, normal: Array | None) -> list[Finding]:
    if normal is not None or cells.covered >= ENOUGH_CELLS:
        return []
    empty = [k for k in range(CELLS) if not np.isfinite(cells.mean[k])]
    return [
        Finding(
            "warn",
            f"readings in {cells.covered} of {CELLS} cells of direction",
            f"none at {cell_words(empty[0])}, and {len(empty) - 1} more",
            "turn the sensor there too; gains are extrapolated",
        )
    ]
