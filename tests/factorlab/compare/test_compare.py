"""The table: scores, honesty, failures, and the names that everybody uses."""

import dataclasses
import json

import numpy as np
import pytest

import sequential as sq
from factorlab.compare import NAMES, UnknownEstimatorError, compare, document, make
from factorlab.compare.accuracy import errors_of, has_position, scored_sensor
from factorlab.compare.engine import prepare
from factorlab.compare.estimators import require_names
from factorlab.compare.text import band, cells, figure, headings, headline, terminal
from factorlab.datasets import load
from sequential.errors import ModelError, SolverError
from sequential.tuning import noise_knobs, scaled


def test_the_names_are_the_agreed_ones():
    assert NAMES == ("ekf", "iekf", "ukf", "ekf_rts", "ieks", "fixed_lag", "isam2", "isam2_final", "batch")


@pytest.mark.parametrize("name", [*NAMES, "kf", "kf_rts"])
def test_an_estimator_carries_the_name_it_is_asked_by(name):
    assert make(name).name == name


def test_an_unknown_name_is_met_with_the_nearest():
    with pytest.raises(UnknownEstimatorError, match="did you mean 'ieks'"):
        require_names(("ekf", "iekss"))
    assert require_names(("ekf", "batch", "ekf")) == ("ekf", "batch")


def test_rmse_and_normalised_error_against_the_truth(walker):
    table = compare(walker, ("ekf",))
    row = table.rows[0]
    run = sq.run(sq.ExtendedKalmanFilter(), walker.model, walker.log)
    error = run.mean[:, :2] - walker.truth.position
    assert row.rmse == pytest.approx(np.sqrt(np.mean(np.sum(error**2, axis=1))))
    one = error[7] @ np.linalg.solve(run.cov[7][:2, :2], error[7])
    assert row.errors.normalised()[7] == pytest.approx(one)
    assert row.to_json()["held_out_rmse_m"] is None


def test_held_out_readings_count_their_own_noise(walker):
    log, held = walker.log.hold_out("gps", 3)
    dataset = dataclasses.replace(walker, log=log, held_out=held, truth=None)
    assert scored_sensor(walker.model) == "gps"
    run = sq.run(sq.ExtendedKalmanFilter(), walker.model, log, at=held.t)
    errors = errors_of(dataset, walker.model, run)
    row = run.index(held.t)[4]
    np.testing.assert_allclose(errors.error[4], held.values[4] - run.mean[row, :2])
    np.testing.assert_allclose(errors.cov[4], run.cov[row][:2, :2] + 0.04 * np.eye(2))
    gaps, sizes = np.unique(errors.block, return_counts=True)
    assert set(sizes) == {2}, "two held-out readings between two used ones are one block"
    assert len(gaps) == len(log["gps"])


def test_a_sensor_of_any_kind_can_be_held_out(walker):
    def spot(x):
        return np.array([np.hypot(x[0] + 30.0, x[1]), np.arctan2(x[1], x[0] + 30.0)])

    states = sq.run(sq.RauchTungStriebel(), walker.model, walker.log).mean
    seen = np.array([spot(x) for x in states])
    log = walker.log.replaced(radar=sq.Stream(walker.log["gps"].t, seen)).without("gps", "tag")
    radar = sq.Sensor(spot, [0.01, 1e-4], manifold=sq.Product(range=sq.Vector(1), bearing=sq.SO2()))
    model = dataclasses.replace(walker.model, sensors={"radar": radar})
    used, held = log.hold_out("radar", 2)
    dataset = dataclasses.replace(walker, log=used, model=model, held_out=held, truth=None)
    row = compare(dataset, ("ekf",)).rows[0]
    assert row.to_json()["held_out_rmse_m"] is None
    assert 0 < row.to_json()["held_out_rmse"] < 0.5


def test_consistent_estimates_are_inside_their_bands(rng, walker):
    table = compare(walker)
    for row in table.rows:
        assert 0.5 < row.nis.mean / row.nis.expected < 1.5
        low, high = row.normalised_error.bootstrap_band95
        assert low < row.normalised_error.mean < high
    assert not [finding for finding in table.findings if finding.status == "FAIL"]


def test_noise_that_is_too_small_is_blamed(walker):
    timid = scaled(walker.model, {"gps σ": 0.1})
    table = compare(dataclasses.replace(walker, model=timid), ("ekf", "ieks"))
    assert table.findings[0].status == "FAIL"
    assert any("noise of gps about" in f.action and f.status == "FAIL" for f in table.findings)


def test_what_no_reading_shows_is_named(walker):
    """Two tags with the same unknown offset: position and offset are one number to them."""
    state = sq.Product(motion=sq.Vector(4), offset=sq.Vector(2))
    process = sq.Independent(motion=sq.ConstantVelocity(0.04, axes=2), offset=sq.RandomWalk(1e-4))
    both = np.hstack([np.eye(2, 4), np.eye(2)])
    sensors = {"gps": sq.LinearSensor(both, 0.04 * np.eye(2)), "tag": sq.LinearSensor(both, 0.25 * np.eye(2))}
    prior = sq.Gaussian([0, 0, 1.0, 0, 0, 0], [0.25] * 6)
    shifted = dataclasses.replace(walker, model=sq.StateSpace(state, prior, process, sensors))
    seen = [f for f in compare(shifted, ("kf", "kf_rts")).findings if f.metric == "observability"]
    assert [f.status for f in seen] == ["WARN", "WARN"]
    assert all("motion.x" in f.meaning and "offset.x" in f.meaning for f in seen)
    assert not [f for f in compare(walker, ("ekf",)).findings if f.metric == "observability"]


