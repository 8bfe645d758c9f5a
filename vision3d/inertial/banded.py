"""Normal equations of a trajectory with an arrow: a band of control values, and a border of what is constant.

Every row of residuals touches `order` control values in a row, the constants, and two nodes of the biases.
The band is eliminated by a banded Cholesky factor; the Schur complement of the border is small, and its
inverse is the covariance of calibration and biases with the trajectory marginalised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from sequential.errors import UnderConstrainedError
from vision3d.inertial.rows import Rows

__all__ = ["ArrowSystem", "Solved"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
CHUNK = 512
POSE = 6  # a control value: rotation, translation
BIAS = 6  # a node: gyro, accelerometer
FREE = 1e-2
"""Information that every control value has, 1/rad² and 1/m²: it keeps what no reading sees from drifting."""


@dataclass(frozen=True, eq=False)
class Solved:
    """A step of all unknowns: controls (K, 6), constants (q,), nodes (B, 6)."""

    controls: Array
    constants: Array
    nodes: Array


class ArrowSystem:
    """H x = -g, filled by `add`, solved by `solve`.

    Parameters
    ----------
    knots : K, control values
    constants : q
    nodes : B, of the biases
    order : control values that a row touches
    """

    def __init__(self, knots: int, constants: int, nodes: int, order: int) -> None:
        self.knots, self.constants, self.nodes, self.order = knots, constants, nodes, order
        self.border = constants + BIAS * nodes
        self.blocks = np.zeros((order, knots, POSE, POSE))  # [l, k]: control k by control k + l
        self.cross = np.zeros((knots, POSE, self.border))
        self.corner = np.zeros((self.border, self.border))
        self.g_knots = np.zeros((knots, POSE))
        self.g_border = np.zeros(self.border)
        self._factor: tuple[Array, Array, Array, Array, Array] | None = None

    def add(self, rows: Rows) -> None:
        """Add JᵀWJ and JᵀWe of rows."""
        for part in rows.by_interval(CHUNK):
            weighted = part.J * part.weight[..., None]
            H = np.swapaxes(weighted, -1, -2) @ part.J
            g = np.einsum("sml,sm->sl", weighted, part.e)
            self._scatter(part.first, part.node, H, g)

    def add_gradient(self, rows: Rows) -> None:
        """Add JᵀWe alone."""
        n, q = POSE * self.order, self.constants
        for part in rows.by_interval(CHUNK):
            g = np.einsum("sml,sm,sm->sl", part.J, part.weight, part.e)
            for a in range(self.order):
                self.g_knots[part.first + a] += g[:, POSE * a : POSE * (a + 1)]
            self.g_border[:q] += g[:, n : n + q].sum(axis=0)
            np.add.at(self.g_border, q + BIAS * part.node[:, None] + np.arange(2 * BIAS), g[:, n + q :])

    def _scatter(self, first: Integers, node: Integers, H: Array, g: Array) -> None:
        """Put blocks (S, L, L) of intervals, each once, where they belong."""
        n, q = POSE * self.order, self.constants
        slots = q + BIAS * node[:, None] + np.arange(2 * BIAS)
        for a in range(self.order):
            mine = slice(POSE * a, POSE * (a + 1))
            self.g_knots[first + a] += g[:, mine]
            for b in range(a, self.order):
                self.blocks[b - a, first + a] += H[:, mine, POSE * b : POSE * (b + 1)]
            self.cross[first + a, :, :q] += H[:, mine, n : n + q]
            self.cross[(first + a)[:, None, None], np.arange(POSE)[:, None], slots[:, None, :]] += H[
                :, mine, n + q :
            ]
        self.g_border[:q] += g[:, n : n + q].sum(axis=0)
        np.add.at(self.g_border, slots, g[:, n + q :])
        self.corner[:q, :q] += H[:, n : n + q, n : n + q].sum(axis=0)
        across = np.zeros((q, self.border))
        np.add.at(across.T, slots, np.swapaxes(H[:, n : n + q, n + q :], 1, 2))
        self.corner[:q] += across
        self.corner[:, :q] += across.T
        np.add.at(self.corner, (slots[:, :, None], slots[:, None, :]), H[:, n + q :, n + q :])

    def add_border(self, H: Array, g: Array) -> None:
        """Add a prior on constants and nodes."""
        self.corner += H
        self.g_border += g

    def factor(self, damping: float = 0.0) -> None:
        """Factor with `damping` times the diagonal added.

        Raises
        ------
        UnderConstrainedError
            where the matrix is not positive definite: something is left free.
        """
        size, width = POSE * self.knots, POSE * self.order
        diagonal = np.einsum("kii->ki", self.blocks[0]).ravel()
        floor = np.maximum(FREE, 1e-12 * diagonal)
        scale = 1.0 / np.sqrt(np.maximum(diagonal, 1e-12 * diagonal.max()))
        band = np.zeros((width, size))
        for l in range(self.order):
            for i in range(POSE):
                for j in range(POSE):
                    offset = POSE * l + j - i
                    if offset >= 0:  # the lower band of a symmetric matrix: row offset, column of the earlier
                        band[offset, i : size - POSE * l : POSE] = self.blocks[l, : self.knots - l, i, j]
        band[0] += damping * diagonal + floor
        for offset in range(width):
            band[offset, : size - offset] *= scale[: size - offset] * scale[offset:]
        corner = self.corner.copy()
        own = np.maximum(np.diagonal(corner), 1e-300)
        corner[np.diag_indices(self.border)] += damping * own
        try:
            chol = cholesky_banded(band, lower=True, check_finite=False)
            flat = self.cross.reshape(size, self.border) * scale[:, None]
            solved = cho_solve_banded((chol, True), flat, check_finite=False)
            schur = corner - flat.T @ solved
            border_scale = 1.0 / np.sqrt(own)
            schur = schur * np.outer(border_scale, border_scale)
            lower = np.linalg.cholesky(0.5 * (schur + schur.T))
        except (LinAlgError, np.linalg.LinAlgError) as fault:
            raise UnderConstrainedError(
                "the measurements leave a part of calibration or trajectory free"
            ) from fault
        self._factor = chol, solved, lower, scale, border_scale

    def solve(self, g_knots: Array | None = None, g_border: Array | None = None) -> Solved:
        """The step -H⁻¹ g, for the gradient of the rows or another one."""
        assert self._factor is not None, "factor first"  # noqa: S101
        chol, solved, lower, scale, border_scale = self._factor
        top = (self.g_knots if g_knots is None else g_knots).ravel() * scale
        border = self.g_border if g_border is None else g_border
        rest = (border - solved.T @ top) * border_scale
        y = np.linalg.solve(lower.T, np.linalg.solve(lower, rest)) * border_scale
        x = (cho_solve_banded((chol, True), top, check_finite=False) - solved @ y) * scale
        return Solved(
            -x.reshape(self.knots, POSE), -y[: self.constants], -y[self.constants :].reshape(-1, BIAS)
        )

    @property
    def border_cov(self) -> Array:
        """(q + 6 B, q + 6 B) covariance of constants and nodes, the trajectory marginalised."""
        assert self._factor is not None, "factor first"  # noqa: S101
        _, _, lower, _, border_scale = self._factor
        inverse = np.linalg.solve(lower, np.diag(border_scale))
        return np.asarray(inverse.T @ inverse)
