"""Where there is no truth, the revisits judge: in the table, the JSON and the verdict."""

import dataclasses

import numpy as np
import pytest
from revisit_worlds import round_trip

from factorlab.datasets import SlamDataset
from factorlab.slam import compare_slam
from factorlab.slam.loops import loop_errors_of, loop_finding
from factorlab.slam.text import headings
from sequential.manifold import SE2
from sequential.slam import Factors, SlamRun, Values
from sequential.slam.models import Prior
from sequential.slam.revisits import LoopErrors


def without_truth(rng):
    """A drive that comes back twice, with odometry that drifts."""
    problem, truth = round_trip(0.02, rng)
    first = Factors(Prior(SE2()), ("x",), [[0]], truth.rows["x"][:1], 1e-6)
    driven, seen = problem.factors
    noisy = np.asarray(driven.z) + 0.02 * rng.standard_normal((500, 3))
    factors = (first, dataclasses.replace(driven, z=noisy, noise_cov=4e-4), seen)
    return SlamDataset("round", "There and back", dataclasses.replace(problem, factors=factors))


def test_a_comparison_without_truth_is_judged_by_its_loops(rng):
    comparison = compare_slam(without_truth(rng), ("batch",))
    (row,) = comparison.rows
    told = row.to_json()["loop_error"]
    assert told["revisits"] == 2
    assert told["rms_m"] == pytest.approx(row.loops.rms)
    assert told["rms_m"] < 0.3
    assert ("loop error", "m") in headings(comparison)
    (finding,) = [f for f in comparison.findings if f.metric.endswith("loop error")]
    assert finding.status == "PASS"
    assert "by dead reckoning" in finding.meaning


def test_loops_that_stay_open_are_a_warning(rng):
    dataset = without_truth(rng)
    open_ = LoopErrors(np.zeros(2, dtype=np.int64), np.array([5.0, 9.0]))
    finding = loop_finding(dataset, "batch graph", "batch", open_)
    assert finding.status == "WARN"
    assert "incremental" in finding.action


def test_with_a_truth_or_without_landmarks_there_is_none(rng):
    dataset = without_truth(rng)
    row = compare_slam(dataset, ("batch",)).rows[0]
    blind = dataclasses.replace(
        dataset, problem=dataclasses.replace(dataset.problem, factors=dataset.problem.factors[:2])
    )
    assert loop_errors_of(blind, row.run, row.trajectory) is None
    shorter = Values({"x": np.arange(3)}, {"x": np.zeros((3, 3))})
    other = SlamRun(shorter, {}, row.run.manifolds, row.run.report)
    assert loop_errors_of(dataset, other, row.trajectory) is None
