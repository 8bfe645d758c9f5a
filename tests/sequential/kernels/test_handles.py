"""Records as words in memory: the layout is Numba's own, so it is held against Numba."""

import numpy as np
import pytest
import worlds

from sequential.kernels.handles import loader, words


@pytest.fixture(scope="module")
def reader():
    from numba import njit, types

    from sequential.kernels.arrays import f1, i2, w3

    kind = types.Tuple([f1, types.int64, types.float64, types.UniTuple(i2, 2), w3])
    load = loader(kind)

    @njit(types.void(types.int64, types.float64[::1]))
    def read(address, out):
        vector, whole, real, (left, right), cube = load(address)
        out[0], out[1], out[2] = vector[2], whole, real
        out[3], out[4] = left[1, 0], right[0, 2]
        out[5], out[6], out[7] = len(vector), right.shape[1], right.strides[0]
        cube[1, 0, 1] = 7.0

    return read


def test_what_was_written_is_read_and_may_be_written_to(reader):
    cube = np.zeros((2, 1, 2))
    left, right = np.array([[1], [2]]), np.array([[3, 4, 5]])
    memory = words((np.array([1.0, 2.0, 3.5]), -8, 2.5, (left, right), cube))
    out = np.zeros(8)
    reader(memory.ctypes.data, out)
    assert out.tolist() == [3.5, -8.0, 2.5, 2.0, 5.0, 3.0, 3.0, 24.0]
    assert cube[1, 0, 1] == 7.0
    assert cube.sum() == 7.0


def test_the_records_of_the_kernels_have_as_many_words_as_numba_gives_them():
    from numba import njit

    from sequential.compile import compiled
    from sequential.kernels.records import MODEL, SCHEDULE

    world = worlds.unicycle_range_bearing()
    schedule = world.problem(np.random.default_rng(1)).schedule
    context = njit(lambda: 0).targetdescr.target_context
    for kind, record in ((MODEL, compiled(world.model).tables), (SCHEDULE, schedule)):
        assert words(record).nbytes == context.get_abi_sizeof(context.get_value_type(kind))


@pytest.mark.parametrize("entry", ["text", np.zeros((4, 4)).T, np.zeros((4, 4))[:, :2], None])
def test_what_has_no_such_form_is_refused(entry):
    with pytest.raises(TypeError, match="contiguous arrays, numbers and tuples"):
        words((1, entry))
