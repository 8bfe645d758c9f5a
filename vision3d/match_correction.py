"""Move a match as little as makes it fit the epipolar geometry exactly: the optimum of two views.

Of all pairs of pixels that fulfil ``b' F a = 0`` the one nearest to the match, in squared pixels, is the
likeliest where the noise of all four coordinates is equal; the rays through it meet.

Sources: Lindström 2010, "Triangulation made easy", in its iterated form; Hartley and Sturm 1997,
"Triangulation", the roots of a polynomial of degree 6, which finds the global optimum and is slower.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError, NotFiniteError, ShapeError
from vision3d.camera import Array

__all__ = ["correct_matches"]

ITERATIONS = 30


def correct_matches(
    fundamental: ArrayLike, pixels_a: ArrayLike, pixels_b: ArrayLike, *, method: str = "lindstrom"
) -> tuple[Array, Array]:
    """Nearest matches that fulfil the epipolar constraint.

    Parameters
    ----------
    fundamental : (3, 3) F with ``b' F a = 0``; an essential matrix for normalised coordinates
    pixels_a, pixels_b : (N, 2) of two images without distortion
    method : "lindstrom" iterates from the match, "hartley_sturm" compares all stationary points

    Returns
    -------
    tuple
        the pixels (N, 2) in both images.

    Raises
    ------
    ModelError, ShapeError, NotFiniteError
        for another method, other shapes, NaN or infinity.
    """
    matrix = np.array(fundamental, dtype=np.float64)
    a, b = np.array(pixels_a, dtype=np.float64), np.array(pixels_b, dtype=np.float64)
    if matrix.shape != (3, 3) or a.ndim != 2 or a.shape[1] != 2 or a.shape != b.shape:
        raise ShapeError(
            f"expected F (3, 3) and pixels (N, 2) twice; got {matrix.shape}, {a.shape}, {b.shape}"
        )
    if not (np.isfinite(matrix).all() and np.isfinite(a).all() and np.isfinite(b).all()):
        raise NotFiniteError("F and all pixels must be finite; leave out the matches that are not")
    if method == "lindstrom":
        return _lindstrom(matrix, a, b)
    if method == "hartley_sturm":
        pairs = [_hartley_sturm(matrix, *pair) for pair in zip(a, b, strict=True)]
        moved = np.array(pairs).reshape(-1, 2, 2)
        return moved[:, 0], moved[:, 1]
    raise ModelError(f"no method {method!r}; known are 'lindstrom' and 'hartley_sturm'")


def _lindstrom(matrix: Array, a: Array, b: Array) -> tuple[Array, Array]:
    """Step along the normals of both epipolar lines, as far as the constraint asks, until they stand still.

    In each step the constraint is a quadratic in the length, whose smaller root is taken.
    """
    inner = matrix[:2, :2]
    constraint = np.einsum("ni,ij,nj->n", _homogeneous(b), matrix, _homogeneous(a))
    now_a, now_b = a.copy(), b.copy()
    for _ in range(ITERATIONS):
        normal_a = (_homogeneous(now_b) @ matrix)[:, :2]
        normal_b = (_homogeneous(now_a) @ matrix.T)[:, :2]
        curved = np.einsum("ni,ij,nj->n", normal_b, inner, normal_a)
        half = 0.5 * (np.sum(normal_a**2, axis=1) + np.sum(normal_b**2, axis=1))
        root = np.sqrt(np.maximum(half**2 - curved * constraint, 0.0))
        with np.errstate(invalid="ignore", divide="ignore"):
            length = np.where(half + root > 0, constraint / (half + root), 0.0)[:, None]
        then_a, then_b = a - length * normal_a, b - length * normal_b
        still = np.abs(then_a - now_a).max(initial=0.0) < 1e-13 * (1.0 + np.abs(a).max(initial=0.0))
        now_a, now_b = then_a, then_b
        if still:
            break
    return now_a, now_b


def _homogeneous(pixels: Array) -> Array:
    return np.column_stack([pixels, np.ones(len(pixels))])


def _hartley_sturm(matrix: Array, a: Array, b: Array) -> tuple[Array, Array]:
    """One match: pencils of epipolar lines about both epipoles, the best of which is a root."""
    # the match moves to both origins, the epipoles to (1, 0, f) and (1, 0, g)
    from_a, from_b = np.eye(3), np.eye(3)
    from_a[:2, 2], from_b[:2, 2] = a, b
    centred = from_b.T @ matrix @ from_a
    left, _, right = np.linalg.svd(centred)
    turn_a, f = _epipole_on_x(right[2])
    turn_b, g = _epipole_on_x(left[:, 2])
    turned = turn_b @ centred @ turn_a.T
    p, q, r, s = turned[1, 1], turned[1, 2], turned[2, 1], turned[2, 2]
    # the line through (1, 0, f) and (0, t, 1) has the square distance t² / (1 + f² t²) from the origin
    first, second = np.poly1d([p, q]), np.poly1d([r, s])
    t = np.poly1d([1.0, 0.0])
    slope = t * (first**2 + g**2 * second**2) ** 2
    slope -= np.poly1d([f**2, 0.0, 1.0]) ** 2 * first * second * float(p * s - q * r)
    scaled = slope.coeffs / np.abs(slope.coeffs).max(initial=1e-300)
    real = np.roots(scaled[np.argmax(np.abs(scaled) > 1e-14) :]).real
    lines = [(np.array([value * f, 1.0, -value]), value) for value in real]
    others = [np.array([-g * second(value), first(value), second(value)]) for value in real]
    candidates = [(_foot(line), _foot(other)) for (line, _), other in zip(lines, others, strict=True)]
    candidates.append((_foot(np.array([f, 0.0, -1.0])), _foot(np.array([-g * r, p, r]))))
    best = min(candidates, key=lambda pair: float(pair[0] @ pair[0] + pair[1] @ pair[1]))
    return a + best[0] @ turn_a[:2, :2], b + best[1] @ turn_b[:2, :2]


def _epipole_on_x(epipole: Array) -> tuple[Array, float]:
    """The rotation (3, 3) about the origin that takes an epipole to (1, 0, f), and f."""
    distance = float(np.hypot(epipole[0], epipole[1]))
    if distance == 0.0:
        return np.eye(3), np.inf
    c, s = epipole[:2] / distance
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), float(epipole[2] / distance)


def _foot(line: Array) -> Array:
    """The point (2,) of a line (3,) that is nearest to the origin."""
    square = line[0] ** 2 + line[1] ** 2
    if square == 0.0:
        return np.array([np.inf, np.inf])
    foot: Array = -line[2] * line[:2] / square
    return foot
