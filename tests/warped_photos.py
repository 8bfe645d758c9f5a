"""Pairs of pictures with a known homography: a picture, and the same warped, in other light, with noise."""

import cv2
import numpy as np


def drawing(rng, width=480, height=360):
    """A picture with structure of every size, none of it repeated, as grey levels (h, w) float."""
    image = np.full((height, width), 120.0)
    for _ in range(260):
        centre, size = rng.uniform(0, (width, height)), float(np.exp(rng.uniform(1.2, 4.0)))
        light, angle = rng.uniform(20, 235), rng.uniform(0, np.pi)
        corners = size * rng.uniform(0.4, 1.0, (rng.integers(3, 7), 1)) * 1.0
        turn = angle + np.sort(rng.uniform(0, 2 * np.pi, len(corners)))
        outline = centre + corners * np.column_stack([np.cos(turn), np.sin(turn)])
        cv2.fillPoly(image, [np.rint(outline * 16).astype(np.int32)], light, cv2.LINE_8, 4)
    return cv2.GaussianBlur(image, (0, 0), 0.8)


def warped(image, rng, *, strength=0.1, scale=1.0, angle=0.0, noise=2.0, gain=0.85, offset=8.0):
    """(a, b, homography a to b): corners move by up to `strength` of the sides."""
    height, width = image.shape
    corners = np.array([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], float)
    moved = corners + rng.uniform(-strength, strength, (4, 2)) * (width, height)
    c, s = np.cos(angle), np.sin(angle)
    moved = (moved - moved.mean(axis=0)) @ (scale * np.array([[c, s], [-s, c]]))
    moved -= moved.min(axis=0)
    size = np.ceil(moved.max(axis=0)).astype(int) + 1
    matrix = cv2.getPerspectiveTransform(corners.astype(np.float32), moved.astype(np.float32))
    fine = 3  # samples to a pixel's side, so that a smaller picture is no aliased one
    up = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1.0]])
    large = cv2.warpPerspective(
        image.astype(np.float32), up @ matrix, tuple(int(n) for n in fine * size), flags=cv2.INTER_CUBIC,
        borderValue=90.0,
    )  # fmt: skip
    second = cv2.resize(large, tuple(int(n) for n in size), interpolation=cv2.INTER_AREA)
    return noisy(image, rng, noise), noisy(gain * second + offset, rng, noise), matrix


def noisy(light, rng, sigma):
    """Light as 8 bits with noise."""
    return np.clip(np.rint(light + sigma * rng.standard_normal(light.shape)), 0, 255).astype(np.uint8)


def moved(matrix, points):
    """Points (N, 2) through a homography."""
    there = np.column_stack([points, np.ones(len(points))]) @ np.asarray(matrix).T
    return there[:, :2] / there[:, 2:]


def slopes(matrix, points):
    """(N, 2, 2) Jacobian of a homography."""
    there = np.column_stack([points, np.ones(len(points))]) @ np.asarray(matrix).T
    at = there[:, :2] / there[:, 2:]
    return (matrix[None, :2, :2] - at[:, :, None] * matrix[None, 2:, :2]) / there[:, 2, None, None]
