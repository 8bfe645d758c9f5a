"""The Allan family and the noise coefficients: exactness, speed, and intervals that hold the truth.

    python tests/benchmarks/allan_figures.py [--json]

`figures()` gives the same to tests/benchmarks/imu_calibration.py.
"""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # noise_worlds

import allantools
from allantools import ci
from measure.figures import Figure, publish, say
from noise_worlds import still_sensor

from sequential.sensors import allan_deviation, fit_noise
from sequential.sensors.allan_freedom import degrees_of_freedom

KINDS = {"overlapping": allantools.oadev, "hadamard": allantools.ohdev, "modified": allantools.mdev}
RECORDINGS = 300
ALL_FIVE = {"N": 0.1, "B": 0.1, "K": 0.05, "Q": 0.01, "R": 0.01}
# samples, Hz, corner of a low-pass filter (Hz) or None, what the sensor has, which terms such a record shows
REGIMES = {
    "white, 200 s": (20_000, 100.0, None, {"N": 0.1}, "N"),
    "white, 15 s": (1500, 100.0, None, {"N": 0.1}, "N"),
    "white and flicker": (20_000, 100.0, None, {"N": 0.1, "B": 0.1}, "NB"),
    "white and walk": (20_000, 100.0, None, {"N": 0.1, "K": 0.1}, "NK"),
    "all three, 20 min": (60_000, 50.0, None, {"N": 0.1, "B": 0.1, "K": 0.03}, "NBK"),
    "with drift and quantised": (20_000, 20.0, None, ALL_FIVE, "NBK"),
    "low-passed, flicker": (20_000, 100.0, 20.0, {"N": 0.1, "B": 0.1}, "NB"),
}  # fmt: skip
# still MPU-6050, deg/s/√Hz: slope -1/2 through allantools' deviations of 0.05 to 5 s
REAL = np.array([0.00751, 0.01123, 0.00934])


def figures() -> dict[str, Figure]:
    """All figures of this part."""
    found = {**_exactness(), **_speed(), **_coverage()}
    folder = os.environ.get("FACTORLAB_DATA")
    return {**found, **_real(Path(folder))} if folder else found


def _exactness() -> dict[str, Figure]:
    rng = np.random.default_rng(1)
    steps = rng.standard_normal((3, 50_000))
    signals = (steps[0] + 9.81, np.cumsum(steps[1]), steps[0] + 0.01 * np.cumsum(steps[2]))
    worst = 0.0
    for kind, oracle in KINDS.items():
        for x in signals:
            ours = allan_deviation(x, 100.0, kind, taus=np.geomspace(0.01, 120.0, 100))
            _, reference, _, _ = oracle(x, rate=100.0, data_type="freq", taus=ours.tau)
            worst = max(worst, float(np.abs(ours.deviation / reference - 1.0).max()))
    freedom = 0.0
    for alpha in (0, -1, -2):
        for order, modified in ((2, False), (3, False), (2, True)):
            for m in (1, 10, 200, 3000):
                oracle = ci.edf_greenhall(alpha, order, m, 50_001, overlapping=True, modified=modified)
                ours = degrees_of_freedom(alpha, order, m, 50_001, modified=modified)
                freedom = max(freedom, abs(ours / oracle - 1.0))
    against = f"allantools {allantools.__version__}"
    return {
        "allan_deviation_difference": Figure(worst, "relative", f"{against}: oadev, ohdev, mdev", 1e-9),
        "allan_freedom_difference": Figure(freedom, "relative", f"{against}: edf_greenhall", 1e-9),
    }


def _speed() -> dict[str, Figure]:
    rng = np.random.default_rng(2)
    x = rng.standard_normal((1_000_000, 6))
    taus = np.unique(np.round(np.geomspace(1, 250_000, 113)))[:100] / 100.0
    assert len(taus) == 100
    works = {
        "ours": lambda: allan_deviation(x, 100.0, taus=taus),
        "allantools": lambda: allantools.oadev(x[:, 0], rate=100.0, data_type="freq", taus=taus),
    }
    times: dict[str, list[float]] = {name: [] for name in works}
    for turn in range(6):
        for name, work in works.items():
            began = process_time()
            work()
            if turn:  # the first one warms up
                times[name].append(process_time() - began)
    ours, theirs = median(times["ours"]), median(times["allantools"])
    said = f"six axes of 1e6, 100 taus, with intervals; allantools.oadev {theirs:.2f} s an axis in this run"
    return {
        "allan_six_axes": Figure(ours, "s CPU", said, 1.0, 0.3),
        "allan_over_allantools": Figure(ours / (6 * theirs), "ratio", "same work, same run", 1.0),
    }


def _recording(
    seed: int, count: int, rate: float, corner: float | None, truth: dict[str, float]
) -> np.ndarray:
    rng = np.random.default_rng([seed, 11])
    if corner is None:
        return still_sensor(rng, count, rate, **truth)
    from scipy.signal import butter, lfilter

    return lfilter(*butter(2, corner, fs=rate), still_sensor(rng, count + 1000, rate, **truth))[1000:]


def _coverage() -> dict[str, Figure]:
    shown: dict[str, dict[str, float]] = {term: {} for term in "NBK"}
    hidden: dict[str, float] = {}
    for regime, (count, rate, corner, truth, terms) in REGIMES.items():
        inside = dict.fromkeys("NBK", 0)
        began = process_time()
        for seed in range(RECORDINGS):
            fit = fit_noise(_recording(seed, count, rate, corner, truth), rate)
            for term in inside:
                inside[term] += fit[term].low <= truth.get(term, 0.0) <= fit[term].high
        shares = {term: number / RECORDINGS for term, number in inside.items()}
        for term, share in shares.items():
            if term in terms:
                shown[term][regime] = share
            else:
                hidden[f"{term}, {regime}"] = share
        milliseconds = 1e3 * (process_time() - began) / RECORDINGS
        said = "  ".join(f"{term} {share:.3f}" for term, share in shares.items())
        say(f"{regime:<28} {said}   {milliseconds:.0f} ms a recording, simulated too")
    found = {}
    for term, shares in shown.items():
        low, high = min(shares, key=shares.__getitem__), max(shares, key=shares.__getitem__)
        name = f"coverage_{term}"
        found[f"{name}_lowest"] = Figure(
            shares[low], "share", f"of {RECORDINGS}, over {len(shares)} regimes: {low}", 0.90, 0.93, "higher"
        )
        found[f"{name}_highest"] = Figure(shares[high], "share", f"of {RECORDINGS}: {high}", 0.99, 0.97)
    least = min(hidden, key=hidden.__getitem__)
    found["coverage_of_upper_bounds"] = Figure(
        hidden[least], "share", f"terms that are not there, lowest: {least}", 0.90, 0.95, "higher"
    )
    return found


def _real(folder: Path) -> dict[str, Figure]:
    rows = np.loadtxt(folder / "imu/mpu6050/example_data_tinit_calc.csv", delimiter=",", skiprows=5)
    fits = [fit_noise(rows[:, column] / 131.0, 100.0) for column in (3, 4, 5)]
    found = np.array([fit.N.value for fit in fits])
    said = "N of gx, gy, gz: " + " ".join(f"{value:.5f}" for value in found) + " deg/s/√Hz"
    return {
        "mpu6050_N_difference": Figure(float(np.abs(found / REAL - 1.0).max()), "relative", said, 0.03, 0.02)
    }


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    raise SystemExit(publish(figures()))
