"""Barfoot's starry night: each axis' error and the share within ±3σ, for filter, windows and batch.

The issue sets no bar here; bars are what the project holds itself to: a batch more accurate than the filter,
and every axis honest.  The same recording without its map shows what smoothing is for.
"""

from __future__ import annotations

import os
from pathlib import Path

from factorlab.compare import Comparison, compare
from factorlab.compare.axes import AxisErrors
from factorlab.datasets import load, load_slam
from measure.figures import Figure, say

__all__ = ["figures"]

HONEST = 0.96  # share of each axis' errors within ±3σ
LAGS = (0.2, 1.0, 5.0)


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Known map, then unknown; nothing where the recording is missing."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "../shared/data")) / "robot" / "barfoot"
    if not (folder / "dataset3.mat").is_file():
        say(f"starry night: needs {folder / 'dataset3.mat'}, which FACTORLAB_DATA names; left out")
        return {}
    say("starry night")
    (dataset,) = load("starry_night", data=folder)
    table = compare(dataset, ("ekf", "ukf", "batch"), lags=LAGS[:2] if quick else LAGS)
    rows = axes(table) | gain(table)
    return rows if quick else rows | without_map(folder)


def axes(table: Comparison) -> dict[str, Figure]:
    """One row an axis and estimator, and the least share of each."""
    told = {row.name: row.axes for row in table.rows if row.axes is not None}
    told |= {f"window {lag.lag_s:g} s": lag.axes for lag in table.lags if lag.axes is not None}
    rows: dict[str, Figure] = {}
    for name, found in told.items():
        for k, axis in enumerate(found.names):
            rows[f"starry night, {name}, {axis}, RMSE"] = Figure(float(found.rmse()[k]), found.units[k], "")
            share = float(found.inside()[k])
            rows[f"starry night, {name}, {axis}, within ±3σ"] = Figure(share, "", "0.9973", better="higher")
        rows[f"starry night, {name}, least share within ±3σ"] = least(found)
    return rows


def least(found: AxisErrors) -> Figure:
    """The axis that is worst."""
    return Figure(float(found.inside().min()), "", "0.9973 of a Gaussian", HONEST, 0.99, "higher")


def gain(table: Comparison) -> dict[str, Figure]:
    """The filter's RMSE of the position over the batch's, and both normalised errors of the pose."""
    rmse = {row.name: row.rmse or float("nan") for row in table.rows}
    rows = {
        "starry night, RMSE of EKF over batch": Figure(
            rmse["ekf"] / rmse["batch"], "x", "of the position", 1.2, 1.3, "higher"
        )
    }
    for row in table.rows:
        rows[f"starry night, {row.name}, position RMSE"] = Figure(rmse[row.name], "m", "")
        if row.axes is not None and (nees := row.axes.nees_per_axis()) is not None:
            rows[f"starry night, {row.name}, NEES of the pose / 6"] = Figure(nees, "", "1 is expected", 1.6)
    return rows


def without_map(folder: Path) -> dict[str, Figure]:
    """EKF-SLAM, iSAM2 and batch: position, map, honesty."""
    from factorlab.slam import compare_slam

    say("starry night without its map")
    (dataset,) = load_slam("starry_night", data=folder)
    table = compare_slam(dataset, ("ekf_slam", "isam2", "isam2_final", "batch"))
    rows: dict[str, Figure] = {}
    for row in table.rows:
        told = row.to_json()
        told["map_rmse_m"] = (told["map"] or {}).get("rmse_m")
        for key, unit in (("rmse_m", "m"), ("map_rmse_m", "m"), ("anees_per_dof", "")):
            if isinstance(value := told[key], float):
                rows[f"starry night --slam, {row.name}, {key}"] = Figure(value, unit, "")
    position = {row.name: row.to_json()["rmse_m"] for row in table.rows}
    rows["starry night --slam, RMSE of EKF-SLAM over batch"] = Figure(
        position["ekf_slam"] / position["batch"], "x", "of the position", 1.5, 2.5, "higher"
    )
    return rows
