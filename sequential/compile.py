"""From a declaration to addresses: every model function becomes a plain C function.

Built-in models are compiled once per machine.  A user's function is compiled where Numba can; where it
refuses, the kernel calls back into Python for that one function, and `Compiled.interpreted` names it.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.fusing import fused_move, fused_sight, over_points
from sequential.manifold import Kind, Manifold
from sequential.model import Functions, Plain, StateSpace, evaluate
from sequential.timeline import sealed
from sequential.wrapping import wrapped

__all__ = ["Compiled", "built_in", "compiled", "made_for", "make"]

Array = NDArray[np.float64]
_DOUBLES = ctypes.POINTER(ctypes.c_double)
CALLBACK = ctypes.CFUNCTYPE(None, _DOUBLES, _DOUBLES, ctypes.c_double, _DOUBLES, _DOUBLES)


@dataclass(eq=False)
class Compiled:
    """Tables for the kernels; keeps the compiled functions alive, collects errors of interpreted ones."""

    tables: Any
    interpreted: list[str] = field(default_factory=list)
    alive: list[Any] = field(default_factory=list)
    failures: list[BaseException] = field(default_factory=list)
    pointed: dict[tuple[int, int], Any] = field(default_factory=dict)

    def raise_failures(self) -> None:
        """Raise what an interpreted model function raised while a kernel called it."""
        if self.failures:
            first = self.failures[0]
            self.failures.clear()
            raise first

    def with_points(self, model: StateSpace, count: int, widest: int) -> Any:
        """The tables with functions that take all of `count` sigma points at once, where there can be some.

        `widest` is how many numbers lie between one point's measurement and the next one's.
        """
        if (count, widest) not in self.pointed:
            n, f = model.manifold.size, model.process_functions
            step = _fused(self, over_points, f.value, n, f.inputs, count, n)
            sight = [
                _fused(self, over_points, g.value, n, g.inputs, count, widest)
                for g in model.sensor_functions.values()
            ]
            more = {"step_points": step, "observe_points": sealed(_ints(sight))}
            self.pointed[count, widest] = self.tables._replace(**more)
        return self.pointed[count, widest]

    def message(self) -> str:
        """What interpreting costs, or nothing."""
        if not self.interpreted:
            return ""
        return f"{', '.join(self.interpreted)} could not be compiled and runs in Python, about 100x slower"


_known: weakref.WeakKeyDictionary[StateSpace, Compiled] = weakref.WeakKeyDictionary()


def compiled(model: StateSpace) -> Compiled:
    """The tables of a model, made once."""
    if model not in _known:
        _known[model] = _lower(model)
    return _known[model]


def _lower(model: StateSpace) -> Compiled:
    from sequential.kernels.records import ModelTables

    whole = Compiled(None)
    n, d, f = model.manifold.size, model.manifold.dim, model.process_functions
    process = [
        _address(whole, f, raw, f"process {role}", (n, f.inputs, size))
        for raw, role, size in (
            (f.value, "step", n),
            (f.jacobian, "jacobian", d * d),
            (f.noise, "noise", d * d),
        )
    ]
    fused = [_address(whole, f, raw, "", (n, f.inputs, 0)) for raw in (f.advance, f.carry)]
    if fused[0] == 0:
        fused[0] = _fused(whole, fused_move, f.value, f.jacobian, f.noise, n, d, f.inputs)
    sensors = list(model.sensors.values())
    lowered = list(model.sensor_functions.values())
    observe, look, see = [], [], []
    for name, sensor, g in zip(model.sensors, sensors, lowered, strict=True):
        m = sensor.manifold
        observe.append(_address(whole, g, g.value, f"sensor {name!r}", (n, g.inputs, m.size)))
        look.append(_address(whole, g, g.jacobian, f"sensor {name!r} jacobian", (n, g.inputs, m.dim * d)))
        see.append(_fused(whole, fused_sight, g.value, g.jacobian, n, g.inputs))
    widest = max([s.manifold.dim for s in sensors] or [1])
    gate = np.array([[_threshold(s.gate, m) for m in range(widest + 1)] for s in sensors])
    z_tables = [s.manifold.table() for s in sensors] or [np.zeros((0, 5), dtype=np.int64)]
    params = [g.params for g in lowered] or [np.zeros(1)]
    entries: tuple[Any, ...] = (
        model.manifold.table(), n, d, *process, *fused, f.params,
        _ints(observe), _ints(look), np.concatenate(params), _starts(params),
        np.ascontiguousarray(np.concatenate(z_tables)), np.append(_starts(z_tables), sum(map(len, z_tables))),
        _ints([s.manifold.size for s in sensors]), _ints([s.manifold.dim for s in sensors]),
        gate.reshape(len(sensors), widest + 1),
        _ints([s.loss.code if s.loss else 0 for s in sensors]),
        np.array([s.loss.k if s.loss else 0.0 for s in sensors]),
        _flatness(model.manifold), _ints([_flatness(s.manifold) for s in sensors]), 0,
        _ints(see), 0, _ints([0] * len(sensors)),
    )  # fmt: skip
    whole.tables = ModelTables._make(sealed(v) if isinstance(v, np.ndarray) else v for v in entries)
    return whole


def _flatness(manifold: Manifold) -> int:
    kinds = [block.kind for block in manifold.blocks()]
    if all(kind == Kind.VECTOR for kind in kinds):
        return 2 if len(kinds) == 1 else 1
    return 1 if all(kind in {Kind.VECTOR, Kind.SO2} for kind in kinds) else 0


def _ints(values: list[int]) -> NDArray[np.int64]:
    return np.array(values, dtype=np.int64)


def _starts(pieces: list[Any]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum([len(p) for p in pieces])])[: len(pieces)].astype(np.int64)


def _threshold(gate: float | None, dim: int) -> float:
    if gate is None or dim == 0:
        return float("inf")
    if not 0.0 < gate < 1.0:
        msg = f"a gate is a probability between 0 and 1, such as 0.999; got {gate}"
        raise ModelError(msg)
    from scipy.special import chdtri

    return float(chdtri(dim, 1.0 - gate))


def _address(whole: Compiled, functions: Functions, raw: Any, name: str, sizes: tuple[int, int, int]) -> int:
    if raw is None:
        return 0
    if not isinstance(raw, Plain):
        return int(built_in(raw, functions.helpers).address)
    made = _compiled_or_none(raw, sizes[0], sizes[1]) if isinstance(raw.function, Hashable) else None
    if made is None:
        whole.interpreted.append(name)
        made = _interpret(whole, raw, sizes)
        whole.alive.append(made)
        return int(ctypes.cast(made, ctypes.c_void_p).value or 0)
    whole.alive.append(made)
    return int(made.address)


def _fused(whole: Compiled, fuse: Callable[..., Any], *given: Any) -> int:
    """Address of a function made of a user's functions, 0 where they do not lend themselves to it."""
    try:
        made = fuse(*given)
    except Exception:  # noqa: BLE001 - where Numba refuses, each function is called by itself
        return 0
    if made is None:
        return 0
    whole.alive.append(made)
    return int(made.address)


