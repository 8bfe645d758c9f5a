"""Which landmark a reading is of."""

from itertools import product

import numpy as np
import pytest
from slam_worlds import loops

from sequential.errors import DataError, ModelError
from sequential.evaluate.consistency import chi2_quantile
from sequential.slam import EkfSlam
from sequential.slam.association import NEW, REJECTED, Association, Pairings, with_associations


def right(found, ids):
    """Share of readings whose landmark is the one that most readings of that landmark are of."""
    good = 0
    for landmark in np.unique(found[found >= 0]):
        good += np.bincount(ids[found == landmark]).max()
    return good / len(ids)


@pytest.mark.parametrize("method", ["nearest", "joint"])
def test_hidden_ids_are_found_again(rng, method):
    world = loops(rng, steps=80, turns=1.5, landmarks=15, unknown=True)
    run = EkfSlam("invariant", Association(method)).solve(world.problem)
    assert right(run.associations, world.ids) > {"nearest": 0.9, "joint": 0.97}[method]
    assert abs(len(run.values.index["l"]) - len(np.unique(world.ids))) <= 1


def test_the_found_ids_make_a_problem_for_a_graph(rng):
    world = loops(rng, steps=30, turns=0.5, unknown=True)
    run = EkfSlam("invariant").solve(world.problem)
    known = with_associations(world.problem, run)
    again = EkfSlam("invariant").solve(known)
    np.testing.assert_allclose(again.values.rows["x"], run.values.rows["x"], atol=1e-9)
    assert again.associations is None
    with pytest.raises(DataError, match="no associations"):
        with_associations(known, again)


def candidates(rng, readings=3, landmarks=4):
    """Points of the plane, seen from a place that is not well known, so that errors go together."""
    places = 3.0 * rng.standard_normal((landmarks, 2))
    cov = np.eye(2 + 2 * landmarks) * 0.01
    cov[:2, :2] += 0.5
    seen = places[rng.permutation(landmarks)[:readings]] + rng.standard_normal(2) * 0.7
    seen += 0.05 * rng.standard_normal(seen.shape)
    jacobian = np.tile(np.hstack([-np.eye(2), np.eye(2)]), (readings, landmarks, 1, 1))
    columns = np.stack([[0, 1, 2 + 2 * j, 3 + 2 * j] for j in range(landmarks)])
    return Pairings(
        places[None] - seen[:, None],
        jacobian,
        np.tile(columns, (readings, 1, 1)),
        np.tile(0.01 * np.eye(2), (readings, 1, 1)),
        cov,
    )


@pytest.mark.parametrize("seed", range(5))
def test_joint_compatibility_finds_what_trying_everything_finds(seed):
    found = candidates(np.random.default_rng(seed))
    rule = Association("joint", gate=0.95, new=0.999)
    best = (0, 0.0, {})
    for choice in product(range(-1, 4), repeat=3):
        pairs = [(n, j) for n, j in enumerate(choice) if j >= 0]
        distinct = len({j for _, j in pairs}) == len(pairs)
        if not pairs or not distinct or any(found.squared()[pair] > chi2_quantile(0.95, 2) for pair in pairs):
            continue
        prefixes = [
            found.joint(pairs[: size + 1]) <= chi2_quantile(0.95, 2 * size + 2) for size in range(len(pairs))
        ]
        if all(prefixes) and (-len(pairs), found.joint(pairs)) < (-best[0], best[1]):
            best = len(pairs), found.joint(pairs), dict(pairs)
    chosen = rule.choose(found)
    assert {n: int(j) for n, j in enumerate(chosen) if j >= 0} == best[2]


def test_one_pairing_is_as_far_together_as_alone(rng):
    found = candidates(rng)
    for pair in product(range(3), range(4)):
        assert found.joint([pair]) == pytest.approx(found.squared()[pair], rel=1e-9)


def test_between_the_gates_nothing_is_begun():
    cov, noise = np.eye(4) * 0.5, np.zeros((1, 2, 2)) + 1e-9 * np.eye(2)
    for distance, expected in ((0.5, 0), (3.5, REJECTED), (9.0, NEW)):
        one = Pairings(
            np.array([[[distance, 0.0]]]),
            np.hstack([-np.eye(2), np.eye(2)])[None, None],
            np.arange(4)[None, None],
            noise,
            cov,
        )
        assert Association().choose(one)[0] == expected


def test_two_readings_of_one_step_are_of_two_landmarks():
    """What is near a landmark that another reading is of, and far from all others, is a new one."""
    error = np.array([[[0.1, 0.0]], [[2.0, 0.0]]])
    jacobian = np.tile(np.hstack([-np.eye(2), np.eye(2)]), (2, 1, 1, 1))
    noise = np.tile(1e-4 * np.eye(2), (2, 1, 1))
    two = Pairings(error, jacobian, np.tile(np.arange(4), (2, 1, 1)), noise, 0.5 * np.eye(4))
    for method in ("nearest", "joint"):
        np.testing.assert_array_equal(Association(method).choose(two), [0, NEW])


def test_settings_are_checked():
    with pytest.raises(ModelError, match="quantiles 0 < gate <= new < 1"):
        Association(gate=0.9, new=0.5)
    with pytest.raises(ModelError, match="nearest, joint"):
        Association("hungarian")
