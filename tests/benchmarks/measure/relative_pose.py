"""Relative pose of thirteen real pairs, beside OpenCV and PoseLib on the same matches.

The pairs are OpenCV's left01-14 and right01-14, matched by SIFT at a ratio of 0.75; the truth is a stereo
calibration from the chessboards in them: OpenCV's, with fixed intrinsics as in the reference, and joint,
which fits better.  Every method sees the matches in another order with every seed.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from measure.figures import Figure, interleaved, say
from sequential.manifold.quaternion import quaternion_from_matrix, rotation_matrix
from vision3d.camera import Camera
from vision3d.two_view import estimate_two_view

__all__ = ["figures"]

SIZE, SPACING_M = (640, 480), 0.025
RIGHT_DEG = 5.0
SIDES = ("left", "right")
METHODS = ("cv2.RANSAC", "cv2.USAC_ACCURATE", "PoseLib")
MUST, AIM = (0.3, 0.6), (0.147, 0.28)


@dataclass(frozen=True)
class Truth:
    """Two cameras and the pose between them."""

    left: Camera
    right: Camera
    R: np.ndarray
    t: np.ndarray


@dataclass(frozen=True)
class Pair:
    """Matches of a left and a right picture, px."""

    left: np.ndarray
    right: np.ndarray

    def shuffled(self, rng: np.random.Generator) -> Pair:
        """The same in another order."""
        order = rng.permutation(len(self.left))
        return Pair(self.left[order], self.right[order])


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Medians over the pairs, and how many are right, over several seeds."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "../shared/data")) / "vision" / "opencv"
    if not (folder / "left01.jpg").is_file():
        say(f"relative pose: needs {folder}, which FACTORLAB_DATA names; left out")
        return {}
    truths, names = calibrated(folder)
    pairs = [matched(folder, name) for name in names]
    rows: dict[str, Figure] = {}
    for label, truth in truths.items():
        say(f"relative pose, {label} truth")
        rows |= accuracy(label, truth, pairs, 2 if quick else 10)
    return rows | duration(truths["fixed"], pairs)


def accuracy(label: str, truth: Truth, pairs: list[Pair], seeds: int) -> dict[str, Figure]:
    """Ours with bars, and what the peers reach beside it."""
    errors = {name: np.empty((seeds, len(pairs), 2)) for name in ("own", *METHODS)}
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        for index, pair in enumerate(pairs):
            shuffled = pair.shuffled(rng)
            for name, errors_of in errors.items():
                errors_of[seed, index] = off_by(truth, solved(name, truth, shuffled, seed))
    medians = {name: np.median(values, axis=(0, 1)) for name, values in errors.items()}
    right = {name: (values.max(axis=2) < RIGHT_DEG).sum(axis=1) for name, values in errors.items()}
    said = [", ".join(f"{name} {value[k]:.3f}" for name, value in medians.items()) for k in (0, 1)]
    told = ", ".join(f"{name} {counts.min()}-{counts.max()}" for name, counts in right.items())
    main = label == "fixed"
    tail = "" if main else f"_{label}_truth"
    rows = {
        f"relative_pose_{what}_deg{tail}": Figure(
            float(medians["own"][k]), "deg", f"median, {seeds} seeds: {said[k]}",
            MUST[k] if main else None, AIM[k] if main else None,
        )
        for k, what in enumerate(("rotation", "direction"))
    }  # fmt: skip
    rows[f"relative_pose_right_pairs{tail}"] = Figure(
        float(right["own"].min()),
        "of 13",
        f"both errors below {RIGHT_DEG:g} deg, fewest over seeds: {told}",
        13.0 if main else None,
        13.0 if main else None,
        better="higher",
    )
    return rows


def duration(truth: Truth, pairs: list[Pair]) -> dict[str, Figure]:
    """Time of one pair, ours with every verdict over PoseLib's relative pose."""
    pair = pairs[len(pairs) // 2]
    works = {name: (lambda n=name: solved(n, truth, pair, 0)) for name in ("own", *METHODS)}
    times = interleaved(works)
    said = ", ".join(f"{name} {1e3 * value:.1f} ms" for name, value in times.items())
    return {"relative_pose_time_over_poselib": Figure(times["own"] / times["PoseLib"], "x", said)}


def off_by(truth: Truth, motion: tuple[np.ndarray, np.ndarray] | None) -> tuple[float, float]:
    """Errors of rotation and direction, deg; 180 where nothing was found."""
    if motion is None:
        return 180.0, 180.0
    R, t = motion
    turn = 2.0 * np.arccos(np.clip(quaternion_from_matrix(truth.R.T @ R)[0], -1.0, 1.0))
    t = np.ravel(t) / np.linalg.norm(t)
    return float(np.degrees(turn)), float(np.degrees(np.arccos(np.clip(t @ truth.t, -1.0, 1.0))))


def solved(name: str, truth: Truth, pair: Pair, seed: int) -> tuple[np.ndarray, np.ndarray] | None:
    """The rotation and translation that a method finds."""
    if name == "own":
        view = estimate_two_view(
            truth.left, truth.right, pair.left, pair.right, rng=np.random.default_rng(seed)
        )
        return (rotation_matrix(view.b_T_a[:4]), view.b_T_a[4:]) if view.b_T_a[4:].any() else None
    a, b = truth.left.undistort_points(pair.left), truth.right.undistort_points(pair.right)
    threshold = 1.0 / truth.left.intrinsics[0]
    if name == "PoseLib":
        import poselib

        plain = {"model": "SIMPLE_PINHOLE", "width": 640, "height": 480, "params": [1.0, 0.0, 0.0]}
        options = {"max_epipolar_error": threshold, "success_prob": 0.999, "seed": seed}
        found, _ = poselib.estimate_relative_pose(a, b, plain, plain, options, {})
        return np.asarray(found.R), np.asarray(found.t)
    cv2.setRNGSeed(seed)
    method = getattr(cv2, name.removeprefix("cv2."))
    E, mask = cv2.findEssentialMat(a, b, np.eye(3), method, 0.999, threshold)
    if E is None or E.shape != (3, 3):
        return None
    _, R, t, _ = cv2.recoverPose(E, a, b, np.eye(3), mask=mask)
    return R, t


def calibrated(folder: Path) -> tuple[dict[str, Truth], list[str]]:
    """Truths by the chessboards, and the numbers of the pairs that show them."""
    found = {side: {name: corners(folder / f"{side}{name}.jpg") for name in numbers()} for side in SIDES}
    names = [
        name for name in numbers() if found["left"][name] is not None and found["right"][name] is not None
    ]
    left, right = ([found[side][name] for name in names] for side in SIDES)
    board = np.zeros((54, 3), np.float32)
    board[:, :2] = SPACING_M * np.mgrid[0:9, 0:6].T.reshape(-1, 2)
    boards = [board] * len(names)
    a = cv2.calibrateCamera(boards, left, SIZE, None, None)
    b = cv2.calibrateCamera(boards, right, SIZE, None, None)
    truths = {}
    for label, flags in (("fixed", cv2.CALIB_FIX_INTRINSIC), ("joint", cv2.CALIB_USE_INTRINSIC_GUESS)):
        given = [np.array(one) for one in (a[1], a[2], b[1], b[2])]
        _, K1, d1, K2, d2, R, T, *_ = cv2.stereoCalibrate(
            boards, left, right, *given, SIZE, flags=flags, criteria=(3, 100, 1e-5)
        )
        cameras = [Camera.from_matrix(K, np.ravel(d), SIZE) for K, d in ((K1, d1), (K2, d2))]
        truths[label] = Truth(*cameras, np.asarray(R), np.ravel(T) / np.linalg.norm(T))
    return truths, names


def numbers() -> list[str]:
    """Two digits each; there is no pair 10."""
    return [f"{number:02d}" for number in range(1, 15) if number != 10]


def corners(path: Path) -> np.ndarray | None:
    """Inner corners of the chessboard (54, 1, 2), within a window that suits the smallest squares."""
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    good, found = cv2.findChessboardCorners(image, (9, 6))
    return cv2.cornerSubPix(image, found, (5, 5), (-1, -1), (3, 30, 0.01)).reshape(-1, 1, 2) if good else None


def matched(folder: Path, name: str) -> Pair:
    """SIFT matches that pass the ratio test."""
    sift = cv2.SIFT_create(4000, contrastThreshold=0.02)
    found = [sift.detectAndCompute(cv2.imread(str(folder / f"{side}{name}.jpg"), 0), None) for side in SIDES]
    (keys_a, told_a), (keys_b, told_b) = found
    two = cv2.BFMatcher().knnMatch(told_a, told_b, k=2)
    kept = [best for best, second in two if best.distance < 0.75 * second.distance]
    left = np.array([keys_a[match.queryIdx].pt for match in kept], dtype=np.float64)
    return Pair(left, np.array([keys_b[match.trainIdx].pt for match in kept], dtype=np.float64))
