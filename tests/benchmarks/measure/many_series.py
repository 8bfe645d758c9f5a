"""Two hundred series of two thousand steps in one call, against the C loop over them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

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
    steps = SERIES * STEPS

    def c() -> np.ndarray:
        loop.work()
        return loop.mean[-1, -1]

    def ours(**settings: bool) -> tuple[Callable[[], np.ndarray], int]:
        return lambda: sq.filter_series(model, t, case.z, **settings).mean[-1, -1], steps

    entries = {
        "c": (c, steps),
        "shared": ours(),
        "shared_specialised": ours(specialise=True),
        "apart": ours(shared=False),
        "apart_specialised": ours(shared=False, specialise=True),
    }
    peers = present(case, {"simdkalman": (simdkalman_series, STEPS)})
    peers = {name: (work, steps) for name, (work, _) in peers.items()}
    micros = contest(lambda _: loop.mean[-1, -1], entries, peers, rounds=5)
    ratio = {name: micros[name] / micros["c"] for name in entries}
    beside = f"C {micros['c']:.3f} µs a step, ours {micros['shared']:.3f}"
    found = {
        "series_ratio_c": Figure(ratio["shared"], "x", beside, 2.0, 0.5),
        "series_specialised_ratio_c": Figure(ratio["shared_specialised"], "x", "made for its size"),
        "series_apart_ratio_c": Figure(ratio["apart"], "x", "a covariance for each series"),
        "series_apart_specialised_ratio_c": Figure(ratio["apart_specialised"], "x", "and made for its size"),
    }
    if "simdkalman" in micros:
        found["peer_series_simdkalman"] = Figure(micros["simdkalman"], "µs", "a step of one series")
    return found
