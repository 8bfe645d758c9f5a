"""Central differences on manifolds, and the check that a declared Jacobian agrees with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import JacobianMismatchError, ShapeError
from sequential.manifold import Manifold
from sequential.model import Functions, evaluate

if TYPE_CHECKING:
    from sequential.model import StateSpace

__all__ = ["check_jacobians", "difference", "unchecked"]

Array = NDArray[np.float64]

STEP = 1e-6  # rounding (1e-16/step) and truncation (step²) are then both far below TOLERANCE
TOLERANCE = 1e-5

_suspended: ContextVar[bool] = ContextVar("_suspended", default=False)


@contextmanager
def unchecked() -> Iterator[None]:
    """Build models without the check: for a loop that builds the same model with other numbers."""
    token = _suspended.set(True)
    try:
        yield
    finally:
        _suspended.reset(token)


def difference(
    function: Callable[[Array], Array], x: Array, domain: Manifold, image: Manifold, step: float = STEP
) -> Array:
    """Jacobian (d_image, d_domain) of a function between manifolds, by central differences.

    Column j is [local(f(x), f(x ⊕ h e_j)) - local(f(x), f(x ⊕ -h e_j))] / 2h.
    """
    at = function(x)
    columns = []
    for j in range(domain.dim):
        xi = np.zeros(domain.dim)
        xi[j] = step
        ahead = image.local(at, function(domain.retract(x, xi)))
        behind = image.local(at, function(domain.retract(x, -xi)))
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=1)


def check_jacobians(model: StateSpace, dt: float = 0.01, seed: int = 0) -> None:
    """Compare every declared Jacobian of a model with differences at two states near the prior.

    Raises
    ------
    JacobianMismatchError
        naming the function, the worst entry, what was declared and what differences give.
    """
    if _suspended.get():
        return
    rng = np.random.default_rng(seed)
    manifold = model.manifold
    for scale in (0.0, 0.3):
        x = manifold.retract(model.prior.mean, scale * rng.standard_normal(manifold.dim))
        what = f"{type(model.process).__name__}.step"
        u = rng.standard_normal(model.process_functions.inputs)
        if getattr(model.process, "rows", 0):
            u[-1] = 0.0  # a row of its table
        _check(model.process_functions, manifold, manifold, x, u, dt, what)
        for name, sensor in model.sensors.items():
            what = f"sensors[{name!r}].observe"
            f = model.sensor_functions[name]
            # a context is mostly an index (which landmark): zero is the one value that always exists
            _check(f, manifold, sensor.manifold, x, np.zeros(max(f.inputs, 1)), 0.0, what)


def _check(f: Functions, domain: Manifold, image: Manifold, x: Array, u: Array, dt: float, what: str) -> None:

    def value(at: Array) -> Array:
        return evaluate(f.value, at, u, dt, f.params, image.size)

    if value(x).shape != (image.size,):
        msg = f"{what} must return {image.size} numbers"
        raise ShapeError(msg)
    if f.jacobian is None:
        return
    declared = evaluate(f.jacobian, x, u, dt, f.params, image.dim * domain.dim).reshape(image.dim, domain.dim)
    expected = difference(value, x, domain, image)
    gap = np.abs(declared - expected)
    if not np.all(gap <= TOLERANCE * max(1.0, float(np.abs(expected).max()))):
        row, column = np.unravel_index(int(np.nanargmax(np.where(np.isnan(gap), np.inf, gap))), gap.shape)
        msg = (
            f"the Jacobian of {what} disagrees with central differences at row {row}, column {column}: "
            f"declared {declared[row, column]:.6g}, differences give {expected[row, column]:.6g}; "
            "mend it, or leave it out and it will be differenced"
        )
        raise JacobianMismatchError(msg)
