"""Normal equations of a chain with a border: frames in a row, and markers that any frame may see.

    H = [ chain   E ]      chain: blocks (n, n) on the diagonal and beside it
        [ Eᵀ      C ]      border: everything that does not move

Eliminating the frames one after the other costs time linear in their number, and one pass back gives every
marginal covariance together with those of the border (Rauch-Tung-Striebel with a border; the elimination is
that of a bundle adjustment, Triggs et al. 2000, section 6, with the chain's own coupling kept).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from sequential.errors import UnderConstrainedError

__all__ = ["BorderedChain", "BorderedSolution"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BorderedSolution:
    """The step, and what the covariances need."""

    chain: Array  # (K, n)
    border: Array  # (q,)
    inverse: Array  # (K, n, n) of the pivots
    links: Array  # (K, n, n + q) or (K, n, q): the pivot's inverse times its row to the right
    reduced: Array  # (q, q) what is left of the border's information

    def covariances(self) -> tuple[Array, Array]:
        """Marginals (K, n, n) of the chain, and the joint (q, q) of the border."""
        count, n = self.chain.shape
        border = _inverse(self.reduced, "the markers together")
        links, cov = self.links, np.empty((count, n, n))
        if links.shape[2] == len(border):  # frames are independent given the border
            return self.inverse + links @ border @ links.transpose(0, 2, 1), border
        joint = np.zeros((n + len(border),) * 2)
        joint[n:, n:] = border
        for k in range(count - 1, -1, -1):
            cross = links[k] @ joint
            here = self.inverse[k] + cross @ links[k].T
            cov[k] = 0.5 * (here + here.T)
            joint[:n, :n] = cov[k]
            joint[:n, n:] = -cross[:, n:]
            joint[n:, :n] = joint[:n, n:].T
        return cov, border


@dataclass(frozen=True, eq=False)
class BorderedChain:
    """Information and gradient.

    Parameters
    ----------
    diagonal : (K, n, n)
    beside : (K-1, n, n) between each node and the next, or None where nodes are independent
    edge : (K, n, q) between nodes and border
    corner : (q, q)
    gradient : (K, n), border_gradient : (q,)
    """

    diagonal: Array
    beside: Array | None
    edge: Array
    corner: Array
    gradient: Array
    border_gradient: Array

    def damped(self, share: float) -> BorderedChain:
        """Marquardt's: the diagonal raised by a share of itself."""
        diagonal, corner = self.diagonal.copy(), self.corner.copy()
        rows, border = np.arange(diagonal.shape[1]), np.arange(len(corner))
        diagonal[:, rows, rows] *= 1.0 + share
        corner[border, border] *= 1.0 + share
        return BorderedChain(diagonal, self.beside, self.edge, corner, self.gradient, self.border_gradient)

    def solve(self) -> BorderedSolution:
        """The step that takes the gradient to zero.

        Raises
        ------
        UnderConstrainedError
            naming the node that is free.
        """
        scale = 1.0 / np.sqrt(np.maximum(np.einsum("kii->ki", self.diagonal), 1e-300))
        edge_scale = 1.0 / np.sqrt(np.maximum(np.diagonal(self.corner), 1e-300))
        diagonal = self.diagonal * scale[:, :, None] * scale[:, None, :]
        edge = self.edge * scale[:, :, None] * edge_scale
        corner = self.corner * np.outer(edge_scale, edge_scale)
        gradient, tail = self.gradient * scale, self.border_gradient * edge_scale
        if self.beside is None:
            solution = _independent(diagonal, edge, corner, gradient, tail)
        else:
            beside = self.beside * scale[:-1, :, None] * scale[1:, None, :]
            solution = _chained(diagonal, beside, edge, corner, gradient, tail)
        return _unscaled(solution, scale, edge_scale, chained=self.beside is not None)


