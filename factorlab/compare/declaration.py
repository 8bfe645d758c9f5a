"""What `FILE.py:NAME` declares: a model, the numbers that may be tuned, and how to build it from them."""

from __future__ import annotations

import importlib.util
import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from sequential.errors import FactorlabError, ModelError
from sequential.jacobians import unchecked
from sequential.model import StateSpace, evaluate
from sequential.tuning import Knob, noise_knobs, scaled

__all__ = ["Declaration", "load_declaration", "noise_kind"]

Build = Callable[[Mapping[str, float]], StateSpace]


@dataclass(frozen=True, slots=True, eq=False)
class Declaration:
    """A model, the knobs of its noise, and `build(values)`."""

    model: StateSpace
    knobs: tuple[Knob, ...]
    build: Build


def load_declaration(spec: str) -> Declaration:
    """The declaration that `FILE.py:NAME` names.

    NAME is a `StateSpace`, or a function that returns one: without arguments; with numbers as defaults,
    `def model(acceleration=0.04, sigma=0.2)`, where each one that changes nothing but noise is a knob; or
    with one argument, the values by name, beside `KNOBS = {"sigma": 0.2}`, or a list of `Knob`, in the same
    file.  A model that names no number gets one factor on its process noise and one on each sensor's.

    Raises
    ------
    ModelError
        where the file cannot be run, has no such name, or the name is something else.
    """
    file, _, name = spec.rpartition(":")
    if not file or not name.isidentifier():
        msg = f"--model is FILE.py:NAME, such as robot.py:MODEL; got {spec!r}"
        raise ModelError(msg)
    module = _run_file(Path(file))
    found = getattr(module, name, None)
    if found is None:
        names = [key for key, value in vars(module).items() if not key.startswith("_")]
        near = get_close_matches(name, names, n=1, cutoff=0.5)
        spaces = [key for key in names if isinstance(getattr(module, key), StateSpace)]
        hint = f"did you mean {near[0]!r}?" if near else f"its models are {', '.join(spaces) or 'none'}"
        msg = f"{file} declares no {name!r}; {hint}"
        raise ModelError(msg)
    if isinstance(found, StateSpace):
        return _plain(found)
    if inspect.isfunction(found):
        return _from_function(found, module, file, name)
    msg = f"{file}: {name} is a {type(found).__name__}; {WANTED}, is needed"
    raise ModelError(msg)


WANTED = "a StateSpace, or a function without arguments that returns one"


def _plain(model: StateSpace) -> Declaration:
    return Declaration(model, noise_knobs(model), lambda values: scaled(model, values))


def _from_function(function: Callable[..., Any], module: ModuleType, file: str, name: str) -> Declaration:
    parameters = list(inspect.signature(function).parameters.values())
    needed = [
        p for p in parameters if p.default is p.empty and p.kind not in {p.VAR_KEYWORD, p.VAR_POSITIONAL}
    ]
    if len(needed) == 1 and hasattr(module, "KNOBS"):
        knobs = _knobs(module.KNOBS, file)

        def from_values(values: Mapping[str, float]) -> StateSpace:
            return _model(function(dict(values)), file, name)

        return Declaration(from_values({k.name: k.initial for k in knobs}), knobs, from_values)
    if needed:
        hint = (
            f"; {name}({needed[0].name}) would do beside KNOBS = {{name: value}}" if len(needed) == 1 else ""
        )
        msg = f"{file}: {name} is a function; {WANTED}, is needed{hint}"
        raise ModelError(msg)
    numbers = {p.name: p.default for p in parameters if type(p.default) is float and p.default > 0.0}

    def from_arguments(values: Mapping[str, float]) -> StateSpace:
        return _model(function(**values), file, name)

    model = from_arguments({})
    knobs = tuple(
        Knob(key, value) for key, value in numbers.items() if _is_noise(model, from_arguments, key, value)
    )
    return Declaration(model, knobs, from_arguments) if knobs else _plain(model)


def _model(made: Any, file: str, name: str) -> StateSpace:
    if isinstance(made, StateSpace):
        return made
    msg = f"{file}: {name}() returned a {type(made).__name__}; a StateSpace is needed"
    raise ModelError(msg)


