"""Variables begin in the order in which measurements determine them, and where they belong."""

import numpy as np
import pytest
from planar_worlds import camera_tour, mounted_camera

from sequential.manifold import SE2, SE3, Vector
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.determined import Several
from sequential.slam.models import Between, LandmarkBearing, LandmarkRange, Projection
from sequential.slam.placing import Placing, place_all


def walk(count, index=None):
    index = np.column_stack([np.arange(count - 1), np.arange(1, count)]) if index is None else index
    return Factors(Between(SE2()), ("x", "x"), index, np.tile([1.0, 0.0, 0.1], (len(index), 1)), 1e-2)


def begun_at(x):
    return Values({"x": np.arange(len(x))}, {"x": np.array(x, dtype=np.float64)})


def ranges(x, place, rows=None):
    index = np.column_stack([np.arange(len(x)), np.zeros(len(x), dtype=int)])
    z = np.linalg.norm(np.asarray(place) - np.asarray(x)[:, :2], axis=1)
    return Factors(LandmarkRange(), ("x", "l"), index, z, 1e-4)


def test_poses_follow_one_another():
    problem = SlamProblem({"x": SE2()}, (walk(5),), start=begun_at([[0.0, 0.0, 0.0]]))
    placing = place_all(problem)
    x = placing.values().rows["x"]
    assert len(x) == 5
    assert not placing.waiting
    np.testing.assert_allclose(
        Between(SE2()).expected(x[:-1], x[1:]), np.tile([1.0, 0.0, 0.1], (4, 1)), atol=1e-12
    )


def test_each_step_says_what_begins_and_what_is_ready():
    problem = SlamProblem({"x": SE2()}, (walk(3),), start=begun_at([[0.0, 0.0, 0.0]]))
    placing = Placing(problem)
    assert placing.step(0).ready == ()
    first = placing.step(1)
    assert set(first.begun) == {("x", 0), ("x", 1)}
    assert first.ready == ((0, 0),)


def test_a_correction_carries_on():
    problem = SlamProblem({"x": SE2()}, (walk(3),), start=begun_at([[0.0, 0.0, 0.0]]))
    placing = Placing(problem)
    placing.step(0), placing.step(1)
    placing.correct("x", 1, np.array([5.0, 5.0, 0.0]))
    placing.step(2)
    np.testing.assert_allclose(placing.at("x", 2), [6.0, 5.0, 0.1], atol=1e-12)


def test_what_nothing_determines_waits_and_is_counted():
    here = [[0.0, 0.0, 0.0]]
    problem = SlamProblem({"x": SE2(), "l": Vector(2)}, (ranges(here, [2.0, 3.0]),), start=begun_at(here))
    placing = place_all(problem)
    assert placing.waiting == {("l", 0): 1}
    assert "l" not in placing.values().index


def test_a_pose_is_found_backwards_too():
    problem = SlamProblem({"x": SE2()}, (walk(2, np.array([[1, 0]])),), start=begun_at(np.zeros((1, 3))))
    back = place_all(problem).values().at("x", np.array([1]))
    np.testing.assert_allclose(Between(SE2()).expected(back, np.zeros((1, 3))), [[1.0, 0.0, 0.1]], atol=1e-12)


def test_ranges_along_a_line_leave_two_places_until_the_path_turns():
    straight = np.column_stack([np.arange(6.0), np.zeros(6), np.zeros(6)])
    problem = SlamProblem(
        {"x": SE2(), "l": Vector(2)}, (ranges(straight, [2.0, 3.0]),), start=begun_at(straight)
    )
    assert ("l", 0) in place_all(problem).waiting
    turned = np.concatenate([straight, [[6.0, 1.0, 0.0], [6.0, 2.0, 0.0]]])
    problem = SlamProblem({"x": SE2(), "l": Vector(2)}, (ranges(turned, [2.0, 3.0]),), start=begun_at(turned))
    placed = place_all(problem)
    assert not placed.waiting
    np.testing.assert_allclose(placed.values().at("l", np.array([0])), [[2.0, 3.0]], atol=1e-6)


def test_older_measurements_become_ready_with_the_variable():
    turned = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    problem = SlamProblem({"x": SE2(), "l": Vector(2)}, (ranges(turned, [4.0, 3.0]),), start=begun_at(turned))
    placing = Placing(problem)
    arrived = [placing.step(k) for k in range(4)]
    when = next(k for k, a in enumerate(arrived) if ("l", 0) in a.begun)
    assert when >= 2
    assert sorted(arrived[when].ready) == [(0, row) for row in range(when + 1)]


def test_points_of_one_camera_begin_by_parallax(rng):
    world = camera_tour(rng)
    placed = place_all(world.problem)
    found = placed.values()
    assert len(found.index["l"]) > 0.6 * len(world.points)
    off = np.linalg.norm(found.rows["l"] - world.points[found.index["l"]], axis=1)
    distance = np.linalg.norm(found.rows["l"][:, :2] - world.poses[-1, :2], axis=1)
    assert np.median(off / distance) < 0.1
    assert np.quantile(off / distance, 0.95) < 0.5


def test_two_sightings_from_one_place_do_not_suffice(rng):
    world = camera_tour(rng, still=True)
    placed = place_all(world.problem)
    assert "l" not in placed.values().index
    assert len(placed.waiting) == len(np.unique(np.asarray(world.problem.factors[0].index)[:, 1]))


@pytest.mark.parametrize("bend", [0.05, 0.2, 0.5])
def test_a_stricter_bar_begins_later_and_nearer(rng, bend):
    world = camera_tour(rng)
    strict = place_all(world.problem, Several(bend=bend)).values()
    loose = place_all(world.problem, Several(bend=2.0 * bend)).values()
    assert len(strict.index["l"]) <= len(loose.index["l"])


def test_bearings_from_two_places_cross():
    x = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.5]])
    place = np.array([[3.0, 4.0]])
    z = LandmarkBearing().expected(x, np.repeat(place, 2, axis=0))
    seen = Factors(LandmarkBearing(), ("x", "l"), [[0, 0], [1, 0]], z, 1e-4)
    problem = SlamProblem({"x": SE2(), "l": Vector(2)}, (seen,), start=begun_at(x))
    np.testing.assert_allclose(place_all(problem).values().rows["l"], place, atol=1e-6)


def test_a_camera_in_space_and_a_beacon_in_space_begin_too(rng):
    camera, _ = mounted_camera()
    x = SE3().random(rng, 0.2, (12,))
    x[:, 4:] = rng.uniform(-1.0, 1.0, (12, 3))
    place = np.array([[0.3, -0.2, 6.0]])
    for model, noise in ((Projection(camera), 0.01), (LandmarkRange(SE3()), 1e-4)):
        z = model.expected(x, np.repeat(place, 12, axis=0))
        index = np.column_stack([np.arange(12), np.zeros(12, dtype=int)])
        seen = Factors(model, ("x", "l"), index, z, noise)
        problem = SlamProblem({"x": SE3(), "l": Vector(3)}, (seen,), start=begun_at(x))
        found = place_all(problem).values().rows["l"]
        np.testing.assert_allclose(found, place, atol=1e-4)


def test_the_camera_of_the_world_looks_forward():
    camera, body_T_camera = mounted_camera()
    assert camera.project(np.array([[0.0, 0.0, 1.0]])).tolist() == [[320.0, 240.0]]
    assert body_T_camera.shape == (7,)
