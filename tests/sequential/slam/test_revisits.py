"""Loop errors: zero where everything is true, the drift where it drifts; and visits that are kept back."""

import numpy as np
import pytest
from revisit_worlds import round_trip

from sequential.errors import ModelError
from sequential.manifold import SE2
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import LandmarkRange
from sequential.slam.revisits import loop_errors, visits_of, without_visits


def test_the_truth_closes_every_loop():
    problem, truth = round_trip()
    errors = loop_errors(problem, truth)
    assert errors.landmark.tolist() == [0, 0]
    assert errors.worst < 1e-12


def test_a_trajectory_that_has_drifted_shows_its_drift():
    problem, truth = round_trip()
    x = truth.rows["x"].copy()
    x[100:, 1] += 2.0
    x[400:, 1] += 3.0
    errors = loop_errors(problem, Values({"x": np.arange(501)}, {"x": x}))
    np.testing.assert_allclose(errors.distance, [2.0, 3.0], atol=1e-12)
    assert errors.rms == pytest.approx(np.sqrt(6.5))
    assert errors.median == pytest.approx(2.5)


def test_visits_end_with_a_pause():
    problem, _ = round_trip()
    assert visits_of(problem, 1).visit.tolist() == [0, 0, 0, 1, 1, 2]
    assert visits_of(problem, 1, away_steps=250).visit.tolist() == [0, 0, 0, 0, 0, 1]
    assert visits_of(problem, 1).again.tolist() == [False, True, True]


def test_a_visit_kept_back_leaves_the_first_on_the_map():
    problem, _ = round_trip()
    kept, back = without_visits(problem, 2)
    assert np.asarray(back.index)[:, 0].tolist() == [500]
    assert np.asarray(kept.factors[1].index)[:, 0].tolist() == [0, 1, 2, 200, 201]
    assert len(kept.factors[0]) == 500


def test_sightings_that_place_nothing_have_no_loop_error():
    problem, truth = round_trip()
    ranges = Factors(LandmarkRange(), ("x", "l"), [[0, 0], [400, 0]], [[1.0], [1.0]], 0.01)
    blind = SlamProblem(problem.kinds, (problem.factors[0], ranges))
    with pytest.raises(ModelError, match="alone does not determine"):
        loop_errors(blind, truth)


def test_a_problem_without_landmarks_says_so():
    problem, truth = round_trip()
    with pytest.raises(ModelError, match="sightings of landmarks"):
        loop_errors(SlamProblem({"x": SE2()}, problem.factors[:1]), truth)
    with pytest.raises(ModelError, match="joins x, x"):
        visits_of(problem, 0)
