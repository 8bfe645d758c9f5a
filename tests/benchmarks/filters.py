"""Every figure of the filter library, each beside its peers and a C loop of this run.

`python filters.py [--json] [--full]`; --full fuzzes 100 000 models instead of 10 000.  CPU time, medians of
interleaved rounds.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import sequential as sq

# fuzz, exact, dense and worlds of the tests; after sequential, since the tests have a folder of that name
sys.path.append(str(Path(__file__).resolve().parents[1]))

from measure import exactness, many_series, per_sample, start_up
from measure.c_loops import Loop, compile_loops, linear_loop, planar_loop
from measure.cases import Linear, circle, stamps, track, unicycle_problem
from measure.contest import Entry, contest, present
from measure.figures import Figure, publish, say
from measure.many_series import linear_model
from measure.peers import FILTERS, SMOOTHERS
from measure.planar_peers import EXTENDED, UNSCENTED

# axes, order, steps; must and aim against filterpy
TRACKS = {
    "kf_2": ((1, 2, 10_000), (200.0, 380.0)),
    "kf_4": ((2, 2, 10_000), (90.0, 150.0)),
    "kf_9": ((3, 3, 5_000), (20.0, 37.0)),
}
PLANAR = {
    "ekf": ("extended", sq.ExtendedKalmanFilter, EXTENDED, (150.0, 285.0)),
    "ukf": ("unscented", sq.UnscentedKalmanFilter, UNSCENTED, (300.0, 520.0)),
}
Table = dict[str, dict[str, float]]  # by case, by library: CPU microseconds a step


def linear_problem(case: Linear, steps: int | None = None) -> sq.Problem:
    """A track's model on the first steps of its log."""
    z = case.z[0, :steps]
    return sq.prepare(linear_model(case), sq.SensorLog({"z": sq.Stream(stamps(len(z)), z)}))


def entries(loop: Loop, makes: Callable[..., Any], problem: sq.Problem) -> dict[str, Entry]:
    """The loop and our filter, as it comes and made for its sizes."""
    steps = len(loop.mean)

    def c() -> np.ndarray:
        loop.work()
        return loop.mean[-1]

    plain, special = makes(), makes(specialise=True)
    return {
        "c": (c, steps),
        "ours": (lambda: plain.solve(problem).mean[-1], steps),
        "ours_specialised": (lambda: special.solve(problem).mean[-1], steps),
    }


def filters(library: ctypes.CDLL) -> Table:
    """Whole logs through every filter."""
    table: Table = {}
    for name, (size, _) in TRACKS.items():
        say(f"{name}: {size[2]} steps")
        case = track(*size)
        loop = linear_loop(library, case)
        ours = entries(loop, sq.KalmanFilter, linear_problem(case))
        table[name] = contest(lambda n, loop=loop: loop.mean[n - 1], ours, present(case, FILTERS))
    case = circle(5_000)
    problem = unicycle_problem(case)
    for name, (function, makes, peers, _) in PLANAR.items():
        say(f"{name}: unicycle, {len(case.z)} steps")
        loop = planar_loop(library, case, function)
        ours = entries(loop, makes, problem)
        table[name] = contest(lambda n, loop=loop: loop.mean[n - 1], ours, present(case, peers))
    return table


def smoothers() -> dict[str, float]:
    """Whole logs of four states through every filter and its smoother; no C loop."""
    say("rts: 5000 steps")
    case = track(2, 2, 5_000)
    smoother = sq.RauchTungStriebel(sq.KalmanFilter(), leave_one_out=False)
    problem = linear_problem(case)

    def expected(steps: int) -> np.ndarray:  # at the first reading; the prior may have a node of its own
        return smoother.solve(linear_problem(case, steps)).mean[-steps]

    ours: dict[str, Entry] = {"ours": (lambda: smoother.solve(problem).mean[-5_000], 5_000)}
    return contest(expected, ours, present(case, SMOOTHERS), rounds=5)


def ratios(table: Table) -> dict[str, Figure]:
    """Ours over C, and filterpy over ours."""
    found = {}
    for name in (*TRACKS, *PLANAR):
        micros = table[name]
        c, plain, special = (micros[key] for key in ("c", "ours", "ours_specialised"))
        linear = name in TRACKS
        must, against = (4.0, TRACKS[name][1]) if linear else (3.0, PLANAR[name][3])
        said = f"C {c:.3f} µs a step"
        found[f"{name}_ratio_c"] = Figure(special / c, "x", f"{said}, ours {special:.3f}", must, 2.0)
        found[f"{name}_default_ratio_c"] = Figure(
            plain / c, "x", f"any size; ours {plain:.3f}", must if linear else None
        )
        if "filterpy" in micros:
            peer = f"filterpy {micros['filterpy']:.1f} µs a step"
            found[f"{name}_against_filterpy"] = Figure(
                micros["filterpy"] / plain, "x", peer, *against, "higher"
            )
            found[f"{name}_specialised_against_filterpy"] = Figure(
                micros["filterpy"] / special, "x", "made for its sizes", better="higher"
            )
    return found


def beside(table: Table) -> dict[str, Figure]:
    """Every library as a figure, and all of them as a table on stderr."""
    names = sorted({name for row in table.values() for name in row})
    say(f"{'CPU µs a step':<20}" + "".join(f"{case:>10}" for case in table))
    for name in names:
        cells = (f"{row[name]:10.3f}" if name in row else f"{'':>10}" for row in table.values())
        say(f"{name:<20}" + "".join(cells))
    return {
        f"peer_{case}_{name}": Figure(value, "µs", f"a step; ours {row['ours']:.3f}")
        for case, row in table.items()
        for name, value in row.items()
    }


def main() -> int:
    """Measure and publish."""
    library = compile_loops()
    table = filters(library)
    table["rts"] = smoothers()
    figures = ratios(table)
    say("many series")
    figures |= many_series.figures(library)
    say("sample by sample")
    figures |= per_sample.figures()
    say("fresh processes")
    figures |= start_up.figures()
    say("exactness")
    figures |= exactness.figures(100_000 if "--full" in sys.argv[1:] else 10_000)
    return publish(figures | beside(table))


if __name__ == "__main__":
    sys.exit(main())
