"""Data with known truth for robust fits: rows that agree, rows that are chance."""

import numpy as np

HOMOGRAPHY = np.array([[1.0, 0.1, 5.0], [0.02, 0.9, -3.0], [1e-4, 0.0, 1.0]])
SIZE_PX = 640.0


def carried(H, points):
    """Points (N, 2) carried over by H."""
    moved = np.column_stack([points, np.ones(len(points))]) @ H.T
    return moved[:, :2] / moved[:, 2:]


def matches(rng, inliers, count=1000, sigma_px=0.7, H=HOMOGRAPHY):
    """Points a, b (N, 2) px and the truth of who is an inlier: outliers land anywhere in the image."""
    a = rng.uniform(0.0, SIZE_PX, (count, 2))
    b = carried(H, a) + rng.normal(0.0, sigma_px, (count, 2))
    wrong = rng.random(count) > inliers
    b[wrong] = rng.uniform(0.0, SIZE_PX, (int(wrong.sum()), 2))
    return a, b, ~wrong


def corner_error_px(H, truth=HOMOGRAPHY):
    """Mean distance of the image's corners carried over by both."""
    corners = SIZE_PX * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return float(np.linalg.norm(carried(H, corners) - carried(truth, corners), axis=1).mean())


def nees(error, cov):
    """Squared error by a covariance of less than full rank, per degree of freedom."""
    size = np.sqrt(np.diag(cov))
    error = error / size
    values, vectors = np.linalg.eigh(cov / np.outer(size, size))
    held = values > 1e-8 * values[-1]
    return float(np.sum((vectors[:, held].T @ error) ** 2 / values[held]) / held.sum()), int(held.sum())
