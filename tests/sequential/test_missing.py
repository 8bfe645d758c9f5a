"""NaN in a sensor's stream: components and readings that are missing, in every estimator."""

import numpy as np
import pytest

import sequential as sq
from factorlab.graph.batch import BatchGraph
from sequential.errors import FileFormatError, NotFiniteError, NotPositiveDefiniteError, ShapeError
from sequential.evaluate import nis_summary, whiteness
from sequential.readers import read_log, write_log

ESTIMATORS = {
    "kf": sq.KalmanFilter(),
    "ekf": sq.ExtendedKalmanFilter(),
    "iekf": sq.IteratedExtendedKalmanFilter(),
    "ukf": sq.UnscentedKalmanFilter(),
    "rts": sq.RauchTungStriebel(sq.KalmanFilter(keep=True)),
    "ieks": sq.IteratedSmoother(),
    "fixed lag": sq.FixedLagSmoother(lag=1.0),
    "batch": BatchGraph(),
}
N = 60


def world(noise, names, rng):
    """Two axes of constant velocity; sensor "both" reads the two positions, or each has its own."""
    matrix = np.eye(4)[:2]
    sensors = {
        name: sq.LinearSensor(matrix[pick], np.asarray(noise)[np.ix_(pick, pick)])
        for name, pick in names.items()
    }
    prior = sq.Gaussian(np.zeros(4), np.eye(4))
    return sq.StateSpace(sq.Vector(4), prior, sq.ConstantVelocity(0.5, axes=2), sensors)


def holes(rng):
    z = rng.normal(size=(N, 2)).cumsum(axis=0)
    z[rng.random((N, 2)) < 0.4] = np.nan
    z[7] = np.nan
    return 0.1 * np.arange(N), z


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_partial_reading_says_what_its_components_say(name, rng):
    t, z = holes(rng)
    # components of correlated noise, one at a time or together: three sensors say the same as one with holes
    noise = [[0.3, 0.2], [0.2, 0.4]]
    apart = {
        "both": np.isfinite(z).all(axis=1),
        "first": np.isfinite(z[:, 0]) & np.isnan(z[:, 1]),
        "second": np.isnan(z[:, 0]) & np.isfinite(z[:, 1]),
    }
    columns = {"both": [0, 1], "first": [0], "second": [1]}
    split = sq.SensorLog({k: sq.Stream(t[apart[k]], z[apart[k]][:, columns[k]]) for k in columns})
    whole = sq.SensorLog({"both": sq.Stream(t, z)})
    estimator = ESTIMATORS[name]
    one = sq.run(estimator, world(noise, {"both": [0, 1]}, rng), whole, at=t)
    three = sq.run(estimator, world(noise, columns, rng), split, at=t)
    np.testing.assert_allclose(one.mean, three.mean, atol=1e-9)
    np.testing.assert_allclose(one.cov, three.cov, atol=1e-9)
    if np.isfinite(one.log_likelihood):
        assert one.log_likelihood == pytest.approx(three.log_likelihood, abs=1e-9)
    both = one.innovations["both"]
    np.testing.assert_array_equal(np.isnan(both.residual), np.isnan(z[both.row]))
    assert both.nis().sum() == pytest.approx(sum(i.nis().sum() for i in three.innovations.values()), abs=1e-7)
    assert one.report.missing == np.isnan(z).all(axis=1).sum() >= 1


def test_a_reading_may_bring_its_own_noise(rng):
    t, z = 0.1 * np.arange(N), rng.normal(size=(N, 2))
    loud = np.arange(N) % 3 == 0
    covs = np.where(loud[:, None, None], 9.0, 0.25) * np.eye(2)
    model = world(0.25 * np.eye(2), {"both": [0, 1]}, rng)
    own = sq.run(sq.KalmanFilter(), model, sq.SensorLog({"both": sq.Stream(t, z, noise_cov=covs)}))
    two = {"quiet": sq.LinearSensor(np.eye(4)[:2], 0.25), "loud": sq.LinearSensor(np.eye(4)[:2], 9.0)}
    model = sq.StateSpace(sq.Vector(4), sq.Gaussian(np.zeros(4), np.eye(4)), model.process, two)
    log = sq.SensorLog({"quiet": sq.Stream(t[~loud], z[~loud]), "loud": sq.Stream(t[loud], z[loud])})
    apart = sq.run(sq.KalmanFilter(), model, log)
    np.testing.assert_allclose(own.mean, apart.mean, atol=1e-12)
    np.testing.assert_allclose(own.cov, apart.cov, atol=1e-12)
    assert own.log_likelihood == pytest.approx(apart.log_likelihood)