def _independent(D: Array, E: Array, C: Array, g: Array, b: Array) -> BorderedSolution:
    """Frames that share only the border."""
    count, n, q = E.shape
    try:
        np.linalg.cholesky(D)
    except np.linalg.LinAlgError:
        _name_free(D)
    inverse = np.linalg.inv(D)
    inverse = 0.5 * (inverse + inverse.transpose(0, 2, 1))
    links = inverse @ E
    reduced = C - E.reshape(count * n, q).T @ links.reshape(count * n, q)
    own = np.einsum("kij,kj->ki", inverse, g)
    tail = b - np.einsum("kiq,ki->q", E, own)
    border = -_inverse(reduced, "the markers together") @ tail if len(C) else np.zeros(0)
    return BorderedSolution(-own - links @ border, border, inverse, links, reduced)


def _chained(D: Array, B: Array, E: Array, C: Array, g: Array, b: Array) -> BorderedSolution:
    count, n, q = E.shape
    rhs = np.zeros((count, n, 2 * n + q + 1))  # pivot⁻¹ [I, beside, edge, gradient]
    pivot, edge, gradient = D[0].copy(), E[0].copy(), g[0].copy()
    corner, tail, eye = C.copy(), b.copy(), np.eye(n)
    for k in range(count):
        row = rhs[k]
        row[:, :n] = eye
        if k + 1 < count:
            row[:, n : 2 * n] = B[k]
        row[:, 2 * n : -1], row[:, -1] = edge, gradient
        _, solved, fault = dposv(pivot, row)
        if fault:
            _name_free(pivot[None], k)
        rhs[k] = solved
        corner -= edge.T @ solved[:, 2 * n : -1]
        tail -= edge.T @ solved[:, -1]
        if k + 1 < count:
            pivot = D[k + 1] - B[k].T @ solved[:, n : 2 * n]
            edge = E[k + 1] - B[k].T @ solved[:, 2 * n : -1]
            gradient = g[k + 1] - B[k].T @ solved[:, -1]
            pivot = 0.5 * (pivot + pivot.T)
    border = -_inverse(corner, "the markers together") @ tail if q else np.zeros(0)
    step = np.empty((count, n))
    step[-1] = -rhs[-1, :, -1] - rhs[-1, :, 2 * n : -1] @ border
    for k in range(count - 2, -1, -1):
        step[k] = -rhs[k, :, -1] - rhs[k, :, n : 2 * n] @ step[k + 1] - rhs[k, :, 2 * n : -1] @ border
    return BorderedSolution(step, border, rhs[:, :, :n], rhs[:, :, n:-1], corner)


def _unscaled(
    solution: BorderedSolution, scale: Array, edge_scale: Array, *, chained: bool
) -> BorderedSolution:
    right = np.broadcast_to(1.0 / edge_scale, (len(scale), len(edge_scale)))
    if chained:
        after = np.vstack([scale[1:], np.ones_like(scale[:1])])
        right = np.hstack([1.0 / after, right])
    return BorderedSolution(
        solution.chain * scale,
        solution.border * edge_scale,
        solution.inverse * scale[:, :, None] * scale[:, None, :],
        solution.links * scale[:, :, None] * right[:, None, :],
        solution.reduced / np.outer(edge_scale, edge_scale),
    )


def _inverse(information: Array, what: str) -> Array:
    """Inverse of a symmetric positive definite matrix, by its scaled self."""
    if not len(information):
        return np.zeros((0, 0))
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(information), 1e-300))
    _, inverse, fault = dposv(information * np.outer(scale, scale), np.eye(len(information)))
    if fault:
        raise UnderConstrainedError(
            f"the measurements leave {what} free; more frames have to show them beside each other"
        )
    inverse = inverse * np.outer(scale, scale)
    symmetric: Array = 0.5 * (inverse + inverse.T)
    return symmetric


def _name_free(blocks: Array, first: int = 0) -> None:
    """Raise for the first block that has no Cholesky factor."""
    for k, block in enumerate(blocks):
        try:
            np.linalg.cholesky(block)
        except np.linalg.LinAlgError:
            raise UnderConstrainedError(
                f"frame {first + k} is free: no marker and no motion says where it is; leave it out"
            ) from None
