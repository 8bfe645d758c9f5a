"""Canny's thin edges, and Hough's lines through them.

A line is all points with x cos θ + y sin θ = ρ: θ is the direction of its normal and ρ its distance from the
top-left pixel.  Every edge pixel votes for all lines through it; a line that many lie on is where votes peak.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from vision3d.image.gradients import sobel
from vision3d.image.pixels import Backend, as_bytes, as_mask, checked_backend

__all__ = ["Lines", "canny", "hough_lines"]


@dataclass(frozen=True)
class Lines:
    """Lines with their votes, most first.

    Attributes
    ----------
    rho_px : (n,) float32 distance from the pixel (0, 0), negative where the normal points away from it
    theta_rad : (n,) float32 direction of the normal: 0 for a line that stands, π/2 for one that lies
    votes : (n,) int32 edge pixels on it
    """

    rho_px: NDArray[np.float32]
    theta_rad: NDArray[np.float32]
    votes: NDArray[np.int32]

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.votes)

    def distance_px(self, points: ArrayLike) -> NDArray[np.float64]:
        """(n, m) signed distances of pixels (m, 2) from every line."""
        at = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        normals = np.stack([np.cos(self.theta_rad, dtype=float), np.sin(self.theta_rad, dtype=float)], axis=1)
        distances: NDArray[np.float64] = normals @ at.T - self.rho_px[:, None]
        return distances


def canny(
    image: ArrayLike, low: float, high: float, *, l2: bool = False, backend: Backend = "compiled"
) -> NDArray[np.uint8]:
    """Edges one pixel wide (Canny 1986; OpenCV: `Canny` with a window of 3), 255 on black.

    Smooth the image first where it is noisy.

    Parameters
    ----------
    image : (h, w) uint8
    low, high : lengths of the gradient, in Sobel's scale (8 times a level a pixel): an edge begins where the
        length exceeds `high` and goes on while it exceeds `low`
    l2 : take the true length instead of |dx| + |dy|
    """
    pixels = as_bytes(image)
    low, high = sorted((low, high))
    if low < 0:
        raise DataError(f"canny: thresholds ({low}, {high}); expected none below zero")
    if checked_backend(backend) == "opencv":
        import cv2

        return np.asarray(cv2.Canny(pixels, low, high, L2gradient=l2), np.uint8)
    from vision3d.kernels import image_edges

    dx, dy = (sobel(pixels, 1 - k, k, border="replicate", backend=backend).astype(np.int32) for k in range(2))
    if l2:
        low, high = min(low, 32767.0) ** 2, min(high, 32767.0) ** 2
    length = dx * dx + dy * dy if l2 else np.abs(dx) + np.abs(dy)
    edges = np.empty(pixels.shape, np.uint8)
    image_edges.ridges(np.pad(dx, 1), np.pad(dy, 1), np.pad(length, 1), floor(low), floor(high), edges)
    image_edges.hysteresis(edges)
    return edges


def hough_lines(
    edges: ArrayLike,
    least_votes: int,
    *,
    rho_px: float = 1.0,
    theta_rad: float = pi / 180,
    backend: Backend = "compiled",
) -> Lines:
    """Straight lines through edge pixels (Duda and Hart 1972; OpenCV: `HoughLines`).

    Parameters
    ----------
    edges : (h, w), set on edges
    least_votes : a line needs more than these, and more than its neighbours in ρ and θ
    rho_px, theta_rad : steps of the table of votes; fine ones part neighbours and scatter votes

    Returns
    -------
    Lines
        most votes first.
    """
    mask = as_mask(edges)
    if not 0 < rho_px < 1e4 or not 0 < theta_rad < pi:
        raise DataError(
            f"hough_lines: steps of {rho_px} px and {theta_rad} rad; expected 0 to 10⁴ and 0 to π"
        )
    if checked_backend(backend) == "opencv":
        import cv2

        found = cv2.HoughLinesWithAccumulator(mask, rho_px, theta_rad, int(least_votes))
        table = np.zeros((0, 3)) if found is None else np.asarray(found).reshape(-1, 3)
        rho, theta, count = table.T
        return Lines(rho.astype(np.float32), theta.astype(np.float32), count.astype(np.int32))
    cosine, sine, angles = _angles(rho_px, theta_rad)
    height, width = mask.shape
    distances = round(((width + height) * 2 + 1) / rho_px)
    votes = np.zeros((angles + 2, distances + 2), np.int32)  # a margin of zeros, for the peaks
    y, x = (at.astype(np.float32) for at in np.nonzero(mask))
    middle = (distances - 1) // 2
    if backend == "numpy":
        for k in range(angles):
            cell = np.rint(x * cosine[k] + y * sine[k]).astype(np.int64) + middle + 1
            votes[k + 1, :] = np.bincount(cell, minlength=distances + 2)
    else:
        from vision3d.kernels import image_edges

        image_edges.line_votes(x, y, cosine, sine, middle + 1, votes[1:-1])
    turn, shift = np.nonzero(_peaks(votes, least_votes))
    order = np.argsort(-votes[turn + 1, shift + 1], kind="stable")
    turn, shift = turn[order], shift[order]
    rho = (shift - middle).astype(np.float32) * np.float32(rho_px)
    return Lines(rho, turn.astype(np.float32) * np.float32(theta_rad), votes[turn + 1, shift + 1])


def _angles(rho_px: float, theta_rad: float) -> tuple[NDArray[np.float32], NDArray[np.float32], int]:
    """Cosines and sines over the step of ρ.  Angles add up in float32, as OpenCV's do."""
    count = floor(pi / theta_rad) + 1
    if count > 1 and abs(pi - (count - 1) * theta_rad) < theta_rad / 2:
        count -= 1  # the last one would be the first one turned
    steps = np.full(count, theta_rad, np.float32)
    steps[0] = 0.0
    angle = np.add.accumulate(steps, dtype=np.float32).astype(np.float64)
    scale = np.float32(1.0 / rho_px)
    return (np.cos(angle) * scale).astype(np.float32), (np.sin(angle) * scale).astype(np.float32), count


def _peaks(votes: NDArray[np.int32], least: float) -> NDArray[np.bool_]:
    """Where votes exceed `least` and the neighbours; of equal ones the first counts."""
    here = votes[1:-1, 1:-1]
    along = (here > votes[1:-1, :-2]) & (here >= votes[1:-1, 2:])
    peaks: NDArray[np.bool_] = (here > least) & along & (here > votes[:-2, 1:-1]) & (here >= votes[2:, 1:-1])
    return peaks
