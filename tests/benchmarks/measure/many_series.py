"""Two hundred series of two thousand steps in one call, against the C loop over them."""

from __future__ import annotations

import ctypes

import numpy as np

import sequential as sq

from .c_loops import series_loop
from .cases import Linear, stamps, track
from .contest import contest, present
from .figures import Figure
from .peers import simdkalman_series

__all__ = ["figures", "linear_model"]

SERIES, STEPS = 200, 2000


def linear_model(case: Linear, density: float = 0.5) -> sq.StateSpace:
    """A track as a user declares it."""
    n, m = case.sizes
    process = (sq.ConstantVelocity, sq.ConstantAcceleration)[n // m - 2](density, axes=m)
    sensors = {"z": sq.LinearSensor(case.H, case.R)}
    return sq.StateSpace(sq.Vector(n), sq.Gaussian(case.x0, case.P0), process, sensors, start=0)


def figures(library: ctypes.CDLL) -> dict[str, Figure]:
    """CPU time of all threads over that of the loop, with one covariance for all series and with one each."""
    case = track(2, 2, STEPS, SERIES)
    model, t, loop = linear_model(case), stamps(STEPS), series_loop(library, case)
    loop.work()
    gappy = case.z.copy()
    gappy[0, 0, 0] = np.nan  # one mask of its own, and the covariances are no longer shared by all
    steps = SERIES * STEPS

    def c() -> np.ndarray:
        loop.work()
        return loop.mean[-1, -1]

    ours = {
        "c": (c, steps),
        "shared": (lambda: sq.filter_series(model, t, case.z).mean[-1, -1], steps),
        "apart": (lambda: sq.filter_series(model, t, gappy).mean[-1, -1], steps),
    }
    peers = present(case, {"simdkalman": (simdkalman_series, STEPS)})
    peers = {name: (work, steps) for name, (work, _) in peers.items()}
    micros = contest(lambda _: loop.mean[-1, -1], ours, peers, rounds=5)
    beside = f"C {micros['c']:.3f} µs a step, ours {micros['shared']:.3f}"
    found = {
        "series_ratio_c": Figure(micros["shared"] / micros["c"], "x", beside, 2.0, 0.5),
        "series_apart_ratio_c": Figure(micros["apart"] / micros["c"], "x", "a mask of its own in one series"),
    }
    if "simdkalman" in micros:
        found["peer_series_simdkalman"] = Figure(micros["simdkalman"], "µs", "a step of one series")
    return found
