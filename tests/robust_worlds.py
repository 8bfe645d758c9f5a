"""Data with known truth for robust fits: rows that agree, rows that are chance."""

from dataclasses import dataclass

import cv2
import numpy as np

from vision3d.robust import epipolar_distances

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


@dataclass(frozen=True)
class TwoViews:
    """Matches a, b (N, 2) px with noise and outliers; the right ones without noise; F (3, 3) between."""

    a: np.ndarray
    b: np.ndarray
    right: np.ndarray
    exact_a: np.ndarray
    exact_b: np.ndarray
    F: np.ndarray


def fundamental_matches(rng, inliers, count=500, sigma_px=0.7, plane=0.0):
    """Two views of points 4 to 10 m away, a share of them on a plane."""
    K = np.array([[600.0, 0.0, 320.0], [0.0, 600.0, 240.0], [0.0, 0.0, 1.0]])
    X = np.column_stack([rng.uniform(-2.0, 2.0, (count, 2)), rng.uniform(4.0, 10.0, count)])
    flat = rng.random(count) < plane
    X[flat, 2] = 6.0 + 0.3 * X[flat, 0]
    R, t = cv2.Rodrigues(np.array([0.02, -0.15, 0.03]))[0], np.array([0.8, 0.1, 0.1])
    a, b = carried(K, X[:, :2] / X[:, 2:]), X @ R.T + t
    b = carried(K, b[:, :2] / b[:, 2:])
    cross = np.array([[0.0, -t[2], t[1]], [t[2], 0.0, -t[0]], [-t[1], t[0], 0.0]])
    F = np.linalg.inv(K).T @ cross @ R @ np.linalg.inv(K)
    noisy_a, noisy_b = (p + rng.normal(0.0, sigma_px, p.shape) for p in (a, b))
    wrong = rng.random(count) > inliers
    noisy_b[wrong] = rng.uniform([0.0, 0.0], [640.0, 480.0], (int(wrong.sum()), 2))
    return TwoViews(noisy_a, noisy_b, ~wrong, a[~wrong], b[~wrong], F / np.linalg.norm(F))


def off_lines_px(F, world):
    """Root mean square distance of the exact matches from their epipolar lines."""
    return float(np.sqrt(np.mean(np.square(epipolar_distances(F, world.exact_a, world.exact_b)))))