@cache
def built_in(raw: Callable[..., None], helpers: tuple[Callable[..., Any], ...]) -> Any:
    """A model function in the kernels' calling convention, as a C function from the disk cache."""
    from numba import cfunc
    from numba.extending import register_jitable

    from sequential.kernels.call import MODEL_SIGNATURE

    for helper in helpers:
        register_jitable(helper)
    return cfunc(MODEL_SIGNATURE, cache=True, error_model="numpy")(raw)


@cache
def made_for(kernel: Any) -> Callable[..., tuple[float, int]]:
    """A kernel that is compiled anew for every size that it is called with, and kept on disk."""
    from numba import njit

    made: Callable[..., tuple[float, int]] = njit(cache=True, error_model="numpy", nogil=True)(kernel.py_func)
    return made


def make(kernel: Any, *sizes: int) -> None:
    """Compile a kernel for sizes that its last arguments tell, unless it is in the cache."""
    from numba import types

    usual = kernel.signatures[0][: -len(sizes)]
    made: Any = made_for(kernel)
    made.compile((*usual, *(types.UniTuple(types.int64, size) for size in sizes)))


@lru_cache(maxsize=256)
def _compiled_or_none(raw: Plain, n: int, inputs: int) -> Any:
    """A user's function compiled once, however many models it appears in; None where Numba refuses."""
    try:
        return wrapped(raw, n, inputs)
    except Exception:  # noqa: BLE001 - Numba refuses in many ways; all of them mean the same here
        return None


def _interpret(whole: Compiled, raw: Plain, sizes: tuple[int, int, int]) -> Any:
    n, inputs, size = sizes

    def callback(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
        view = np.ctypeslib.as_array(out, (size,))
        try:
            state = np.ctypeslib.as_array(x, (n,)).copy()
            given = np.ctypeslib.as_array(u, (inputs,)).copy() if inputs else np.zeros(1)
            value = evaluate(raw, state, given, dt, np.zeros(1), size)
        except BaseException as error:  # noqa: BLE001 - raised again once the kernel has returned
            whole.failures.append(error)
            view[:] = np.nan
            return
        view[:] = view + value if raw.adds else value

    return CALLBACK(callback)