def test_a_solver_that_fails_is_a_row(walker, monkeypatch):
    class Hopeless:
        name = "ekf"

        def solve(self, problem):
            raise SolverError("the solve\nwent astray")

    monkeypatch.setattr(
        "factorlab.compare.timing.make", lambda name: make(name) if name != "ekf" else Hopeless()
    )
    table = compare(walker, ("ekf", "ieks"))
    failed, fine = table.rows
    assert failed.failed
    assert failed.message == "the solve went astray"
    assert not fine.failed
    assert not table.all_failed
    assert [f.status for f in table.findings if f.estimator == "ekf"] == ["FAIL"]
    assert "the solve went astray" in "\n".join(terminal(table))
    json.dumps(document((table,), "test"), allow_nan=False)


def test_one_pass_of_isam2_serves_both_rows(monkeypatch):
    from factorlab.graph import IncrementalGraph

    (kitti,) = load("kitti", use_every=5)
    short = dataclasses.replace(
        kitti,
        log=kitti.log.between(stop=kitti.log["gps"].t[8]),
        held_out=kitti.held_out.select(np.arange(36)),
    )
    passes = []
    monkeypatch.setattr(
        IncrementalGraph,
        "solve_both",
        lambda self, problem, whole=IncrementalGraph.solve_both: passes.append(1) or whole(self, problem),
    )
    table = compare(short, ("isam2", "isam2_final"))
    assert len(passes) == 1
    assert [row.name for row in table.rows] == ["isam2", "isam2_final"]
    assert table.rows[1].rmse < table.rows[0].rmse


def test_several_recordings_make_one_document(walker):
    other = dataclasses.replace(walker, name="walk again")
    whole = document((compare(walker, ("ekf",)), compare(other, ("ekf",))), "factorlab compare two")
    assert set(whole["runs"]) == {"walk", "walk again"}
    assert whole["runs"]["walk"]["estimators"]["ekf"]["rmse_m"] > 0
    assert "estimators" not in whole


def test_progress_counts_every_step(walker):
    seen = []
    compare(walker, ("ekf", "ieks"), tune=True, progress=lambda *told: seen.append(told[1:]))
    assert seen == [(k, 6) for k in range(6)]


def test_there_must_be_something_to_tune(walker):
    with pytest.raises(ModelError, match="nothing to tune"):
        compare(dataclasses.replace(walker, knobs=()), ("ekf",), tune=True)


PROCESSES = [
    (sq.RandomWalk(0.1), sq.Vector(2), lambda p: p.density),
    (sq.ConstantVelocity(0.1, axes=1), sq.Vector(2), lambda p: p.acceleration_density),
    (sq.Process(lambda x, dt: x + 0.0 * dt, 0.1), sq.Vector(2), lambda p: p.noise_density),
    (sq.Unicycle(0.1, 0.1, 0.1), sq.SE2(), lambda p: p.along**2),
]


@pytest.mark.parametrize(("process", "manifold", "variance"), PROCESSES)
def test_noise_is_scaled_by_standard_deviations(process, manifold, variance):
    sensor = sq.Sensor(lambda x: x[0], 0.25)
    prior = sq.Gaussian([0.0] * manifold.size, [1.0] * manifold.dim)
    speed = None if manifold.size == 2 else "speed"
    model = sq.StateSpace(manifold, prior, process, {"sight": sensor}, speed)
    assert [knob.name for knob in noise_knobs(model)] == ["process σ", "sight σ"]
    wider = scaled(model, {"process σ": 3.0, "sight σ": 2.0})
    np.testing.assert_allclose(wider.sensors["sight"].noise_cov, 4.0 * sensor.noise_cov)
    np.testing.assert_allclose(variance(wider.process), 9.0 * np.asarray(variance(process)))


def test_a_map_needs_a_position(walker):
    assert has_position(walker)
    swing = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 0.0], [1.0, 1.0]),
        sq.RandomWalk(0.1),
        {"a": sq.LinearSensor([[1.0, 0.0]], 1.0)},
    )
    log = sq.SensorLog({"a": sq.Stream(np.arange(20) * 0.1, np.zeros(20))})
    pendulum = dataclasses.replace(walker, model=swing, log=log, truth=None, knobs=())
    assert not has_position(pendulum)
    assert compare(pendulum, ("ekf", "ieks")).rows[0].rmse is None
    assert prepare(swing, log).t[0] == 0


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1.0, "1.00"), (-0.0849, "−0.0849"), (12345.6, "12346"), (1.5e-5, "1.50e-05"), (None, "–")],
)
def test_numbers_have_three_digits(value, text):
    assert figure(value) == text
    assert band((1.0, 2.5)) == "1.00 – 2.50"
    assert band((-1.0, 2.5)) == "−1.00 to 2.50"


def test_every_cell_has_a_heading(walker):
    table = compare(walker, ("ekf", "ieks"))
    assert {len(cells(row)) for row in table.rows} == {len(headings(table))}
    assert "factor of" in headline(table)
