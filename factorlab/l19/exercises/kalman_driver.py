"""Driving a student's filter: where its state is, how it likes its vectors, what it did step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from factorlab.l19.exercises.calling import Caller
from factorlab.l19.exercises.fault import Fault, Stumble
from factorlab.l19.exercises.kalman_systems import Array, System, styled

__all__ = ["STYLES", "Drive", "Driver", "NoStateError", "Stage", "drive"]

STYLES = ("vecteurs", "colonnes", "nombres")
STATE_NAMES = ("x", "X", "x_hat", "xhat", "x_est", "etat", "état", "state", "mu", "m")
COV_NAMES = ("P", "p", "cov", "Sigma", "sigma", "covariance", "P_hat", "P_est")


class NoStateError(Exception):
    """No attribute of the filter holds x0, or none holds P0."""


@dataclass(frozen=True)
class Stage:
    """One call: the state it began with, what it was given, and the state it left behind."""

    kind: str
    x: Array
    P: Array
    given: Array
    after_x: Array
    after_P: Array
    returned: Any = None


@dataclass(frozen=True)
class Drive:
    """The calls of a drive that came back, and the fault that ended it early, if one did."""

    system: System
    style: str
    stages: tuple[Stage, ...]
    fault: Fault | None = None
    at: str = ""

    def of(self, kind: str) -> list[Stage]:
        """The predictions, or the corrections."""
        return [stage for stage in self.stages if stage.kind == kind]


class Driver:
    """A filter of a student's class, with its state read as arrays.

    Raises
    ------
    Stumble, NoStateError
    """

    def __init__(self, made: Any, call: Caller, system: System, style: str) -> None:
        self.system, self.style, self.call = system, style, call
        self.kf = call(made, *system.arguments(style))
        self.state = self._named(STATE_NAMES, system.x0)
        self.cov = self._named(COV_NAMES, system.P0)
        self.first = self.state, self.cov
        self.foreseen: tuple[str, str] | None = None

    def predict(self, u: Array) -> Stage:
        """Call predire(u)."""
        x, P = self.read()
        before = self._arrays()
        returned = self.call(self.kf.predire, styled(u, self.style))
        self._follow(x, P, before)
        return Stage("predire", x, P, u, *self.read(), returned)

    def correct(self, z: Array) -> Stage:
        """Call corriger(z)."""
        x, P = self.read()
        returned = self.call(self.kf.corriger, styled(z, self.style))
        self.state, self.cov = self.first
        return Stage("corriger", x, P, z, *self.read(), returned)

    def read(self) -> tuple[Array, Array]:
        """The state as a vector and its covariance as the filter has it, copies."""
        n = self.system.n
        x = np.array(getattr(self.kf, self.state), float)
        P = np.array(getattr(self.kf, self.cov), float)
        return (x.ravel() if x.size == n else x), (P.reshape(n, n) if P.size == n * n else P)

    def _named(self, names: tuple[str, ...], value: Array) -> str:
        for name in (*names, *self._attributes()):
            if _holds(getattr(self.kf, name, None), value):
                return name
        raise NoStateError

    def _attributes(self) -> list[str]:
        return [*getattr(self.kf, "__dict__", {}), *getattr(type(self.kf), "__slots__", ())]

    def _arrays(self) -> dict[str, Array]:
        """Copies of what the filter holds that is an array of numbers."""
        found = {name: _array(getattr(self.kf, name, None)) for name in self._attributes()}
        return {name: value.copy() for name, value in found.items() if value is not None}

    def _follow(self, x: Array, P: Array, before: dict[str, Array]) -> None:
        """Some keep the prediction under another name, and only corriger changes x and P."""
        if self.foreseen is not None:
            self.state, self.cov = self.foreseen
            return
        after_x, after_P = self.read()
        if not (np.array_equal(after_x, x) and np.array_equal(after_P, P)):
            return
        for name, value in self._arrays().items():
            if name in before and np.array_equal(value, before[name]):
                continue
            if value.size == x.size and (x.size > 1 or "P" not in name):
                self.state = name
            elif value.size == P.size:
                self.cov = name
        if self.first[0] != self.state and self.first[1] != self.cov:
            self.foreseen = self.state, self.cov


def _in_shape(system: System, stage: Stage) -> bool:
    return stage.after_x.shape == (system.n,) and stage.after_P.shape == (system.n, system.n)


def _array(value: Any) -> Array | None:
    try:
        return None if value is None else np.asarray(value, float)
    except (TypeError, ValueError):
        return None


def _holds(value: Any, wanted: Array) -> bool:
    found = _array(value)
    return found is not None and found.size == wanted.size and np.allclose(found.ravel(), wanted.ravel())


def drive(made: Any, call: Caller, system: System, style: str) -> Drive:
    """Predict and correct with every command and measurement of a system, until something stumbles.

    Raises
    ------
    NoStateError
    """
    stages: list[Stage] = []
    at = "Kalman(…)"
    try:
        driver = Driver(made, call, system, style)
        for u, z in zip(system.commands, system.measurements, strict=True):
            at = "predire"
            stages.append(driver.predict(u))
            if not _in_shape(system, stages[-1]):
                break  # nothing can be said about what follows
            at = "corriger"
            stages.append(driver.correct(z))
            if not _in_shape(system, stages[-1]):
                break
    except Stumble as stumble:
        return Drive(system, style, tuple(stages), stumble.fault, at)
    except (TypeError, ValueError) as error:  # a state that is no array any more
        fault = Fault(type(error).__name__, f"l'état n'est plus un tableau de nombres ({error})")
        return Drive(system, style, tuple(stages), fault, at)
    return Drive(system, style, tuple(stages))
