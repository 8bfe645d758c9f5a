"""Scripts as FilterPy's users write them, each run twice: as it stands, and with the one line added."""

import inspect
import math
import warnings

import numpy as np

import sequential as sq

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from filterpy import common, kalman

__all__ = ["angle", "assert_same", "common", "kalman", "run_both", "tracker"]


def tracker(column=True, axes=1):
    """A constant-velocity filter, built line by line as a script does."""
    kf = kalman.KalmanFilter(dim_x=2 * axes, dim_z=axes)
    one = np.array([[1.0, 0.5], [0.0, 1.0]])
    kf.F = np.kron(np.eye(axes), one)
    kf.H = np.kron(np.eye(axes), [[1.0, 0.0]])
    kf.P *= 50.0
    kf.R *= 0.3
    kf.Q = np.kron(np.eye(axes), common.Q_discrete_white_noise(2, 0.5, 0.1))
    start = np.linspace(1.0, 2.0, 2 * axes)
    kf.x = start[:, None] if column else start
    return kf


def run_both(make, script, *, except_for=(), tolerance=1e-9):
    """Run a script, a generator that yields after every step, on both filters, and compare at every yield.

    What the script yields is compared too.
    """
    theirs = make()
    ours = sq.from_filterpy(make())
    steps = 0
    for expected, got in zip(script(theirs), script(ours), strict=True):
        steps += 1
        assert_same(theirs, ours, except_for, tolerance)
        assert_equal(expected, got, "what the script computed", tolerance)
    assert steps > 0
    return theirs, ours


def assert_same(theirs, ours, except_for=(), tolerance=1e-9):
    """Every public attribute of FilterPy's filter has its number, and its shape, in ours."""
    compared = set()
    for name in attributes(theirs) - set(except_for):
        expected = getattr(theirs, name)
        if callable(expected) or expected is None or isinstance(expected, str | list):
            continue
        if isinstance(expected, np.ndarray) and expected.dtype == object:
            assert getattr(ours, name).tolist() == expected.tolist()
            continue
        assert_equal(expected, getattr(ours, name), name, tolerance)
        compared.add(name)
    assert {"x", "P"} <= compared


def attributes(theirs):
    derived = {name for name, _ in inspect.getmembers(type(theirs), lambda o: isinstance(o, property))}
    return {name for name in derived | set(vars(theirs)) if not name.startswith("_")}


def assert_equal(expected, got, name, tolerance):
    if isinstance(expected, tuple | list):
        for one, other in zip(expected, got, strict=True):
            assert_equal(one, other, name, tolerance)
    elif expected is not None and not callable(expected) and not hasattr(expected, "num_sigmas"):
        expected, got = np.asarray(expected), np.asarray(got)
        if name == "y" and not expected.any():
            expected = expected.reshape(got.shape)  # a column after a missing reading, also beside a flat x
        assert got.shape == expected.shape, name
        scale = max(1.0, np.abs(expected).max(initial=0.0))
        np.testing.assert_allclose(got, expected, rtol=0, atol=tolerance * scale, err_msg=name)


def angle(a):
    """An angle brought to (-π, π]."""
    return math.remainder(a, 2 * math.pi)
