"""Disparity where nothing was matched."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["fill_rows", "weighted_medians"]

Map = NDArray[np.float32]


def fill_rows(disparity: Any, valid: Any) -> Map:
    """Give pixels that are not valid the smaller of the next valid disparities to the left and right.

    What one camera alone sees lies behind what hides it from the other, so the smaller disparity is right
    there (Hirschmüller 2008); a row with nothing valid takes the rows above and below.
    """
    known = np.where(valid, disparity, np.float32(np.nan)).astype(np.float32)
    filled = np.fmin(_carried(known), _carried(known[:, ::-1])[:, ::-1])
    filled = np.where(valid, disparity, filled)
    missing = ~np.isfinite(filled)
    if missing.any():
        columns = np.fmin(_carried(filled.T).T, _carried(filled[::-1].T).T[::-1])
        filled = np.where(missing, columns, filled)
    return np.ascontiguousarray(filled, dtype=np.float32)


def _carried(known: Any) -> Any:
    """The last number of each row, from the left, as far as there is one."""
    at = np.where(np.isfinite(known), np.arange(known.shape[1]), -1)
    at = np.maximum.accumulate(at, axis=1)
    carried = np.take_along_axis(known, np.maximum(at, 0), axis=1)
    return np.where(at >= 0, carried, np.float32(np.nan))


def weighted_medians(disparity: Map, wanted: Any, guide: Any, half: int, levels: float) -> Map:
    """Median of the window where `wanted`, weighing neighbours of like colour more (`levels` a channel)."""
    from vision3d.kernels.stereo_filling import weighted_median

    channels = guide.shape[2]
    weight = np.exp(-np.arange(256 * channels) / (channels * levels)).astype(np.float32)
    out = np.empty_like(disparity)
    weighted_median(disparity, np.ascontiguousarray(wanted), guide, half, weight, out)
    return out
