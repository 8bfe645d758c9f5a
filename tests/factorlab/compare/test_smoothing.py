"""Errors of each axis, windows of several lengths, what smoothing bought: figures, words, and the page."""

import dataclasses
import json

import numpy as np
import pytest
from stereo_night_worlds import night

import sequential as sq
from factorlab.compare import compare, document
from factorlab.compare.axes import axis_errors
from factorlab.compare.bought import Told, bought, reasons, sentences
from factorlab.compare.lag_sweep import lag_sweep
from factorlab.compare.resources import kilobytes, resources
from factorlab.compare.smoothing_text import axis_table, lag_table, small
from factorlab.compare.text import terminal
from factorlab.compare.verdict import Finding
from factorlab.datasets import Dataset, Truth
from factorlab.report import write_report
from sequential.errors import ModelError, SolverError


@pytest.fixture(scope="module")
def simulated():
    """A driven camera whose truth is known, as a dataset."""
    one = night(np.random.default_rng(5), count=80)
    truth = Truth(one.t, one.truth[:, 4:], None, one.truth[:, :4])
    return Dataset(
        "night", "a simulated night", one.log, one.model, None, truth, 3, (), lambda _: one.model,
        lags=(0.0, 0.5, 2.0),
    )  # fmt: skip


@pytest.fixture(scope="module")
def table(simulated):
    return compare(simulated, ("ekf", "ieks", "batch"))


