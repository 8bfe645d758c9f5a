"""Records kept in memory, for kernels that are called once a sample.

Unboxing the arrays of a model costs microseconds a call.  Here a record is written down once as plain words
(an array is its address, shape and strides) and a kernel reads it back from the address of those words.
The layout is that of Numba's own structures without their reference counts, which a test holds it to.
Whoever made the words keeps the arrays alive.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

__all__ = ["loader", "words"]

UNCOUNTED = ("meminfo", "parent")


def words(record: Any) -> NDArray[np.int64]:
    """A tuple of arrays, integers, floats and tuples of them as 64-bit words.

    Raises
    ------
    TypeError
        where an entry has no such form.
    """
    return np.array(list(_flat(record)), dtype=np.int64)


def _flat(entry: Any) -> Any:
    if isinstance(entry, tuple):
        for inner in entry:
            yield from _flat(inner)
    elif isinstance(entry, np.ndarray) and entry.flags.c_contiguous:
        yield from (0, 0, entry.size, entry.itemsize, entry.ctypes.data, *entry.shape, *entry.strides)
    elif isinstance(entry, int | np.integer):
        yield int(entry)
    elif isinstance(entry, float):
        yield int(np.float64(entry).view(np.int64))
    else:
        msg = f"a record holds contiguous arrays, numbers and tuples of them, not {type(entry).__name__}"
        raise TypeError(msg)


def loader(kind: Any) -> Any:
    """An intrinsic `load(address)` that reads a record of the given Numba type."""

    @intrinsic
    def load(typingctx, address) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            where = builder.inttoptr(args[0], context.get_value_type(kind).as_pointer())
            return _loaded(context, builder, kind, where)

        return kind(address), codegen

    return load


def _loaded(context: Any, builder: Any, kind: Any, where: Any) -> Any:
    """Load leaf by leaf, so that what a kernel does not use is never read."""
    whole = context.get_value_type(kind)
    if isinstance(kind, types.Array):
        fields = context.data_model_manager[kind]._fields
        value = ir.Constant(whole, ir.Undefined)
        for index, name in enumerate(fields):
            part = whole.elements[index]
            leaf = ir.Constant(part, None) if name in UNCOUNTED else builder.load(_at(builder, where, index))
            value = builder.insert_value(value, leaf, index)
        return value
    if isinstance(kind, types.BaseTuple):
        value = ir.Constant(whole, ir.Undefined)
        for index, inner in enumerate(kind):
            value = builder.insert_value(
                value, _loaded(context, builder, inner, _at(builder, where, index)), index
            )
        return value
    return builder.load(where)


def _at(builder: Any, where: Any, index: int) -> Any:
    word = ir.IntType(32)
    return builder.gep(where, [word(0), word(index)], inbounds=True)
