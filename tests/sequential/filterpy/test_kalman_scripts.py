"""Linear scripts give FilterPy's numbers in every attribute, after every line."""

import copy

import numpy as np
import pytest
from filterpy_scripts import assert_equal, common, run_both, tracker

import sequential as sq

shapes = pytest.mark.parametrize("column", [True, False], ids=["column", "flat"])


def readings(count, m, rng):
    return np.cumsum(rng.standard_normal((count, m)), axis=0)


@shapes
@pytest.mark.parametrize("axes", [1, 2, 3])
def test_predict_and_update(column, axes, rng):
    zs = readings(30, axes, rng)

    def script(kf):
        for z in zs:
            kf.predict()
            yield
            kf.update(z[:, None] if column else z)
            yield kf.log_likelihood, kf.likelihood, kf.mahalanobis

    run_both(lambda: tracker(column, axes), script)


@shapes
def test_numbers_for_matrices(column, rng):
    def make():
        kf = tracker(column)
        kf.P *= 10
        kf.P[1, 1] = 3.0
        kf.R = np.array([[5.0]])
        kf.alpha = 1.02
        return kf

    def script(kf):
        for z in readings(20, 1, rng):
            kf.predict(Q=0.2)
            kf.update(z.item(), R=2.0)
            kf.R[0, 0] *= 1.1
            kf.P *= 1.01
            yield kf.alpha

    seed = rng.bit_generator.state
    theirs = make()
    ours = sq.from_filterpy(make())
    for filter_ in (theirs, ours):
        rng.bit_generator.state = seed
        for _ in script(filter_):
            pass
    assert_equal([theirs.x, theirs.P, theirs.K], [ours.x, ours.P, ours.K], "end", 1e-9)


@shapes
def test_inputs_and_matrices_of_one_step(column, rng):
    zs, us = readings(20, 2, rng), rng.standard_normal((20, 2))
    turned = np.array([[1.0, 0.2], [0.3, 1.0]])

    def make():
        kf = tracker(column, 2)
        kf.B = np.array([[0.1, 0], [0.5, 0], [0, 0.1], [0, 0.5]])
        return kf

    def script(kf):
        for z, u in zip(zs, us, strict=True):
            shaped = (z[:, None], u[:, None]) if column else (z, u)
            kf.predict(u=shaped[1], F=kf.F * 0.99, Q=kf.Q * 2)
            yield kf.get_prediction(u=shaped[1]), kf.residual_of(shaped[0])
            yield kf.get_update(shaped[0]), kf.measurement_of_state(kf.x)
            kf.update(shaped[0], R=0.1 * turned @ turned.T, H=turned @ kf.H)
            yield kf.log_likelihood_of(shaped[0])
            kf.predict()
            yield kf.get_prediction()

    run_both(make, script)


def test_a_missing_reading(rng):
    def script(kf):
        for k, z in enumerate(zs):
            kf.predict()
            kf.update(None if k % 3 == 0 else z)
            yield

    zs = readings(20, 1, rng)
    unsaid = ("log_likelihood", "likelihood")  # FilterPy's is the density of an innovation of zero
    _, ours = run_both(tracker, script, except_for=unsaid)
    ours.update(None)
    assert ours.log_likelihood == 0.0
    assert ours.likelihood == 1.0
    assert ours.mahalanobis == 0.0
    assert ours.z.tolist() == [[None]]


@shapes
@pytest.mark.parametrize("update_first", [False, True])
@pytest.mark.parametrize("tables", [(), ("Fs", "Qs", "Hs", "Rs"), ("Bs", "us")], ids=str)
def test_batch_filter_and_smoother(column, update_first, tables, rng):
    count = 25
    zs = [None if k == 7 else z[:, None] if column else z for k, z in enumerate(readings(count, 2, rng))]
    varying = 1.0 + 0.3 * rng.random(count)
    inputs = rng.standard_normal((count, 1, 1) if column else (count, 1))

    def script(kf):
        all_tables = {
            "Fs": [kf.F * v**0.1 for v in varying],
            "Qs": [kf.Q * v for v in varying],
            "Hs": [kf.H * v for v in varying],
            "Rs": [kf.R * v for v in varying],
            "Bs": [0.1 * np.ones((4, 1))] * count,
            "us": list(inputs),
        }
        chosen = {name: all_tables[name] for name in tables}
        saver = common.Saver(kf)
        out = kf.batch_filter(zs, update_first=update_first, saver=saver, **chosen)
        yield out
        yield [saver.x, saver.P, saver.K, saver.x_prior, saver["P_post"]]
        smoothing = {name: chosen[name] for name in ("Fs", "Qs") if name in chosen}
        yield kf.rts_smoother(out[0], out[1], **smoothing)
        if not update_first:
            yield kf.rts_smoother(*out[:2], Fs=[kf.F] * count, Qs=[kf.Q] * count, inv=np.linalg.pinv)

    run_both(lambda: tracker(column, 2), script)


