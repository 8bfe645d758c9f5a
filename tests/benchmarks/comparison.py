"""Every figure of the main job, each beside its peer measured in this run: `python comparison.py [--json]`.

Needs FACTORLAB_DATA for MRCLAM.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
from measure.by_hand import Drive, range_chain
from measure.chain import BEACONS, make
from measure.figures import Figure, interleaved, publish, say

import sequential as sq
from factorlab.compare import compare
from factorlab.datasets import Dataset, load
from factorlab.graph import BatchGraph
from factorlab.graph.factors.planar import odometry
from sequential.evaluate import nees

NAMES = ("ekf", "ekf_rts", "ieks", "batch")
CHAIN = 20_000
# what `make demo` compiles
DEMO = ["extended", "unscented", "iterated", "smoothing", "looking", "walking", "inertial", "position"]


def accuracy() -> dict[str, Figure]:
    """Held-out error on KITTI before and after tuning, honesty, and how near the smoothers are."""
    say("KITTI: accuracy, tuning")
    (kitti,) = load("kitti")
    compare(kitti, NAMES)  # compile, so that tuning is timed warm
    result = compare(kitti, NAMES, tune=True)
    before = {row.name: row for row in result.untuned}
    after = {row.name: row for row in result.rows}
    assert result.tuned is not None
    honest, nis = after["batch"].to_json()["normalised_error"], after["ekf"].to_json()["nis"]
    low, high = nis["band95"]
    gap = {
        name: abs(rows[name].rmse / rows["batch"].rmse - 1) * 100
        for name in ("ekf_rts", "ieks")
        for rows in (before,)
    }
    tuned_gap = {name: abs(after[name].rmse / after["batch"].rmse - 1) * 100 for name in ("ekf_rts", "ieks")}
    boot = honest["bootstrap_band95"]
    return {
        "kitti_shipped_batch": Figure(before["batch"].rmse, "m", "1.090", 1.10),
        "kitti_shipped_ekf": Figure(before["ekf"].rmse, "m", "3.83 (gtsam's NavStateImuEKF 6.4)", 3.9),
        "kitti_tuned_batch": Figure(after["batch"].rmse, "m", "0.192", 0.22, 0.20),
        "kitti_tuned_ekf": Figure(after["ekf"].rmse, "m", "1.52", 1.7, 1.55),
        "kitti_tuned_ekf_nis": Figure(nis["mean"], "", f"band {low:.2f}-{high:.2f}", high),
        "kitti_tuned_ekf_nis_low": Figure(nis["mean"], "", "its lower end", low, None, "higher"),
        "kitti_tuned_batch_normalised_error": Figure(
            honest["mean"],
            "",
            f"1.6-2.5; bootstrap {boot[0]:.2f}-{boot[1]:.2f}, median {honest['median']:.2f}",
            3.5,
        ),
        "kitti_tuned_batch_normalised_error_low": Figure(
            honest["mean"], "", f"tail share {honest['tail_share']:.3f} (0.05 expected)", 1.0, None, "higher"
        ),
        "kitti_rts_from_batch": Figure(gap["ekf_rts"], "%", "0.4, shipped noise", 1.0, 0.5),
        "kitti_rts_from_batch_tuned": Figure(tuned_gap["ekf_rts"], "%", "0.4, tuned noise", 1.0, 0.5),
        "kitti_ieks_from_batch": Figure(gap["ieks"], "%", "0.005, shipped noise", 0.1, 0.01),
        "kitti_ieks_from_batch_tuned": Figure(tuned_gap["ieks"], "%", "0.005, tuned noise", 0.1, 0.01),
        "kitti_tune_seconds": Figure(result.tuned.seconds, "s", "3-15", 20, 5),
    }


def kitti_speed() -> dict[str, Figure]:
    """Our filter and our batch against gtsam driven by hand, interleaved."""
    say("KITTI: speed against gtsam by hand")
    (kitti,) = load("kitti")
    assert kitti.held_out is not None
    at, model, log = kitti.held_out.t, kitti.model, kitti.log
    drive = Drive(sq.prepare(model, log, at))
    lean = BatchGraph(covariance=False)
    seconds = interleaved(
        {
            "ekf": lambda: sq.run(sq.ExtendedKalmanFilter(), model, log, at=at),
            "navstate": drive.filter,
            "batch": lambda: sq.run(lean, model, log, at=at),
            "by_hand": drive.batch,
        }
    )
    apart = np.abs(drive.batch() - kitti.positions(sq.run(lean, model, log, at=at))).max()
    return {
        "kitti_ekf_time": Figure(
            seconds["ekf"] / seconds["navstate"],
            "x",
            f"NavStateImuEKF {seconds['navstate']:.3f} s",
            0.5,
            0.25,
        ),
        "kitti_batch_time": Figure(
            seconds["batch"] / seconds["by_hand"], "x", f"by hand {seconds['by_hand']:.3f} s", 1.3, 1.0
        ),
        "kitti_batch_apart": Figure(float(apart), "m", "largest difference to the script by hand", 0.02),
    }


def score(dataset: Dataset) -> tuple[float, float]:
    """RMSE of the batch's positions against the truth, not aligned, and ANEES over its dimension."""
    run = sq.run(BatchGraph(), dataset.model, dataset.log)
    assert dataset.truth is not None
    rows, truth = dataset.truth.at(run.t)
    error = dataset.positions(run)[rows] - truth.position[:, : dataset.axes]
    rmse = float(np.sqrt((error**2).sum(axis=1).mean()))
    if truth.heading is None:
        return rmse, float("nan")
    pose = np.column_stack([truth.position, truth.heading])
    part = "pose" if isinstance(run.manifold, sq.Product) else None
    return rmse, float(np.mean(nees(run, pose, part=part, rows=rows))) / 3


