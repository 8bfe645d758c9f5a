"""Calling a compiled model function by its address, from inside a kernel.

Fifteen nanoseconds a call, any number of models, read-only arrays welcome, and the kernel itself is
compiled once for all models.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

__all__ = ["MODEL_SIGNATURE", "allocating", "bare", "bare_as", "call", "inlined", "inlined_as", "owning"]

# Numba counts a reference for every array that a function is handed, and for each one inside a record:
# 250 ns for a call that takes a model.  `bare` functions allocate nothing and do without the counting, which
# makes a filter step three times as quick.  `allocating` ones say that they need it, since a function
# compiled on behalf of a bare one would inherit its flags.
# `inlined` ones take records, which are a kilobyte to copy.
bare = njit(cache=True, error_model="numpy", _nrt=False)
inlined = njit(cache=True, error_model="numpy", _nrt=False, forceinline=True)


def bare_as(signature: Any) -> Any:
    """`bare` for one explicit signature: compiled once, whatever mix of read-only arrays callers hold."""
    return njit(signature, cache=True, error_model="numpy", _nrt=False)


def inlined_as(signature: Any) -> Any:
    """`bare_as` for what is so small that a call costs more than the work: most small matrices."""
    return njit(signature, cache=True, error_model="numpy", _nrt=False, forceinline=True)


allocating = njit(cache=True, error_model="numpy", _nrt=True)
# what returns arrays owes its caller their references; inlined, so that their sizes may be constants
owning = njit(cache=True, error_model="numpy", _nrt=True, forceinline=True)

POINTER = types.CPointer(types.float64)
MODEL_SIGNATURE = types.void(POINTER, POINTER, types.float64, POINTER, POINTER)


@intrinsic
def call(typingctx, address, x, x_at, u, u_at, dt, params, params_at, out, out_at) -> Any:
    """Call the function at `address` on (x, u, dt, params, out), each array from a flat element offset."""
    signature = types.void(address, x, x_at, u, u_at, dt, params, params_at, out, out_at)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        def pointer(array: int, offset: int) -> Any:
            data = context.make_array(sig.args[array])(context, builder, args[array]).data
            return builder.gep(data, [args[offset]])

        double = ir.DoubleType()
        double_pointer = double.as_pointer()
        kind = ir.FunctionType(
            ir.VoidType(), [double_pointer, double_pointer, double, double_pointer, double_pointer]
        )
        function = builder.inttoptr(args[0], kind.as_pointer())
        builder.call(function, [pointer(1, 2), pointer(3, 4), args[5], pointer(6, 7), pointer(8, 9)])
        return context.get_dummy_value()

    return signature, codegen
