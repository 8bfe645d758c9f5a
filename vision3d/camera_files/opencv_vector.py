"""OpenCV's camera matrix and distortion vector: which lens a vector belongs to, and which it cannot say."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.lenses import LENSES

__all__ = ["lens_of_vector", "split_matrix"]

Array = NDArray[np.float64]
LENS_OF_LENGTH = {0: "pinhole", 4: "brown4", 5: "brown5", 8: "rational8", 12: "thin12"}


def lens_of_vector(distortion: Any, lens: str | None = None) -> tuple[str, Array]:
    """Name the lens of OpenCV's distortion vector, and give its coefficients.

    Parameters
    ----------
    distortion : array of any shape with 0, 4, 5, 8, 12 or 14 numbers, or None
    lens : a lens to say it with: coefficients it lacks must be zero, those it has in excess are zero

    Raises
    ------
    ModelError
        for a length that OpenCV does not know, for a tilted sensor (14 coefficients, the last two not
        zero), or for coefficients that the lens asked for does not have.
    """
    vector = np.array([] if distortion is None else distortion, dtype=np.float64).reshape(-1)
    if lens == "fisheye4":
        if len(vector) != 4:
            raise ModelError(f"a fisheye has 4 distortion coefficients (k1 to k4), got {len(vector)}")
        return lens, vector
    if len(vector) == 14 and not vector[12:].any():
        vector = vector[:12]
    if len(vector) not in LENS_OF_LENGTH:
        tilt = " (a tilted sensor is not supported)" if len(vector) == 14 else ""
        raise ModelError(
            f"OpenCV's distortion vector has 0, 4, 5, 8 or 12 coefficients, got {len(vector)}{tilt}"
        )
    if lens is None:
        return LENS_OF_LENGTH[len(vector)], vector
    if lens not in LENSES:
        raise ModelError(f"no lens {lens!r}; known are {', '.join(LENSES)}")
    own = len(LENSES[lens].distortion)
    if vector[own:].any():
        given = ", ".join(f"{value:.6g}" for value in vector)
        raise ModelError(f"the lens {lens!r} has {own} coefficients, and the vector ({given}) needs more")
    return lens, np.concatenate([vector[:own], np.zeros(max(0, own - len(vector)))])


def split_matrix(matrix: Any) -> Array:
    """Give fx, fy, cx, cy of a camera matrix (3, 3).

    Raises
    ------
    ShapeError
        where it is not (3, 3).
    ModelError
        where it has a skew or is no camera matrix.
    """
    K = np.asarray(matrix, dtype=np.float64)
    if K.shape != (3, 3):
        raise ShapeError(f"a camera matrix is (3, 3), got shape {K.shape}")
    if abs(K[0, 1]) > 1e-9 * abs(K[0, 0]):
        raise ModelError(f"the camera matrix has a skew of {K[0, 1]:.6g} px, which no lens here has")
    if K[1, 0] != 0.0 or not np.array_equal(K[2], (0.0, 0.0, 1.0)):
        raise ModelError("a camera matrix is [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], this is not")
    return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2]])