def robots() -> dict[str, Figure]:
    """Localisation with wheels: MRCLAM on the known map, Plaza by ranges alone."""
    say("Plaza2 and MRCLAM")
    found = {"plaza2_batch": Figure(score(load("plaza2")[0])[0], "m", "0.502, bias given", 0.6, 0.5)}
    for dataset, must, aim, reference in zip(
        load("mrclam"), (0.105, 0.125), (0.09, 0.11), ("0.100", "0.121"), strict=True
    ):
        rmse, honest = score(dataset)
        name = dataset.name.replace(" ", "_")
        found[f"{name}_batch"] = Figure(rmse, "m", reference, must, aim)
        found[f"{name}_anees"] = Figure(honest, "", "ANEES/3, aim 0.7-1.5", None, 1.5)
        found[f"{name}_anees_low"] = Figure(honest, "", "its lower end", None, 0.7, "higher")
    return found


def user_sensor() -> dict[str, Figure]:
    """A sensor without a native factor on a chain of 20 000 poses, against RangeFactor2D by hand."""
    say(f"chain of {CHAIN} poses")
    chain = make(CHAIN, np.random.default_rng(0))
    start = sq.RauchTungStriebel(leave_one_out=False).solve(chain.native).mean
    moves = odometry(chain.native)
    graph, smoother = BatchGraph(covariance=False), sq.IteratedSmoother(leave_one_out=False)
    seconds = interleaved(
        {
            "native": lambda: range_chain(chain.native, moves, BEACONS, start),
            "graph": lambda: graph.solve(chain.user),
            "chain": lambda: smoother.solve(chain.user),
            "chain_jacobian": lambda: smoother.solve(chain.user_jacobian),
        },
        rounds=3,
    )
    apart = np.abs(range_chain(chain.native, moves, BEACONS, start) - graph.solve(chain.user).mean).max()
    reference = f"RangeFactor2D by hand {seconds['native']:.2f} s"
    return {
        "chain_graph_time": Figure(seconds["graph"] / seconds["native"], "x", reference, 1.5, 1.1),
        "chain_solver_time": Figure(
            seconds["chain"] / seconds["native"], "x", "Jacobian differenced", 0.2, 0.05
        ),
        "chain_solver_time_jacobian": Figure(
            seconds["chain_jacobian"] / seconds["native"], "x", "Jacobian declared", 0.2, 0.05
        ),
        "chain_apart": Figure(float(apart), "m, rad", "largest difference to RangeFactor2D", 1e-3),
    }


def demo() -> dict[str, Figure]:
    """`factorlab demo` after the install, with nothing compiled yet."""
    say("demo, cold cache")
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": str(Path(folder) / "cache")}
        began = perf_counter()
        for module in (
            ["sequential.warm_up", *DEMO],
            ["factorlab", "demo", "-o", str(Path(folder) / "report")],
        ):
            command = [sys.executable, "-m", *module]
            subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
        return {"demo_cold_seconds": Figure(perf_counter() - began, "s", "", 75, 40)}


def main() -> int:
    """Measure and publish."""
    figures: dict[str, Figure] = {}
    for part in (accuracy, kitti_speed, robots, user_sensor, demo):
        figures |= part()
    return publish(figures)


if __name__ == "__main__":
    sys.exit(main())
