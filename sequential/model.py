"""One declaration for every estimator: where the state lives, how it moves, what the sensors see."""

from __future__ import annotations

import abc
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, NotFiniteError, ShapeError
from sequential.log import frozen, nanoseconds
from sequential.manifold import Manifold, Vector
from sequential.noise import require_covariance

__all__ = ["Functions", "Gaussian", "Loss", "Plain", "ProcessModel", "SensorModel", "StateSpace"]

Array = NDArray[np.float64]


Raw = Callable[[Any, Any, float, Any, Any], None]
"""What kernels call, f(x, u, dt, params, out): everything in place, no allocation.

`x` state storage, `u` input or context, `dt` seconds, `params` the model's numbers, `out` the result.
Jacobians are written row by row; a noise function *adds* its (d, d) covariance to `out`.
"""


@dataclass(frozen=True, slots=True)
class Plain:
    """An ordinary function of a user, such as `step(x, u, dt)`, seen through the calling convention `Raw`."""

    function: Callable[..., Any]
    arguments: tuple[str, ...]
    size: int
    adds: bool = False

    def __call__(self, x: Any, u: Any, dt: float, params: Any, out: Any) -> None:
        """Call the function and write, or add, what it returns to `out`."""
        known = {"x": x, "u": u, "dt": dt}
        value = np.asarray(self.function(*(known[name] for name in self.arguments)), dtype=np.float64).ravel()
        if value.size != self.size:
            msg = f"{describe(self.function)} returned {value.size} numbers where {self.size} were expected"
            raise ShapeError(msg)
        out[...] = out + value if self.adds else value


def plain(function: Callable[..., Any], full: tuple[str, ...], size: int, *, adds: bool = False) -> Plain:
    """Match a user's function to the arguments that it takes: all of `full`, or without the input."""
    count = len(inspect.signature(function).parameters)
    without_input = tuple(name for name in full if name != "u")
    for arguments in (full, without_input):
        if count == len(arguments):
            return Plain(function, arguments, size, adds)
    msg = (
        f"{describe(function)} takes {count} arguments; "
        f"write it as f({', '.join(full)}) or f({', '.join(without_input)})"
    )
    raise ModelError(msg)


def describe(function: Callable[..., Any]) -> str:
    """The name that a message calls a function by."""
    return f"{getattr(function, '__name__', type(function).__name__)}()"


@dataclass(frozen=True, slots=True, eq=False)
class Functions:
    """A process or a sensor, lowered onto one manifold.

    `value` is the step or the observation, `params` the numbers it is given, `inputs` the length of `u`,
    `helpers` the plain functions that it calls (compiled together with it).  Two optional functions let a
    process use the zeros of its Jacobian F: `advance` pushes mean and covariance at once (`out` is
    [mean (n) | covariance (d·d)], in place), `carry` multiplies the (d, d) matrix at `out` by F on the left.
    """

    value: Raw
    jacobian: Raw | None
    params: Array
    inputs: int = 0
    noise: Raw | None = None
    advance: Raw | None = None
    carry: Raw | None = None
    helpers: tuple[Callable[..., Any], ...] = ()


def evaluate(function: Raw, x: Array, u: Array, dt: float, params: Array, size: int) -> Array:
    """Call a raw function from Python: (size,)."""
    out = np.zeros(size)
    function(x, u, dt, params, out)
    return out


@dataclass(frozen=True, slots=True)
class Loss:
    """A robust loss on the whitened residual norm r: `Loss("huber", 1.345)`, `Loss("cauchy", 1.0)`.

    Both act through the weight w(r) on the information: Huber min(1, k/r), Cauchy k²/(k²+r²)
    (Zhang 1997, Parameter estimation techniques, table 1; the same constants as GTSAM's estimators).
    """

    kind: str
    k: float

    def __post_init__(self) -> None:
        if self.kind not in {"huber", "cauchy"} or not self.k > 0:
            msg = f"a loss is Loss('huber' | 'cauchy', k > 0), got Loss({self.kind!r}, {self.k})"
            raise ModelError(msg)

    @property
    def code(self) -> int:
        """Number by which kernels know the kind."""
        return {"huber": 1, "cauchy": 2}[self.kind]


