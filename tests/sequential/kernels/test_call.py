"""The intrinsic that calls a model function by its address: what all kernels stand on."""

import numpy as np
import pytest


@pytest.fixture(scope="module")
def caller():
    from numba import cfunc, njit

    from sequential.kernels.call import MODEL_SIGNATURE, call

    @cfunc(MODEL_SIGNATURE)
    def function(x, u, dt, p, out):
        out[0] = x[0] + 10.0 * u[1] + 100.0 * dt
        out[1] = p[0] - x[1]

    @njit
    def run(address, x, x_at, u, u_at, dt, p, p_at, out, out_at):
        call(address, x, x_at, u, u_at, dt, p, p_at, out, out_at)

    return function, run


def test_arrays_are_read_from_their_offsets(caller):
    function, run = caller
    x, u, p, out = np.arange(5.0), np.arange(6.0), np.arange(4.0), np.zeros(6)
    run(function.address, x, 2, u, 3, 0.5, p, 1, out, 4)
    np.testing.assert_array_equal(out, [0, 0, 0, 0, 2.0 + 40.0 + 50.0, 1.0 - 3.0])


def test_read_only_and_two_dimensional_arrays_are_welcome(caller):
    function, run = caller
    x, u, p, out = np.arange(6.0).reshape(3, 2), np.ones((2, 2)), np.zeros(1), np.zeros((2, 2))
    for values in (x, u, p):
        values.flags.writeable = False
    run(function.address, x, 4, u, 0, 0.0, p, 0, out, 2)
    np.testing.assert_array_equal(out, [[0, 0], [14.0, -5.0]])


def test_one_kernel_serves_many_functions(caller):
    from numba import cfunc

    from sequential.kernels.call import MODEL_SIGNATURE

    _, run = caller

    @cfunc(MODEL_SIGNATURE)
    def other(x, u, dt, p, out):
        out[0] = -x[0]

    compiled_before = len(run.signatures)
    out = np.zeros(1)
    run(other.address, np.ones(1), 0, np.zeros(1), 0, 0.0, np.zeros(1), 0, out, 0)
    assert out[0] == -1.0
    assert len(run.signatures) <= compiled_before + 1
