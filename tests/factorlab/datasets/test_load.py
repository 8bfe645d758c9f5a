"""What every dataset has in common: names, positions in the world frame, a truth at other times."""

from dataclasses import replace

import numpy as np
import pytest

from factorlab.datasets import NAMES, Truth, load
from sequential import SE2, SE3, NavState, Product, Report, Run, Vector, inertial_state
from sequential.errors import DataError, ModelError, ShapeError
from sequential.jacobians import difference


def test_names():
    assert NAMES == ("kitti", "plaza1", "plaza2", "mrclam", "rail", "starry_night")


@pytest.mark.parametrize(("name", "hint"), [("kiti", "kitti"), ("plaza", "plaza"), ("mrclam7", "mrclam")])
def test_an_unknown_name_is_a_sentence(name, hint):
    with pytest.raises(DataError, match=rf"no dataset '{name}'.*did you mean '{hint}"):
        load(name)


def test_a_name_like_no_other_lists_them_all():
    with pytest.raises(DataError, match=r"only kitti, plaza1, plaza2, mrclam, rail, starry_night$"):
        load("zzz")


STATES = [
    (inertial_state(), 3),
    (NavState(), 3),
    (SE3(), 3),
    (SE2(), 2),
    (Product(speed=Vector(1), pose=SE2(), bias=Vector(4)), 2),
    (Product(clock=Vector(1), body=SE3()), 3),
    (Vector(4), 2),
    (Vector(6), 3),
]


@pytest.fixture(scope="module")
def kitti():
    (dataset,) = load("kitti")
    return dataset


@pytest.mark.parametrize(("manifold", "axes"), STATES, ids=str)
def test_position_cov_is_that_of_the_positions(kitti, manifold, axes, rng):
    """J P Jᵀ, with J from central differences of the positions themselves."""
    dataset, d = replace(kitti, axes=axes), manifold.dim
    mean = manifold.random(rng, shape=(5,))
    root = rng.standard_normal((5, d, d))
    cov = root @ np.swapaxes(root, 1, 2)
    run = _run(manifold, mean, cov)
    place = Vector(axes)
    expected = []
    for x, p in zip(mean, cov, strict=True):
        J = difference(lambda at: dataset.positions(_run(manifold, at[None], cov[:1]))[0], x, manifold, place)
        expected.append(J @ p @ J.T)
    np.testing.assert_allclose(dataset.position_cov(run), expected, rtol=1e-7, atol=1e-7)


def _run(manifold, mean, cov):
    return Run(np.arange(len(mean)), np.array(mean), np.array(cov), manifold, {}, 0.0, Report("made up"))


def test_a_state_without_a_position_is_refused(kitti):
    run = _run(Vector(1), np.zeros((1, 1)), np.ones((1, 1, 1)))
    with pytest.raises(ModelError, match="no part that holds a position of 3 axes"):
        kitti.positions(run)


class TestTruth:
    def test_between_samples_it_is_interpolated(self):
        truth = Truth(np.array([0, 10**9]), np.array([[0.0, 0.0], [2.0, 4.0]]), np.array([3.1, -3.1]))
        rows, there = truth.at(np.array([0.25, 1.0]))
        np.testing.assert_array_equal(rows, [0, 1])
        np.testing.assert_allclose(there.position, [[0.5, 1.0], [2.0, 4.0]])
        # the short way round
        np.testing.assert_allclose(there.heading[0], 3.1 + 0.25 * (2 * np.pi - 6.2))

    def test_quaternions_take_the_short_way(self):
        half = np.sqrt(0.5)
        turn = np.array([[1.0, 0, 0, 0], [-half, 0, 0, -half]])
        _, there = Truth(np.array([0, 10**9]), np.zeros((2, 3)), quaternion=turn).at(np.array([0.5]))
        np.testing.assert_allclose(there.quaternion, [[np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)]])

    def test_outside_and_in_a_gap_there_is_none(self):
        t = np.array([0, 1, 2, 9, 10]) * 10**9
        truth = Truth(t, np.zeros((5, 2)), max_gap=1.0)
        rows, there = truth.at(np.array([-0.1, 0.0, 1.5, 3.0, 3.5, 8.0, 10.1]))
        np.testing.assert_array_equal(rows, [1, 2, 3, 5])
        assert len(there) == 4

    def test_rows_must_agree(self):
        with pytest.raises(ShapeError, match="2 stamps and 3 rows of position"):
            Truth(np.array([0, 1]), np.zeros((3, 2)))

    def test_one_sample_is_too_few(self):
        with pytest.raises(DataError, match="two samples"):
            Truth(np.array([0]), np.zeros((1, 2))).at(np.array([0.0]))
