"""A comparison of SLAM estimators on a simulated loop: figures, verdicts, page and files."""

import dataclasses
import json

import numpy as np
import pytest
from slam_worlds import loops

from factorlab.compare.table import document
from factorlab.datasets import SlamDataset, Truth
from factorlab.report.slam_writing import write_slam_report
from factorlab.slam import compare_slam
from factorlab.slam.page import slam_document
from factorlab.slam.text import terminal
from sequential.errors import ModelError
from sequential.evaluate import umeyama

ROWS = ("ekf_slam", "fixed_lag", "isam2", "isam2_final", "batch")


def dataset_of(world, **changes):
    t = np.arange(len(world.poses), dtype=np.int64) * 100_000_000
    problem = dataclasses.replace(world.problem, t=t)
    truth = Truth(t, world.poses[:, :2], np.unwrap(world.poses[:, 2]))
    places = dict(enumerate(world.landmarks))
    plain = SlamDataset("loops", "A robot on a circle", problem, truth, places)
    return dataclasses.replace(plain, **changes)


@pytest.fixture(scope="module")
def compared():
    world = loops(np.random.default_rng(4), steps=60, turns=2.0, landmarks=8)
    return world, compare_slam(dataset_of(world), ROWS)


def test_every_estimator_is_scored_against_the_truth(compared):
    world, comparison = compared
    assert [row.name for row in comparison.rows if not row.failed] == list(ROWS)
    for row in comparison.rows:
        error = row.trajectory.mean[:, :2] - world.poses[:, :2]
        assert row.scores.rmse == pytest.approx(np.sqrt(np.mean(np.sum(error**2, axis=1))), rel=1e-12)
        assert row.scores.against == "truth"
        assert row.map_score.count == len(world.problem.indices("l"))
        assert len(row.scores.inside()) == 3


def test_later_readings_help_and_the_batch_is_where_isam2_ends(compared):
    rows = {row.name: row for row in compared[1].rows}
    assert rows["batch"].scores.rmse < rows["isam2"].scores.rmse
    assert rows["isam2_final"].chi2 == pytest.approx(rows["batch"].chi2, rel=1e-3)
    assert rows["isam2_final"].scores.rmse == pytest.approx(rows["batch"].scores.rmse, rel=0.05)
    assert any(finding.metric == "what smoothing bought" for finding in compared[1].findings)


def test_the_filter_is_told_what_it_claims_to_see(compared):
    (told,) = (one for one in compared[1].findings if "heading of the world" in one.metric)
    assert told.value > 1.05
    assert told.status == "WARN"
    assert "first_estimates" in told.action


def test_json_and_terminal_tell_the_same(compared):
    plain = compared[1].to_json()
    assert set(plain["estimators"]) == set(ROWS)
    assert plain["variables"] == {"x": 60, "l": 8}
    json.dumps(plain, allow_nan=False)
    text = "\n".join(terminal(compared[1]))
    assert "batch graph" in text
    assert "60 poses, 8 landmarks" in text


def test_report_holds_page_json_trajectories_and_maps(compared, tmp_path):
    whole = document((compared[1],), "factorlab compare loops")
    page = write_slam_report((compared[1],), whole, tmp_path / "out")
    told = json.loads((page.parent / "report.json").read_text())
    assert {f"trajectories/{name}.tum" for name in ROWS} <= set(told["files"])
    assert (page.parent / "maps/batch.csv").read_text().startswith("id,x,y\n")
    text = page.read_text()
    assert text.count("<svg") == 4


def test_without_truth_the_batch_stands_in(compared):
    problem = dataclasses.replace(compared[1].dataset.problem, t=None)
    dataset = dataclasses.replace(compared[1].dataset, truth=None, landmarks={}, problem=problem)
    comparison = compare_slam(dataset, ("isam2", "batch"))
    isam, batch = comparison.rows
    gap = isam.trajectory.mean[:, :2] - batch.trajectory.mean[:, :2]
    assert isam.scores.rmse == pytest.approx(np.sqrt(np.mean(np.sum(gap**2, axis=1))), rel=1e-12)
    assert isam.scores.against == "the batch"
    assert isam.to_json()["rmse_m"] is None
    assert isam.to_json()["rmse_to_batch_m"] > 0
    assert batch.scores.rmse == 0.0
    assert isam.scores.honesty is None
    slam_document((comparison,), "")


def test_an_arbitrary_frame_is_aligned_first(compared):
    world, comparison = compared
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    moved = world.poses[:, :2] @ turn.T + [3.0, -2.0]
    truth = dataclasses.replace(comparison.dataset.truth, position=moved, heading=None)
    dataset = dataclasses.replace(comparison.dataset, truth=truth, aligned="rigid", landmarks={})
    (row,) = compare_slam(dataset, ("batch",)).rows
    batch = next(one for one in comparison.rows if one.name == "batch").trajectory.mean[:, :2]
    rotation, shift, _ = umeyama(batch, moved)
    error = batch @ rotation.T + shift - moved
    assert row.scores.rmse == pytest.approx(np.sqrt(np.mean(np.sum(error**2, axis=1))), rel=1e-9)
    assert row.scores.honesty is None


def test_a_failed_solve_is_a_row_with_its_reason(compared):
    problem = compared[1].dataset.problem
    loose = dataclasses.replace(problem, factors=problem.factors[1:])
    comparison = compare_slam(dataclasses.replace(compared[1].dataset, problem=loose), ("batch",))
    assert comparison.all_failed
    assert comparison.findings[0].status == "FAIL"
    assert comparison.rows[0].message


def test_reference_costs_are_judged(compared):
    batch = compared[1].row("batch")
    for reference, verdict in ((batch.chi2, "PASS"), (2 * batch.chi2, "PASS"), (0.5 * batch.chi2, "WARN")):
        dataset = dataclasses.replace(compared[1].dataset, reference={"chi2": reference})
        comparison = compare_slam(dataset, ("batch",))
        assert [f.status for f in comparison.findings if f.metric == "final χ²"] == [verdict]


def test_lags_are_swept_on_request(compared):
    comparison = compare_slam(compared[1].dataset, ("batch",), lags=(3, 40))
    short, long = comparison.lags
    assert (short.lag, long.lag) == (3, 40)
    assert long.rmse < short.rmse
    told = comparison.to_json()["lag_sweep"]
    assert told[1]["us_per_measurement"] > 0
    sections = slam_document((comparison,), "").sections
    assert any(section.heading == "What waiting is worth" for section in sections)
    with pytest.raises(ModelError, match="lag counts steps"):
        compare_slam(compared[1].dataset, ("batch",), lags=(0,))