def test_axes_of_a_pose(simulated, rng):
    """An estimate that is the truth moved by a known step is off by that step, axis by axis."""
    t, truth = simulated.truth.t, np.hstack([simulated.truth.quaternion, simulated.truth.position])
    step = np.array([0.01, -0.02, 0.03, 0.0, 0.0, 0.0])
    mean = sq.SE3().retract(truth, step)
    mean[:, 4:] += [0.1, -0.2, 0.3]
    cov = np.tile(np.diag(np.square([0.01, 0.02, 0.02, 1.0, 1.0, 1.0])), (len(t), 1, 1))
    run = sq.Run(t, mean, cov, sq.SE3(), {}, float("nan"), sq.Report("made up"))
    told = axis_errors(simulated, run)
    np.testing.assert_allclose(
        told.error, np.tile([0.1, -0.2, 0.3, 0.01, -0.02, 0.03], (len(t), 1)), atol=1e-9
    )
    np.testing.assert_allclose(told.sigma, np.tile([1.0, 1.0, 1.0, 0.01, 0.02, 0.02], (len(t), 1)))
    np.testing.assert_allclose(told.rmse(), [0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
    assert told.units == ("m", "m", "m", "rad", "rad", "rad")
    assert told.inside().tolist() == [1.0] * 6
    narrow = dataclasses.replace(told, sigma=told.sigma / 2.5)
    assert narrow.inside().tolist() == [1.0, 1.0, 1.0, 1.0, 1.0, 0.0]


def test_axes_on_the_plane_have_a_heading(walker):
    """A planar truth with headings gives three axes; without, the two of a place."""
    t = walker.truth.t
    state = np.column_stack([walker.truth.position, np.linspace(-4.0, 4.0, len(t))])
    flat = dataclasses.replace(walker, truth=Truth(t, state[:, :2], state[:, 2]))
    turned = sq.SE2().normalize(state + np.array([0.0, 0.0, 0.1]))
    cov = np.tile(np.eye(3), (len(t), 1, 1))
    run = sq.Run(t, turned, cov, sq.SE2(), {}, float("nan"), sq.Report("made up"))
    told = axis_errors(flat, run)
    assert told.names == ("x", "y", "heading")
    np.testing.assert_allclose(told.error[:, 2], 0.1, atol=1e-9)
    assert told.nees_per_axis() > 0
    assert told.turns
    without = dataclasses.replace(walker, truth=Truth(t, state[:, :2]))
    assert axis_errors(without, run).names == ("x", "y")
    assert not axis_errors(without, run).turns
    assert axis_errors(dataclasses.replace(walker, truth=None), run) is None


def test_a_consistent_estimate_is_inside(table):
    for row in table.rows:
        assert row.axes.inside().min() > 0.95
        assert 0.3 < row.axes.nees_per_axis() < 2.5


def test_a_sweep_runs_from_the_filter_to_the_smoother(table):
    ekf, _, batch = table.rows
    none, some, much = table.lags
    assert [lag.lag_s for lag in table.lags] == [0.0, 0.5, 2.0]
    assert none.rmse == none.online_rmse == pytest.approx(ekf.rmse, rel=0.05)
    assert none.rmse > some.rmse > 0.9 * much.rmse
    assert much.rmse == pytest.approx(batch.rmse, rel=0.05)
    assert none.states_kept < some.states_kept < much.states_kept == 21
    assert none.memory_kb < some.memory_kb < much.memory_kb
    assert much.us_per_measurement > 0
    assert much.slowest_update_ms > 0


def test_a_sweep_takes_any_callable(walker):
    """No dataset needed: a solver of two runs, and something that scores one."""
    problem = sq.prepare(walker.model, walker.log)
    found = lag_sweep(
        lambda lag: sq.FixedLagSmoother(lag).solve_both(problem), lambda _: None, (1.0, 0.0), 100
    )
    assert [lag.lag_s for lag in found] == [0.0, 1.0]
    assert found[1].rmse is None
    assert found[1].us_per_measurement > 0


def test_a_window_that_cannot_be_solved_is_a_line(walker):
    def hopeless(lag):
        raise SolverError("the window\nis empty")

    (found,) = lag_sweep(hopeless, lambda _: None, (1.0,), 100)
    assert found.message == "the window is empty"
    assert found.rmse is None
    with pytest.raises(ModelError, match="zero or more; got -1"):
        lag_sweep(hopeless, lambda _: None, (1.0, -1.0), 100)


def test_latency_and_memory(table, simulated):
    ekf, _, batch = table.rows
    nodes = len(batch.run.t)
    assert ekf.resources.latency_s == 0.0
    assert ekf.resources.states_kept == 1
    assert batch.resources.latency_s == pytest.approx(7.9)
    assert batch.resources.states_kept == nodes
    assert ekf.resources.memory_kb == pytest.approx(8e-3 * (7 + 36))
    assert kilobytes(sq.SE3(), nodes) == batch.resources.memory_kb
    window = resources("fixed_lag", batch.run)
    assert window.latency_s == 0.0
    assert window.states_kept == 56, "5.5 s at 10 Hz, both ends"


def test_what_was_bought(table):
    gain = table.bought
    assert (gain.filter.name, gain.smoother.name) == ("ekf", "batch")
    assert gain.rmse_ratio == pytest.approx(table.rows[0].rmse / table.rows[2].rmse)
    assert gain.memory_ratio > 100
    assert gain.why == ()
    assert "times more accurate" in sentences(gain)[0]
    assert compare(dataclasses.replace(table.dataset, lags=()), ("ekf",)).bought is None


def told(anees, nis, name="ekf"):
    return Told(name, name.upper(), 1.0, anees, nis, 1.0, 0.0, 1.0)


WHITE = Finding("EKF: whiteness of gps", 0.5, None, "WARN", "", "")
OPEN = Finding("observability", None, None, "WARN", "no reading shows this of the start: turn of all", "")


@pytest.mark.parametrize(
    ("before", "after", "findings", "words"),
    [
        (told(1.1, 1.0), told(1.2, None), [], []),
        (told(4.0, 3.0), told(1.0, None), [], ["2 times larger", "noise is stated too small"]),
        (
            told(1.0, 0.1),
            told(9.0, None),
            [],
            ["3 times", "off together", "the more overconfident of the two"],
        ),
        (told(4.0, 1.0), told(1.0, None), [WHITE], ["2 times larger", "fresh evidence"]),
        (told(1.0, 1.0), told(1.0, None), [OPEN], ["turn of all"]),
    ],
)
def test_reasons_follow_the_evidence(before, after, findings, words):
    found = reasons(before, after, findings)
    assert len(found) == len(words)
    for word, sentence in zip(words, found, strict=True):
        assert word in sentence


def test_a_smoother_that_is_worse_is_told_as_such():
    gain = bought(told(1.0, 1.0), dataclasses.replace(told(1.0, None, "batch"), rmse=2.0))
    assert "2.00 times less accurate" in sentences(gain)[0]


def test_the_document_and_the_terminal_say_all_of_it(table):
    whole = document((table,), "factorlab compare night")
    json.dumps(whole, allow_nan=False)
    assert [lag["lag_s"] for lag in whole["lag_sweep"]] == [0.0, 0.5, 2.0]
    assert whole["bought"]["rmse_ratio"] > 1
    assert whole["estimators"]["ekf"]["resources"]["latency_s"] == 0.0
    assert whole["lag_sweep"][1]["axes"]["x"]["inside_3sigma"] > 0.9
    text = "\n".join(terminal(table))
    for words in ("inside ±3σ", "2 s later", "what waiting is worth", "what smoothing bought", "Price:"):
        assert words in text
    assert {len(line) for line in lag_table(table)} == {9}
    assert {len(line) for line in axis_table(table)} == {7}


def test_small_numbers_read_well():
    assert small(0.0213, "m") == "21.3 mm"
    assert small(2.5, "m") == "2.50 m"
    assert small(np.radians(0.84), "rad") == "0.840°"


def test_the_page_shows_it(table, tmp_path):
    page = write_report((table,), document((table,), "factorlab compare night"), tmp_path / "out").read_text()
    for words in ("What smoothing bought", "Each axis and its ±3σ", "What waiting is worth", "rotation z, °"):
        assert words in page


def test_no_lags_no_sweep(simulated):
    without = compare(simulated, ("ekf",), lags=())
    assert without.lags == ()
    assert lag_table(without) == ()
    assert "lag_sweep" not in document((without,), "x")