def test_consistency_of_partial_readings_is_judged_with_their_own_freedom(rng):
    model = world(0.3 * np.eye(2), {"both": [0, 1]}, rng)
    log = sq.simulate(model, 0.1 * np.arange(1500), rng).log
    z = log["both"].values.copy()
    z[rng.random(z.shape) < 0.4] = np.nan
    run = sq.run(sq.KalmanFilter(), model, sq.SensorLog({"both": sq.Stream(log["both"].t, z)}))
    summary = nis_summary(run.innovations["both"])
    assert summary.inside_band
    assert summary.tail_share == pytest.approx(0.05, abs=0.02)
    assert set(run.innovations["both"].dof()) == {1, 2}
    assert whiteness(run.innovations["both"]).verdict == "white"


def test_the_gate_of_a_partial_reading_is_that_of_its_components(rng):
    model = world(np.eye(2), {"both": [0, 1]}, rng)
    sensor = sq.LinearSensor(np.eye(4)[:2], np.eye(2), gate=0.99)
    model = sq.StateSpace(sq.Vector(4), model.prior, model.process, {"both": sensor})
    # S = 2 at the prior; NIS = 7.2 is beyond 6.63 (one component, 99 %), within 9.21 (two)
    far = np.sqrt(7.2 * 2.0)
    for z, taken in (([far, np.nan], False), ([far, 0.0], True)):
        run = sq.run(sq.KalmanFilter(), model, sq.SensorLog({"both": sq.Stream([0.0], [z])}))
        assert run.innovations["both"].accepted.tolist() == [taken]


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_missing_values_survive_a_file(ending, tmp_path, rng):
    t, z = holes(rng)
    path = tmp_path / f"drive.{ending}"
    write_log(path, sq.SensorLog({"both": sq.Stream(t, z)}))
    np.testing.assert_array_equal(read_log(path)["both"].values, z)


def test_covariances_of_readings_are_kept_by_an_archive_and_not_lost_by_a_csv(tmp_path):
    log = sq.SensorLog({"gps": sq.Stream([0.0, 1.0], [[1.0, 2.0]] * 2, noise_cov=[[1.0, 2.0], [3.0, 4.0]])})
    write_log(tmp_path / "drive.npz", log)
    np.testing.assert_array_equal(read_log(tmp_path / "drive.npz")["gps"].noise_cov, log["gps"].noise_cov)
    with pytest.raises(FileFormatError, match=r"no place for the noise_cov of 'gps'; write the log as \.npz"):
        write_log(tmp_path / "drive.csv", log)
    assert not (tmp_path / "drive.csv").exists()


def test_what_cannot_be_missing_says_so(rng):
    gyro = sq.Stream([0.0, 1.0, 2.0], [[1.0], [np.nan], [1.0]])
    process = sq.Process(lambda x, u, dt: x + u * dt, noise_density=1.0, inputs=1)
    model = sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], [[1.0]]), process, {"z": sq.LinearSensor([[1.0]], 1.0)}, input="gyro"
    )
    log = sq.SensorLog({"gyro": gyro, "z": sq.Stream([1.0, 2.0], [0.0, 1.0])})
    with pytest.raises(NotFiniteError, match=r"log\['gyro'\] drives the process and holds NaN at sample 1"):
        sq.run(sq.ExtendedKalmanFilter(), model, log)
    with pytest.raises(ShapeError, match=r"need noise_cov of shape \(2, m, m\), got \(3,\)"):
        sq.Stream([0.0, 1.0], [0.0, 1.0], noise_cov=[1.0, 1.0, 1.0])
    with pytest.raises(NotPositiveDefiniteError, match="noise_cov of reading 1 "):
        sq.Stream([0.0, 1.0], [0.0, 1.0], noise_cov=[[1.0], [-1.0]])