@dataclass(frozen=True, slots=True, eq=False)
class Gaussian:
    """A belief: mean (n,) on the manifold, covariance (d, d) in the tangent at the mean."""

    mean: Array
    cov: Array

    def __post_init__(self) -> None:
        mean = frozen(np.atleast_1d(np.asarray(self.mean, dtype=np.float64)))
        if mean.ndim != 1:
            msg = f"a mean has shape (n,), got {mean.shape}"
            raise ShapeError(msg)
        if not np.all(np.isfinite(mean)):
            msg = "the mean of a Gaussian holds NaN or infinity"
            raise NotFiniteError(msg)
        given = np.asarray(self.cov, dtype=np.float64)
        dim = len(given) if given.ndim else len(mean)
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "cov", require_covariance(given, dim, "the covariance of a Gaussian"))


class ProcessModel(abc.ABC):
    """How a state moves.  Final classes in `sequential.models`; users write `Process(step=…)`."""

    linear: bool = False

    @abc.abstractmethod
    def functions(self, manifold: Manifold) -> Functions:
        """The process lowered onto `manifold`; raises `ModelError` where the two do not fit."""

    def require_inputs(self, values: Array, where: str) -> None:  # noqa: B027 - most take any input
        """Raise `DataError` where inputs (N, m) are not what the process can take; `where` names them."""


class SensorModel(abc.ABC):
    """What a sensor sees.  Final classes in `sequential.models`; users write `Sensor(observe=…)`."""

    manifold: Manifold
    noise_cov: Array
    gate: float | None = None
    loss: Loss | None = None
    linear: bool = False

    @abc.abstractmethod
    def functions(self, manifold: Manifold) -> Functions:
        """The sensor lowered onto the state's `manifold`; raises `ModelError` where the two do not fit."""


@dataclass(frozen=True, eq=False)
class StateSpace:
    """The declaration that every estimator takes.

    Parameters
    ----------
    manifold : where the state lives
    prior : belief at `start`
    process : how the state moves between readings
    sensors : one model for each stream of the log that is to be used, by the stream's name
    input : stream that drives the process, or None
    start : time of the prior, float seconds or int nanoseconds; None is the first stamp of the log
    static : names of parts of a product manifold that do not move: one variable each in a factor graph
    check : compare declared Jacobians with central differences now

    Raises
    ------
    ModelError, ShapeError, NotPositiveDefiniteError, JacobianMismatchError
    """

    manifold: Manifold
    prior: Gaussian
    process: ProcessModel
    sensors: Mapping[str, SensorModel]
    input: str | None = None
    start: float | int | None = None
    static: tuple[str, ...] = ()
    check: bool = True
    process_functions: Functions = field(init=False, repr=False)
    sensor_functions: Mapping[str, Functions] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        n, d = self.manifold.size, self.manifold.dim
        if self.prior.mean.shape != (n,) or self.prior.cov.shape != (d, d):
            msg = (
                f"the manifold stores {n} numbers with {d} tangent directions; the prior has a mean of "
                f"shape {self.prior.mean.shape} and a covariance of shape {self.prior.cov.shape}"
            )
            raise ShapeError(msg)
        self.manifold.check(self.prior.mean)
        object.__setattr__(self, "sensors", dict(self.sensors))
        object.__setattr__(self, "process_functions", self.process.functions(self.manifold))
        lowered = {name: sensor.functions(self.manifold) for name, sensor in self.sensors.items()}
        object.__setattr__(self, "sensor_functions", lowered)
        if self.process_functions.inputs and self.input is None:
            msg = f"{type(self.process).__name__} is driven by an input; name its stream with input=…"
            raise ModelError(msg)
        known = set(getattr(self.manifold, "parts", {}))
        if unknown := [name for name in self.static if name not in known]:
            msg = f"static parts {unknown} are not parts of the state; it has {sorted(known) or 'none'}"
            raise ModelError(msg)
        if self.check:
            from sequential.jacobians import check_jacobians

            check_jacobians(self)

    @property
    def start_ns(self) -> int | None:
        """Time of the prior in nanoseconds, or None."""
        return None if self.start is None else int(nanoseconds(self.start))


def vector_or(manifold: Manifold | None, size: int) -> Manifold:
    """A manifold as given, or the plain vector space of `size` numbers."""
    return Vector(size) if manifold is None else manifold


def as_params(*values: ArrayLike) -> Array:
    """Numbers of a model in one flat read-only array; never empty, so that its address is valid."""
    flat = [np.ravel(np.asarray(v, dtype=np.float64)) for v in values]
    return frozen(np.concatenate([*flat, np.zeros(1)]))
