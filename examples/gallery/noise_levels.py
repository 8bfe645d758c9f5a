"""Five ways to the noise of one filter: at rest, by the NIS, by likelihood, by EM, by autocovariances.

A trolley on a track is pushed about by hand; a laser with steps of 5 mm says where it is.
Run as a script it compares the five; with a file name it leaves the recording at rest for the command line:

    python noise_levels.py rest.csv
    factorlab tune rest.csv --method still
"""

import sys

import numpy as np

import sequential as sq
from sequential.readers import write_log

STEP_M, SIGMA_M, PUSH = (
    0.005,
    0.02,
    0.3,
)  # resolution, noise of the laser, density of the acceleration (m²/s³)
DT = 0.05


def model(density=0.01, sigma=0.1):
    """What is believed before any of this: a push thirty times too gentle, a laser five times too bad."""
    return sq.StateSpace(
        manifold=sq.Vector(2),
        prior=sq.Gaussian([0.0, 0.0], [1.0, 1.0]),
        process=sq.ConstantVelocity(density),
        sensors={"laser": sq.LinearSensor([[1.0, 0.0]], sigma**2)},
        start=0.0,
    )


def quantised(stream):
    """The laser counts in steps."""
    return sq.Stream(stream.t, np.round(stream.values / STEP_M) * STEP_M)


def record(rng):
    """A minute at rest with a draught in the middle, and two minutes of pushing."""
    resting = 1.2 + SIGMA_M * rng.standard_normal(1200)
    resting[600] += 0.5
    rest = sq.SensorLog({"laser": quantised(sq.Stream(np.arange(1200) * DT, resting))}, "rest")
    pushed = sq.simulate(model(PUSH, SIGMA_M), np.arange(2400) * DT, rng).log
    return rest, pushed.replaced(laser=quantised(pushed["laser"]))


def main():
    rest, pushed = record(np.random.default_rng(4))
    if len(sys.argv) == 2:
        write_log(sys.argv[1], rest)

    still = sq.noise_from_still(rest, "laser", unit="m")
    sigma = still.values["laser σ"]
    print(f"at rest: σ = {sigma * 1000:.1f} mm; {'; '.join(still.notes)}")

    def build(values):
        return model(values["density"], values["sigma"])

    knobs = [sq.Knob("density", 0.01, "m²/s³", decades=2.0), sq.Knob("sigma", sigma, "m")]
    found = {
        "by the NIS": sq.tune_by_nis(build, knobs, pushed, turn=["density"]),
        "by likelihood": sq.tune(build, knobs, pushed),
        "by EM": sq.expectation_maximization(model(), pushed),
        "by autocovariances": sq.autocovariance_least_squares(model(), pushed),
    }
    for name, result in found.items():
        density = result.model.process.acceleration_density
        level = float(result.model.sensors["laser"].noise_cov[0, 0]) ** 0.5
        told = f"push {density:.3f} m²/s³, σ {level * 1000:.1f} mm, {result.evaluations} filter passes"
        print(f"{name:18}  {told}")
        assert result.after.consistent, result.verdict
        assert 0.5 * PUSH < density < 2.0 * PUSH
        assert abs(level - SIGMA_M) < 0.1 * SIGMA_M
    low, high = found["by likelihood"].interval("density")
    assert low < PUSH < high
    assert not found["by likelihood"].before.consistent, "the push was thirty times too gentle"


if __name__ == "__main__":
    main()
