"""Settings and signals that cannot be, each refused in a sentence."""

import numpy as np
import pytest

from sequential.errors import DataError, ModelError, NotFiniteError, ShapeError, TimeOrderError
from sequential.log import Stream
from sequential.signal import (
    Complementary,
    Hampel,
    LowPass,
    MovingMean,
    SlidingMedian,
    WindowState,
    measure_step_delay,
)

X = np.zeros(5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (LowPass, "takes one of time_constant"),
        (lambda: LowPass(0.1, 3.0), "takes one of time_constant"),
        (lambda: LowPass(time_constant=-1.0), "positive and finite"),
        (lambda: LowPass(coefficient=1.5), r"lies in \]0, 1\], got 1.5"),
        (lambda: LowPass(0.1, interval=0.0), "a positive number of s; got 0"),
        (lambda: LowPass(0.1, between="spline"), "'hold' or run in a 'line', got 'spline'"),
        (lambda: MovingMean(0), "1 or more; got 0"),
        (lambda: SlidingMedian(2.5), "1 or more; got 2.5"),
        (lambda: SlidingMedian(5, edges="wrap"), "one of shrink, nearest, reflect, nan; got 'wrap'"),
        (lambda: SlidingMedian(5, edges="reflect"), "has not seen yet"),
        (lambda: Hampel(5, threshold=-1.0), "zero or more; got -1.0"),
        (lambda: Hampel(5, floor=np.inf), "finite numbers"),
        (lambda: Complementary(0.0), "positive number of s, got 0"),
        (lambda: LowPass(0.1)(X), "a signal without stamps needs the interval"),
        (lambda: LowPass(0.1).response(), "needs the interval between samples"),
        (
            lambda: SlidingMedian(5, centred=True).step(WindowState(), 1.0),
            "centred=True.* needs 2",
        ),
        (lambda: measure_step_delay(lambda _, x: 0.5 * x, settle=1 << 19), "had not reached 0.9 of a step"),
    ],
)
def test_settings(make, message):
    with pytest.raises(ModelError, match=message):
        make()


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda f: f(), ShapeError, "called on x, on t and x, or on a Stream; got 0"),
        (lambda f: f(np.zeros((2, 2, 2))), ShapeError, r"shape \(N,\) or \(N, m\), got \(2, 2, 2\)"),
        (lambda f: f(np.arange(4), X), ShapeError, "4 stamps for 5 samples"),
        (lambda f: f(np.zeros((5, 1)), X), ShapeError, r"stamps of shape \(N,\)"),
        (lambda f: f([0, 1, 3, 2, 4], X), TimeOrderError, "backwards at sample 3"),
        (lambda f: f([0, 1, np.nan, 2, 4], X), NotFiniteError, "the stamp nan at sample 2"),
        (lambda f: f([0.0, np.inf, 1.0]), NotFiniteError, "infinity at sample 1; write NaN"),
        (lambda f: f(["a"]), DataError, "must be an array of numbers"),
    ],
)
@pytest.mark.parametrize("filter_", [LowPass(coefficient=0.1), SlidingMedian(3), Hampel(3), MovingMean(3)])
def test_signals(filter_, call, error, message):
    with pytest.raises(error, match=message):
        call(filter_)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda f: f(X, rate=X), ShapeError, "needs stamps"),
        (lambda f: f(np.arange(5), X), ShapeError, "as rate=… or as fast=…"),
        (lambda f: f(np.arange(5), X, rate=X, fast=X), ShapeError, "one of the two"),
        (lambda f: f(np.arange(5), X, rate=X[:4]), ShapeError, r"\(5, 1\), the fast one \(4, 1\)"),
        (lambda f: f(np.arange(5), X, rate=X * np.nan), NotFiniteError, "at sample 0; it must have no gaps"),
        (lambda f: f(Stream(np.arange(5), X), rate=Stream(np.arange(1, 6), X)), ShapeError, "same stamps"),
    ],
)
def test_two_signals(call, error, message):
    with pytest.raises(error, match=message):
        call(Complementary(0.5))


def test_samples_without_stamps_on_line():
    with pytest.raises(DataError, match="needs the stamp of a sample"):
        LowPass(0.1).step(LowPass(0.1).start(), 1.0)
    with pytest.raises(DataError, match="write NaN"):
        SlidingMedian(3).step(SlidingMedian(3).start(), np.inf)