def _is_noise(model: StateSpace, build: Build, name: str, value: float) -> bool:
    """Whether an argument changes noise, and nothing else."""
    try:
        with unchecked():
            return bool(noise_kind(model, build({name: 1.5 * value})))
    except FactorlabError:
        return False


def noise_kind(before: StateSpace, after: StateSpace) -> str:
    """What differs between two models: "process" or "sensor" noise, both ("noise"), or "" for the rest."""
    same = before.manifold == after.manifold and list(before.sensors) == list(after.sensors)
    if not same or not all(
        np.allclose(a, b, rtol=1e-12, atol=0) for a, b in zip(*map(_motion, (before, after)), strict=True)
    ):
        return ""
    sensor = any(
        not np.array_equal(one.noise_cov, after.sensors[name].noise_cov)
        for name, one in before.sensors.items()
    )
    process = not np.allclose(_process_noise(before), _process_noise(after), rtol=1e-9, atol=0)
    return {(True, True): "noise", (True, False): "sensor", (False, True): "process"}.get(
        (sensor, process), ""
    )


def _motion(model: StateSpace) -> list[Any]:
    """Prior, one step and one sight of each sensor: what a noise does not change."""
    x, f = model.prior.mean, model.process_functions
    ahead = evaluate(f.value, x, np.ones(max(f.inputs, 1)), 1.0, f.params, model.manifold.size)
    seen = [
        evaluate(g.value, x, np.zeros(max(g.inputs, 1)), 0.0, g.params, model.sensors[name].manifold.size)
        for name, g in model.sensor_functions.items()
    ]
    return [x, model.prior.cov, ahead, *seen]


def _process_noise(model: StateSpace) -> Any:
    f, d = model.process_functions, model.manifold.dim
    if f.noise is None:
        return np.zeros(1)
    return evaluate(f.noise, model.prior.mean, np.ones(max(f.inputs, 1)), 1.0, f.params, d * d)


def _knobs(given: Any, file: str) -> tuple[Knob, ...]:
    """`KNOBS` of a file as knobs: a mapping from names to values, or knobs in a row."""
    if isinstance(given, Mapping):
        try:
            return tuple(Knob(str(name), float(value)) for name, value in given.items())
        except (TypeError, ValueError) as error:
            msg = f"{file}: KNOBS gives each name a positive number; {error}"
            raise ModelError(msg) from None
    if isinstance(given, list | tuple) and given and all(isinstance(one, Knob) for one in given):
        return tuple(given)
    msg = f"{file}: KNOBS is a mapping from names to values, or a list of Knob; got {type(given).__name__}"
    raise ModelError(msg)


def _run_file(path: Path) -> ModuleType:
    if not path.is_file():
        near = get_close_matches(path.name, [p.name for p in path.parent.glob("*.py")], n=1)
        hint = f"did you mean {path.parent / near[0]}?" if near else "--model takes FILE.py:NAME"
        msg = f"there is no file {path}; {hint}"
        raise ModelError(msg)
    made = importlib.util.spec_from_file_location(path.stem, path)
    if made is None or made.loader is None:
        msg = f"{path} is not a Python file; --model takes FILE.py:NAME"
        raise ModelError(msg)
    module = importlib.util.module_from_spec(made)
    sys.path.insert(0, str(path.parent.resolve()))  # as if the file were run: it may import its neighbours
    try:
        made.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        line = _line_in(path, error)
        msg = f"{path}{line} raised {type(error).__name__}: {error}"
        raise ModelError(msg) from error
    finally:
        sys.path.pop(0)
    return module


def _line_in(path: Path, error: BaseException) -> str:
    """`, line 12`: the last line of the user's own file on the way to an error."""
    if isinstance(error, SyntaxError):
        return f", line {error.lineno}"
    trace, last = error.__traceback__, None
    while trace is not None:
        if Path(trace.tb_frame.f_code.co_filename) == path:
            last = trace.tb_lineno
        trace = trace.tb_next
    return f", line {last}" if last else ""
