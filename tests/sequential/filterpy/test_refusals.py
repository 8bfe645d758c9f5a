"""What cannot be taken over, and what does not fit, is said in a sentence."""

import numpy as np
import pytest
from filterpy_scripts import assert_same, kalman, tracker

import sequential as sq


def test_what_is_not_taken_over_is_refused_in_a_sentence():
    with pytest.raises(sq.FactorlabError, match="takes a filter of FilterPy, got a dict"):
        sq.from_filterpy({})
    filters = [tracker(), tracker()]
    with pytest.raises(sq.FactorlabError, match="MMAEFilterBank of FilterPy is not taken over"):
        sq.from_filterpy(kalman.MMAEFilterBank(filters, [0.5, 0.5], 2))
    ensemble = kalman.EnsembleKalmanFilter(np.zeros(2), np.eye(2), 1, 1.0, 8, lambda x: x[:1], lambda x, _: x)
    with pytest.raises(sq.FactorlabError, match="EnsembleKalmanFilter"):
        sq.from_filterpy(ensemble)


def test_a_class_that_leads_back_is_refused():
    class Logged(kalman.KalmanFilter):
        def update(self, z):
            super().update(z)

    with pytest.raises(sq.FactorlabError, match=r"Logged.update calls super\(\)"):
        sq.from_filterpy(Logged(2, 1))


def test_taking_over_twice_and_copying():
    kf = tracker()
    ours = sq.from_filterpy(kf)
    assert sq.from_filterpy(ours) is ours
    ours.predict()
    ours.update(1.0)
    ours.P[0, 0] = 77.0
    assert_same(tracker(), kf)
    assert "FilterpyKalman, taken over" in repr(ours)
    assert "x = " in repr(ours)


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("x", np.zeros(3), r"x has shape \(3,\); a state of 2 numbers"),
        ("x", np.zeros((1, 2)), r"x has shape \(1, 2\)"),
        ("P", np.eye(3), r"P has shape \(3, 3\)"),
        ("F", np.eye(4), r"F has shape \(4, 4\)"),
        ("H", np.eye(2), r"H has shape \(2, 2\); with dim_z = 1 and dim_x = 2"),
        ("R", np.eye(2), r"R has shape \(2, 2\)"),
        ("B", np.eye(3), r"B has shape \(3, 3\)"),
    ],
)
def test_a_wrong_shape_is_a_sentence(name, value, sentence):
    ours = sq.from_filterpy(tracker())
    with pytest.raises(sq.FactorlabError, match=sentence):
        setattr(ours, name, value)


def test_wrong_readings_and_inputs_are_sentences():
    ours = sq.from_filterpy(tracker())
    with pytest.raises(sq.FactorlabError, match="with dim_z = 1 a reading is 1 numbers"):
        ours.update([1.0, 2.0])
    with pytest.raises(sq.FactorlabError, match="z is 'far'"):
        ours.update("far")
    ours.B = np.ones((2, 1))
    with pytest.raises(sq.FactorlabError, match=r"needs B of shape \(2, 2\)"):
        ours.predict(u=[1.0, 2.0])
    with pytest.raises(sq.FactorlabError, match="alpha is"):
        ours.alpha = 0.5
    with pytest.raises(sq.FactorlabError, match="Rs has 1 entries for 2 readings"):
        ours.batch_filter([1.0, 2.0], Rs=[1.0])


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"H": np.eye(3)}, r"H has shape \(3, 3\)"),
        ({"R": np.eye(2)}, r"R has shape \(2, 2\)"),
        ({"F": np.eye(3)}, r"F has shape \(3, 3\)"),
        ({"Q": np.eye(3)}, r"Q has shape \(3, 3\)"),
        ({"z": [1.0, 2.0]}, "a reading is 1 numbers"),
        ({"z": np.zeros((1, 3))}, "a reading is 1 numbers"),
    ],
)
def test_matrix_dimensions(given, sentence):
    ours = sq.from_filterpy(tracker())
    ours.test_matrix_dimensions()
    ours.test_matrix_dimensions(z=1.0)
    ours.test_matrix_dimensions(z=[[1.0]], H=np.ones((1, 2)), R=2.0)
    with pytest.raises(sq.FactorlabError, match=sentence):
        ours.test_matrix_dimensions(**given)
