"""The line follower of challenge D2: how near it keeps, up to which noise and blur, how honest, how fast."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

from factorlab.l19.follower import FollowerSettings, simulate, sweep, track
from factorlab.l19.follower.robot import CAMERA, MOUNT, PERIOD_S, view
from measure.figures import Figure, say
from measure.timing import cpu_seconds
from vision3d.render import render_ground

__all__ = ["figures"]

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "l19"
SEEDS, QUICK_SEEDS = 20, 2
CAMERA_ONLY = FollowerSettings(bridging_s=0.0)
LOOPS = {
    "first_try": (replace(CAMERA_ONLY, detector="threshold"), (10, 15, 20, 25, 30, 35)),
    "camera_only": (CAMERA_ONLY, (60, 70, 80, 90, 95, 100, 105)),
    "with_map": (FollowerSettings(), (80, 90, 100, 105, 110, 115, 120)),
}


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    seeds = QUICK_SEEDS if quick else SEEDS
    return near(seeds) | limits(seeds) | honest(seeds) | speed()


def near(seeds: int) -> dict[str, Figure]:
    """Lateral distance over 500 steps of the default curve, with and without noise."""
    alone = simulate(steps=500)
    noisy = [simulate(FollowerSettings(noise=60.0, seed=seed)) for seed in range(seeds)]
    rms = 100 * float(np.sqrt(np.mean([one.rms_m**2 for one in noisy])))
    kept = 100 * float(np.mean([one.kept for one in noisy]))
    said = f"{seeds} seeds, image noise 60 grey levels; {kept:.0f} % keep the line"
    return {
        "follower_lateral_rms": Figure(100 * alone.rms_m, "cm", "500 steps, no noise", 2.0, 1.0),
        "follower_lateral_rms_noisy": Figure(rms, "cm", said, 2.0, 1.0),
    }


def limits(seeds: int) -> dict[str, Figure]:
    """The largest noise, and the longest exposure, at which 95 % of the seeds keep the line for 500 steps."""
    rows = {}
    for name, (own, noises) in LOOPS.items():
        must = None if name == "first_try" else 60.0
        table = sweep(noises, (0.0,), seeds, own)
        said = ", ".join(f"{n:g}: {100 * k:.0f} %" for n, k in zip(noises, table.kept[:, 0], strict=True))
        rows[f"noise_limit_{name}"] = Figure(
            table.noise_limit(), "grey", f"{seeds} seeds; {said}", must, better="higher"
        )
        say(f"noise limit, {name}: {said}")
    few = max(seeds // 4, 2)
    for name, exposures in (("camera_only", (0.2, 0.3, 0.4, 0.5)), ("with_map", (0.5, 0.8, 1.0))):
        table = sweep((0.0,), exposures, few, LOOPS[name][0])
        said = ", ".join(f"{b:g} s: {100 * k:.0f} %" for b, k in zip(exposures, table.kept[0], strict=True))
        rows[f"blur_limit_{name}"] = Figure(
            1e3 * table.blur_limit(), "ms", f"{few} seeds; {said}", better="higher"
        )
    return rows


def honest(seeds: int) -> dict[str, Figure]:
    """NEES over three, and the error at the end beside that of wheels and gyro alone."""
    drives = [simulate(FollowerSettings(noise=60.0, seed=100 + seed)) for seed in range(seeds)]
    each = np.array([one.nees.mean() for one in drives]) / 3.0
    spread = 2.0 * float(each.std(ddof=1)) / np.sqrt(seeds)
    ends = np.array(
        [[np.hypot(*(way - one.poses)[-1, :2]) for way in (one.estimates, one.odometry)] for one in drives]
    )
    filtered, alone = 100 * np.sqrt(np.mean(ends**2, axis=0))
    return {
        "follower_nees": Figure(
            float(each.mean()), "", f"1 = honest; ± {spread:.2f}, {seeds} drives", 1.3, 1.1
        ),
        "follower_end_error": Figure(filtered, "cm", f"wheels and gyro alone {alone:.0f} cm", 2.0, 1.0),
    }


def speed() -> dict[str, Figure]:
    """Frames and periods a second, on one thread."""
    sys.path.insert(0, str(EXAMPLES))
    image_sol = importlib.import_module("52_d2_suiveur").image_sol
    line = track("sinus").line
    pose = np.array([2.3, 0.1, -0.2])
    rng = np.random.default_rng(0)
    blurred = np.array([pose] * 9)
    spent = cpu_seconds(
        {
            "compiled": lambda: view().image(line, pose, rng=rng, noise=10.0),
            "blurred": lambda: view().image(line, blurred, rng=rng, noise=10.0),
            "numpy": lambda: image_sol(pose, line.points),
            "any_plane": lambda: render_ground(CAMERA, MOUNT, line, pose, rng=rng),
        }
    )
    simulate(steps=20)
    began = process_time()
    simulate(FollowerSettings(noise=20.0), 400)
    factor = 400 * PERIOD_S / (process_time() - began)
    ratio = spent["numpy"] / spent["compiled"]
    said = f"40x60, noise; NumPy makes {1 / spent['numpy']:.0f}, render_ground {1 / spent['any_plane']:.0f}"
    return {
        "ground_view_rate": Figure(1.0 / spent["compiled"], "1/s", said, 1000.0, 5000.0, "higher"),
        "ground_view_rate_blurred": Figure(
            1.0 / spent["blurred"], "1/s", "9 moments a shutter", better="higher"
        ),
        "ground_view_over_numpy": Figure(ratio, "x", "in one run", better="higher"),
        "follower_real_time": Figure(factor, "x", "the whole loop, with noise", 10.0, 50.0, "higher"),
    }