@shapes
def test_the_steady_state(column, rng):
    zs = readings(60, 2, rng)

    def script(kf):
        for k, z in enumerate(zs):
            shaped = z[:, None] if column else z
            if k < 40:
                kf.predict()
                kf.update(shaped)
            else:
                kf.predict_steadystate()
                kf.update_steadystate(shaped if k % 5 else None)
            yield

    run_both(lambda: tracker(column, 2), script, except_for=("log_likelihood", "likelihood", "mahalanobis"))


@shapes
def test_components_one_after_the_other(column, rng):
    zs = readings(30, 3, rng)

    def make():
        kf = tracker(True, 3)
        kf.H[0, 2] = 0.3
        return kf

    def script(kf):
        for z in zs:
            kf.predict()
            kf.update_sequential(0, z[0])
            kf.update_sequential(1, z[1:])
            yield
            kf.update_sequential(1, z[1], R_i=0.7, H_i=kf.H[2])
            yield

    if column:
        theirs, ours = run_both(make, script)
        assert_equal(theirs.z.astype(float), ours.z.astype(float), "z", 1e-12)
        return
    # FilterPy cannot do it with a flat state; the numbers are those of one joint update
    kf = make()
    kf.x = kf.x.ravel()
    joint, apart = sq.from_filterpy(kf), sq.from_filterpy(kf)
    for z in zs:
        joint.predict()
        apart.predict()
        joint.update(z)
        for i in range(3):
            apart.update_sequential(i, z[i])
        assert_equal([joint.x, joint.P], [apart.x, apart.P], "sequential", 1e-10)


@shapes
def test_correlated_noise(column, rng):
    zs = readings(30, 2, rng)

    def make():
        kf = tracker(column, 2)
        kf.M = 0.02 * np.array([[1.0, 0.5], [0.3, 0], [0, 0.2], [0.1, 1.0]])
        return kf

    def script(kf):
        for k, z in enumerate(zs):
            kf.predict()
            kf.update_correlated((z[:, None] if column else z) if k != 5 else None)
            yield

    run_both(make, script, except_for=("log_likelihood", "likelihood"))


def test_correlated_noise_without_correlation_is_an_update(rng):
    ours = sq.from_filterpy(tracker(True, 2))
    other = copy.deepcopy(ours)
    for z in readings(20, 2, rng):
        for kf, update in ((ours, ours.update), (other, other.update_correlated)):
            kf.predict()
            update(z)
        assert_equal([ours.x, ours.P], [other.x, other.P], "update", 1e-11)


def test_the_inverse_of_a_script_is_used(rng):
    calls = []

    def inverse(matrix):
        calls.append(matrix.shape)
        return np.linalg.pinv(matrix)

    def make():
        kf = tracker(True, 2)
        kf.inv = inverse
        return kf

    def script(kf):
        for z in readings(3, 2, rng):
            kf.predict()
            kf.update(z[:, None])
            yield

    theirs, ours = make(), sq.from_filterpy(make())
    list(script(theirs))
    asked = len(calls)
    list(script(ours))
    assert len(calls) == 2 * asked == 6
    assert ours.inv is theirs.inv


def test_saver_takes_every_attribute(rng):
    kf = sq.from_filterpy(tracker(True, 2))
    saver = common.Saver(kf, save_current=True)
    for z in readings(10, 2, rng):
        kf.predict()
        kf.update(z)
        saver.save()
    saver.to_array()
    assert saver.x.shape == (11, 4, 1)
    assert saver.log_likelihood.shape == (11,)
    assert {"x", "P", "F", "H", "Q", "R", "K", "S", "SI", "y", "z", "mahalanobis", "alpha"} <= set(saver.keys)
    saver.flatten()
    assert saver.x.shape == (11, 4)
