"""Real drives on line: the numbers of the whole log, also where fixes come late."""

import numpy as np
import pytest

import sequential as sq
from factorlab.datasets import load

FILTER = sq.ExtendedKalmanFilter()


def ends_like_the_log(recording, delays, max_delay, seed=1):
    """Stream a recording with delays; the last belief against the run's, to rounding."""
    log, model = recording.log, recording.model
    used = log.without(*(name for name in log if name not in {*model.sensors, model.input}))
    events = sq.arrivals(used, delays, np.random.default_rng(seed))
    estimates = sq.stream(FILTER, model, events, max_delay=max_delay)
    made = list(estimates)
    end = estimates.belief
    run = sq.run(FILTER, model, used, at=np.array([end.t]))
    scale = np.sqrt(np.diagonal(run.cov[-1]))
    np.testing.assert_allclose(end.mean, run.mean[-1], rtol=1e-12, atol=1e-12)
    assert (np.abs(end.cov - run.cov[-1]) <= 1e-12 * np.outer(scale, scale)).all()
    return made, run, estimates.summary


@pytest.mark.parametrize(
    "delays", [{}, {"gps": 0.3}, {"imu": 0.05}], ids=["in order", "late fixes", "late imu"]
)
def test_kitti(delays):
    (recording,) = load("kitti", use_every=5)
    made, run, summary = ends_like_the_log(recording, delays, 0.3 if delays else 0.0)
    fixes = [estimate for estimate in made if estimate.name == "gps"]
    logged = run.innovations["gps"]
    assert len(fixes) == len(logged.t)
    assert summary.rejected == {}
    assert (summary.late > 0) == bool(delays)
    if delays == {"gps": 0.3}:  # every input that covers the way to a fix is there before the fix
        residuals = [fix.innovation.residual for fix in fixes]
        np.testing.assert_allclose(residuals, logged.residual, rtol=1e-12, atol=1e-12)


def test_plaza():
    (recording,) = load("plaza1")
    _, run, summary = ends_like_the_log(recording, {"range": lambda rng, n: rng.uniform(0.0, 1.0, n)}, 1.0)
    assert summary.late > 500
    assert summary.rejected == {}
    assert len(run.t) > 1000
