"""What the robust loop must know of a model: by compiled functions, or by plain NumPy ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError

__all__ = ["Addresses", "CompiledModel", "NumpyModel", "RobustModel"]

Array = NDArray[np.float64]
BLOCK = 64  # rows whose errors are worked out at a time, before asking whether to go on


@dataclass(frozen=True, slots=True)
class Addresses:
    """C functions of a model, in the form that `vision3d.kernels.robust_calls` tells; no fit: 0."""

    solve: int
    residuals: int
    fit: int


@dataclass(frozen=True)
class RobustModel:
    """A model to look for among rows of numbers.

    Attributes
    ----------
    name : as in messages
    sample_size : rows that determine it
    columns : numbers in a row
    parameters : numbers in a model
    max_solutions : models that one sample may give
    error_dof : independent components of a row's error: 2 for a distance in the plane, 1 for one to a line
    freedom : degrees of freedom of the model
    inner_size : rows of a subset that local optimisation fits
    solve_cost : a sample's solution, in rows whose error takes as long
    redraws : samples drawn at most for each one that counts, where degenerate ones cost next to nothing
    """

    name: str
    sample_size: int
    columns: int
    parameters: int
    max_solutions: int = 1
    error_dof: int = 1
    freedom: int = 1
    inner_size: int = 12
    solve_cost: int = 100
    redraws: int = 1

    @property
    def block(self) -> int:
        """Rows whose errors are worked out at a time."""
        return BLOCK

    def functions(self) -> AbstractContextManager[Addresses]:
        """Give the addresses of its functions for as long as they are called."""
        raise NotImplementedError


@dataclass(frozen=True)
class CompiledModel(RobustModel):
    """A model whose functions are compiled; `load` imports their kernels (and so Numba) when first needed."""

    load: Callable[[], Addresses] = field(kw_only=True)

    @contextmanager
    def functions(self) -> Iterator[Addresses]:
        """Give the addresses."""
        yield self.load()


@dataclass(frozen=True)
class NumpyModel(RobustModel):
    """A model of one's own, in NumPy: the same loop calls it, slower.

    Attributes
    ----------
    solve : rows (sample_size, columns) -> models, a sequence of (parameters,); empty for a degenerate sample
    residuals : rows (n, columns), model (parameters,) -> squared errors (n,)
    fit : rows (n, columns), weights (n,), model -> a better model (parameters,), or None where there is none;
        leave it out for a search without local optimisation
    """

    solve: Callable[[Array], Any] = field(kw_only=True)
    residuals: Callable[[Array, Array], Array] = field(kw_only=True)
    fit: Callable[[Array, Array, Array], Array | None] | None = field(default=None, kw_only=True)

    @property
    def block(self) -> int:
        """All rows at once: a call costs more than the rows."""
        return 1 << 30

    @contextmanager
    def functions(self) -> Iterator[Addresses]:
        """Give addresses of C functions that call the NumPy ones; raise at the end what those raised."""
        import ctypes

        number, rows = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int64)
        whole = ctypes.c_int64
        form = ctypes.CFUNCTYPE(whole, number, whole, whole, number, number)
        solving = ctypes.CFUNCTYPE(whole, number, whole, whole, rows, number)
        failures: list[BaseException] = []

        def guarded(work: Callable[..., int]) -> Callable[..., int]:
            def call(*args: Any) -> int:
                try:
                    return 0 if failures else work(*args)
                except BaseException as failure:  # noqa: BLE001 - it is raised again, outside of compiled code
                    failures.append(failure)
                    return 0

            return call

        kept = (
            solving(guarded(self._solve)),
            form(guarded(self._residuals)),
            form(guarded(self._fit)),
        )
        solve, residuals, fit = (int(ctypes.cast(f, ctypes.c_void_p).value or 0) for f in kept)
        try:
            yield Addresses(solve, residuals, fit if self.fit else 0)
        finally:
            if failures:
                raise failures[0]

    def _solve(self, data: Any, n: int, k: int, sample: Any, out: Any) -> int:
        chosen = _seen(data, (n, k))[_seen(sample, (self.sample_size,))]
        models = np.asarray(list(self.solve(chosen)), float).reshape(-1, self.parameters)
        if len(models) > self.max_solutions:
            raise ModelError(
                f"{self.name}: solve gave {len(models)} models, max_solutions says {self.max_solutions}"
            )
        _seen(out, (self.max_solutions, self.parameters))[: len(models)] = models
        return len(models)

    def _residuals(self, data: Any, n: int, k: int, model: Any, out: Any) -> int:
        errors = np.asarray(self.residuals(_seen(data, (n, k)), _seen(model, (self.parameters,))), float)
        if errors.shape != (n,):
            raise ModelError(f"{self.name}: residuals gives squared errors ({n},); got {errors.shape}")
        _seen(out, (n,))[:] = errors
        return 1

    def _fit(self, data: Any, n: int, k: int, weights: Any, model: Any) -> int:
        assert self.fit is not None  # noqa: S101 - it has no address otherwise
        shared = _seen(model, (self.parameters,))
        better = self.fit(_seen(data, (n, k)), _seen(weights, (n,)), shared.copy())
        if better is None:
            return 0
        shared[:] = better
        return 1


def _seen(pointer: Any, shape: tuple[int, ...]) -> Any:
    """An array that looks at memory of the loop."""
    return np.ctypeslib.as_array(pointer, shape=shape)
