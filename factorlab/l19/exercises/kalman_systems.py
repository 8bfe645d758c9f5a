"""The small systems on which a Kalman filter is tried, and the filter itself in the letters of the course."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "EXAMPLE",
    "ONE",
    "SYSTEMS",
    "THREE",
    "TWO",
    "Array",
    "ReferenceKalman",
    "System",
    "constant_velocity",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class System:
    """Matrices of a linear system, and a few commands and measurements to drive it with."""

    F: Array
    B: Any  # (n, p)
    H: Array
    Q: Array
    R: Array
    x0: Array
    P0: Array
    commands: Array
    measurements: Array

    @property
    def n(self) -> int:
        """Size of the state."""
        return len(self.x0)

    @property
    def m(self) -> int:
        """Size of a measurement."""
        return len(self.H)

    def arguments(self, style: str) -> list[Any]:
        """What Kalman(…) is called with; copies, the state as a column where the style asks for it."""
        x0 = self.x0[:, None] if style == "colonnes" else self.x0
        B = None if self.B is None else self.B.copy()
        return [self.F.copy(), B, self.H.copy(), self.Q.copy(), self.R.copy(), x0.copy(), self.P0.copy()]


def styled(vector: Array, style: str) -> Any:
    """A command or a measurement as the style hands it over."""
    if style == "colonnes":
        return vector[:, None].copy()
    return float(vector[0]) if style == "nombres" and len(vector) == 1 else vector.copy()


def _system(F: Any, B: Any, H: Any, Q: Any, R: Any, x0: Any, P0: Any, u: Any, z: Any) -> System:
    return System(*(np.array(one, float) for one in (F, B, H, Q, R, x0, P0, u, z)))


# S = 10, K = (0.5, 0.1), x⁺ = (3, 3.2), NIS = 0.4: numbers that can be checked in the head
EXAMPLE = _system(
    [[1, 1], [0, 1]], [[0.5], [1]], [[1, 0]], [[1, 0], [0, 2]], [[5]], [0, 1], [[3, 0], [0, 1]],
    [[2], [-1], [0.5]], [[4], [3], [8]],
)  # fmt: skip
ONE = _system(
    [[0.9]], [[0.5]], [[2]], [[0.3]], [[0.6]], [1], [[2]], [[1], [3], [-2]], [[2.5], [4], [1]],
)  # fmt: skip
# two measurements of a state of two, nothing symmetric that need not be: transposes show
TWO = _system(
    [[1, 0.5], [-0.2, 0.9]], [[0.1], [0.4]], [[1, 0.5], [0, 2]], [[0.2, 0.05], [0.05, 0.1]],
    [[0.5, 0.2], [0.2, 0.8]], [1, -1], [[2, 0.5], [0.5, 1]],
    [[1], [0.5], [-1]], [[0.5, -1], [1, 0.3], [2, -2]],
)  # fmt: skip
THREE = _system(
    [[1, 0.1, 0.3], [0, 1, 0.1], [0, 0.2, 0.8]], [[0.1, 0], [1, 0.2], [0, 0.5]],
    [[1, 0, 0.5], [0, 1, -1]], [[0.3, 0.1, 0], [0.1, 0.4, 0.05], [0, 0.05, 0.2]],
    [[0.7, 0.1], [0.1, 0.4]], [0, 1, 2], [[2, 0.3, 0.1], [0.3, 1, 0.2], [0.1, 0.2, 1.5]],
    [[1, 2], [0, -1], [0.5, 0.5]], [[1, 0], [2, -1], [0.5, 1]],
)  # fmt: skip
SYSTEMS = (EXAMPLE, ONE, TWO, THREE)


def constant_velocity(steps: int, rng: np.random.Generator) -> System:
    """The statement's system: constant velocity in 1-D, its position measured; commands are accelerations."""
    dt, q, sigma = 0.1, 0.2, 0.5
    F, B, H = np.array([[1, dt], [0, 1]]), np.array([[dt**2 / 2], [dt]]), np.array([[1.0, 0.0]])
    Q, R = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]), np.array([[sigma**2]])
    x0, P0 = np.zeros(2), np.diag([4.0, 1.0])
    commands = 2.0 * np.sin(0.2 * np.arange(steps))[:, None]
    x, measured = rng.multivariate_normal(x0, P0), []
    for u in commands:
        x = F @ x + B @ u + rng.multivariate_normal(np.zeros(2), Q)
        measured.append(H @ x + sigma * rng.standard_normal(1))
    return System(F, B, H, Q, R, x0, P0, commands, np.array(measured))


class ReferenceKalman:
    """The filter by its equations; `returns` says in which form `corriger` gives its innovation."""

    def __init__(self, system: System, returns: str = "nis") -> None:
        s = system
        self.F, self.B, self.H, self.Q, self.R = s.F, s.B, s.H, s.Q, s.R
        self.x, self.P = s.x0.copy(), s.P0.copy()
        self.returns = returns

    def predire(self, u: Any = None) -> None:
        """x ← F x + B u, P ← F P Fᵀ + Q."""
        pushed = 0.0 if u is None or self.B is None else self.B @ np.ravel(u)
        self.x, self.P = self.F @ self.x + pushed, self.F @ self.P @ self.F.T + self.Q

    def corriger(self, z: Any) -> Any:
        """Take a measurement; its NIS, or the innovation divided by its σ."""
        self.y = np.ravel(z) - self.H @ self.x
        self.S = self.H @ self.P @ self.H.T + self.R
        self.K = self.P @ self.H.T @ np.linalg.inv(self.S)
        self.x, self.P = self.x + self.K @ self.y, (np.eye(len(self.x)) - self.K @ self.H) @ self.P
        white = np.linalg.solve(np.linalg.cholesky(self.S), self.y)
        return float(white @ white) if self.returns == "nis" else white
