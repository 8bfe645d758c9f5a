"""Every manifold keeps the laws, and refuses what is not a state of it."""

import pickle

import numpy as np
import pytest
from laws import EVERY_MANIFOLD, assert_manifold_laws

from sequential.errors import DataError, NotFiniteError, ShapeError
from sequential.manifold import SE3, Block, Kind, Manifold, NavState, Vector

every_manifold = pytest.mark.parametrize("manifold", EVERY_MANIFOLD, ids=repr)


@every_manifold
def test_manifold_laws(manifold, rng):
    assert_manifold_laws(manifold, rng)


@every_manifold
def test_the_family_covers_the_interface(manifold):
    assert isinstance(manifold, Manifold)
    assert all(isinstance(block, Block) for block in manifold.blocks())


def test_every_kind_has_a_member():
    assert {block.kind for manifold in EVERY_MANIFOLD for block in manifold.blocks()} == set(Kind)


@every_manifold
def test_manifolds_are_values(manifold):
    twin = pickle.loads(pickle.dumps(manifold))  # noqa: S301 - our own bytes
    assert twin == manifold
    assert hash(twin) == hash(manifold)
    assert sum(other == manifold for other in EVERY_MANIFOLD) == 1


@every_manifold
def test_random_scale_is_the_spread_of_the_step(manifold, rng):
    x = manifold.random(rng, scale=1e-3, shape=(4000,))
    steps = manifold.local(manifold.identity(), x)
    np.testing.assert_allclose(steps.std(axis=0), 1e-3, rtol=0.08)


@every_manifold
def test_wrong_length_is_refused(manifold):
    for wrong in (np.zeros(manifold.size + 1), np.zeros((3, manifold.size - 1)), np.float64(1.0)):
        with pytest.raises(ShapeError, match=rf"shape \(\.\.\., {manifold.size}\), got"):
            manifold.check(wrong)


@every_manifold
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_finite_is_refused(manifold, bad, rng):
    x = manifold.random(rng, shape=(6,))
    x[4, -1] = bad
    with pytest.raises(NotFiniteError, match=rf"index \[4, {manifold.size - 1}\]"):
        manifold.check(x)


def test_text_is_refused():
    with pytest.raises(DataError, match="array of 2 numbers"):
        Vector(2).check(["north", "east"])


def test_quaternion_off_unit_is_refused():
    x = NavState().identity()
    x[0] = 1.0 + 0.5e-6
    NavState().check(x)
    x[0] = 1.0 - 2e-6
    with pytest.raises(DataError, match=r"components 0:4 .* norm 0\.999998"):
        NavState().check(x)


def test_check_accepts_an_empty_history():
    SE3().check(np.zeros((0, 7)))


def test_empty_vector_is_refused():
    with pytest.raises(ShapeError, match="n = 0"):
        Vector(0)
