"""The compiled charts give what the NumPy manifolds give, on every manifold, up to the edge of the chart."""

import numpy as np
import pytest
from laws import ANGLES, EVERY_MANIFOLD, step_of_angle

every_manifold = pytest.mark.parametrize("manifold", EVERY_MANIFOLD, ids=repr)
PAD = 3  # states are read and written at offsets


@pytest.fixture(scope="module")
def charts():
    from sequential.kernels import charts

    return charts


def shifted(values):
    return np.concatenate([np.full(PAD, 7.0), values])


@every_manifold
@pytest.mark.parametrize("angle", ANGLES)
def test_retract(charts, manifold, angle, rng):
    x, xi = manifold.random(rng), step_of_angle(manifold, rng, angle)
    table, out = manifold.table(), np.zeros(PAD + manifold.size)
    charts.retract(table, 0, len(table), shifted(x), PAD, shifted(xi), PAD, out, PAD)
    expected = manifold.retract(x, xi)
    # a compiled quaternion may come out with either sign
    assert np.abs(manifold.local(expected, manifold.normalize(out[PAD:]))).max() < 1e-13
    assert not out[:PAD].any()


@every_manifold
def test_retract_in_place(charts, manifold, rng):
    x, xi = manifold.random(rng), manifold.local(manifold.identity(), manifold.random(rng))
    table, moved = manifold.table(), x.copy()
    charts.retract(table, 0, len(table), moved, 0, xi, 0, moved, 0)
    assert np.abs(manifold.local(manifold.retract(x, xi), manifold.normalize(moved))).max() < 1e-13


@every_manifold
@pytest.mark.parametrize("angle", ANGLES)
def test_local(charts, manifold, angle, rng):
    x = manifold.random(rng)
    y = manifold.retract(x, step_of_angle(manifold, rng, angle))
    table, out = manifold.table(), np.zeros(PAD + manifold.dim)
    charts.local(table, 0, len(table), shifted(x), PAD, shifted(y), PAD, out, PAD)
    np.testing.assert_allclose(out[PAD:], manifold.local(x, y), rtol=1e-12, atol=1e-13)


@every_manifold
@pytest.mark.parametrize("angle", ANGLES[:-2])
def test_transport(charts, manifold, angle, rng):
    x = manifold.random(rng)
    y = manifold.retract(x, step_of_angle(manifold, rng, angle))
    d, table = manifold.dim, manifold.table()
    e, turn, inverse = np.zeros(d), np.ones((d, d)), np.ones((d, d))
    charts.transport(table, len(table), d, shifted(x), PAD, shifted(y), PAD, e, turn, inverse)
    carried, jacobian = manifold.transport(x, y)
    np.testing.assert_allclose(e, manifold.local(x, y), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(turn, carried, rtol=0, atol=1e-9)
    np.testing.assert_allclose(inverse, jacobian, rtol=0, atol=1e-9)


@every_manifold
def test_a_range_of_blocks_leaves_the_others_alone(charts, manifold, rng):
    table, x, y = manifold.table(), manifold.random(rng), manifold.random(rng)
    out = np.full(manifold.dim, np.nan)
    charts.local(table, 1, len(table), x, 0, y, 0, out, 0)
    first = table[0, 4]
    assert np.isnan(out[:first]).all()
    np.testing.assert_allclose(out[first:], manifold.local(x, y)[first:], rtol=1e-12, atol=1e-13)
