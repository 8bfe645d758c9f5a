"""What a kernel needs to call a model's function by its address: pointers into arrays, and the call.

Every function of a robust model has one C signature,

    int64 function(const double *data, int64 n, int64 k, argument, double *out),

`data` being n rows of k numbers.  `SOLVE` takes numbers of rows (int64) as its argument and fills models;
`RESIDUALS` takes a model and fills n squared errors; `FIT` takes n weights and improves the model in `out`.
Each returns how many models it filled: `RESIDUALS` and a `FIT` that went well 1, whatever failed 0.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

__all__ = ["FIT", "RESIDUALS", "SOLVE", "call", "pointer"]

NUMBERS, ROWS = types.CPointer(types.float64), types.CPointer(types.int64)
SOLVE = types.int64(NUMBERS, types.int64, types.int64, ROWS, NUMBERS)
RESIDUALS = FIT = types.int64(NUMBERS, types.int64, types.int64, NUMBERS, NUMBERS)


@intrinsic
def pointer(typingctx, array, offset) -> Any:
    """The address of an array's element at a flat offset."""
    signature = types.CPointer(array.dtype)(array, offset)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        return builder.gep(data, [args[1]])

    return signature, codegen


@intrinsic
def call(typingctx, address, data, n, k, argument, out) -> Any:
    """What the function at an address returns."""
    signature = types.int64(address, data, n, k, argument, out)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        whole = ir.IntType(64)
        kinds = [context.get_value_type(kind) for kind in sig.args[1:]]
        function = builder.inttoptr(args[0], ir.FunctionType(whole, kinds).as_pointer())
        return builder.call(function, args[1:])

    return signature, codegen
