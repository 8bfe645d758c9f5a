"""Robust fits beside OpenCV and PoseLib: how near the truth, and how long, on matches with known outliers.

The sets are those of the reference: 1000 matches in 640 px, 0.7 px of noise, outliers anywhere, threshold
3 px, at most 10 000 samples.  Errors are means over sets drawn anew, in permuted order; "oracle" is least
squares on the true inliers, which no method can be expected to beat.  Times are medians of CPU time, in turn.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from robust_worlds import corner_error_px, fundamental_matches, matches, off_lines_px

from measure.figures import Figure, say
from measure.timing import cpu_seconds
from vision3d.robust import RansacSettings, fit_fundamental, fit_homography, fit_line, fit_similarity

__all__ = ["figures"]

LEVELS = (0.8, 0.5, 0.3, 0.15)
ENOUGH = {0.8: 10.0, 0.3: 3.0}
AIMS = {0.8: 3.0, 0.3: 1.0}
OWN = RansacSettings(threshold=3.0, max_iterations=10_000)
PEERS = {
    "cv2.RANSAC": RansacSettings(threshold=3.0, max_iterations=10_000, backend="opencv"),
    "MAGSAC": RansacSettings(
        threshold=3.0, max_iterations=10_000, backend="opencv", opencv_method="USAC_MAGSAC"
    ),
    "PoseLib": RansacSettings(threshold=3.0, max_iterations=10_000, backend="poselib"),
}


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Rows for every share of inliers, then for the other models."""
    rows: dict[str, Figure] = {}
    for share in LEVELS:
        say(f"homography, {share:.0%} inliers")
        rows |= accuracy(share, 10 if quick else 60)
        rows |= duration(share, 3 if quick else 9)
    say("other models")
    return (
        rows | fundamental(6 if quick else 30) | similarity(10 if quick else 60) | line(10 if quick else 60)
    )


def accuracy(share: float, sets: int) -> dict[str, Figure]:
    """Mean distance of the image's corners from where they belong, ours over OpenCV's RANSAC."""
    errors: dict[str, list[float]] = {name: [] for name in ("own", "oracle", *PEERS)}
    for seed in range(sets):
        rng = np.random.default_rng(seed)
        a, b, right = matches(rng, share)
        for name, settings in {"own": OWN, **PEERS}.items():
            shuffled = rng.permutation(len(a))
            found = fit_homography(a[shuffled], b[shuffled], settings, rng=np.random.default_rng(seed))
            errors[name].append(corner_error_px(found.model))
        errors["oracle"].append(corner_error_px(cv2.findHomography(a[right], b[right], 0)[0]))
    mean = {name: float(np.mean(values)) for name, values in errors.items()}
    median = float(np.median(errors["own"]) / np.median(errors["cv2.RANSAC"]))
    said = ", ".join(f"{name} {value:.3f}" for name, value in mean.items())
    percent = round(100 * share)
    return {
        f"homography_error_{percent}": Figure(
            mean["own"] / mean["cv2.RANSAC"],
            "x",
            f"mean px: {said}; medians {median:.2f} x",
            1.0,
            0.8,
        )
    }


def duration(share: float, rounds: int) -> dict[str, Figure]:
    """CPU time of one fit with its covariance, ours over a bare call of OpenCV's RANSAC."""
    a, b, _ = matches(np.random.default_rng(1), share)

    def opencv(method: int) -> Callable[[], object]:
        return lambda: cv2.findHomography(a, b, method, 3.0, maxIters=10_000, confidence=0.999)

    times = cpu_seconds(
        {
            "own": lambda: fit_homography(a, b, OWN),
            "cv2.RANSAC": opencv(cv2.RANSAC),
            "MAGSAC": opencv(cv2.USAC_MAGSAC),
            "PoseLib": lambda: fit_homography(a, b, PEERS["PoseLib"]),
        },
        rounds,
    )
    said = ", ".join(f"{name} {1e3 * spent:.2f} ms" for name, spent in times.items())
    return {
        f"homography_time_{round(100 * share)}": Figure(
            times["own"] / times["cv2.RANSAC"], "x", said, ENOUGH.get(share), AIMS.get(share)
        )
    }


def fundamental(sets: int) -> dict[str, Figure]:
    """Root mean square distance of exact matches from their epipolar lines, medians, ours over PoseLib's."""
    methods = {
        "own": RansacSettings(threshold=2.0, inner_samples=5, max_iterations=20_000),
        "MAGSAC": RansacSettings(
            threshold=2.0, max_iterations=20_000, backend="opencv", opencv_method="USAC_MAGSAC"
        ),
        "PoseLib": RansacSettings(threshold=2.0, max_iterations=20_000, backend="poselib"),
    }
    rows = {}
    for plane in (0.0, 0.85):
        off: dict[str, list[float]] = {name: [] for name in methods}
        for seed in range(sets):
            world = fundamental_matches(np.random.default_rng(seed), 0.5, plane=plane)
            for name, settings in methods.items():
                found = fit_fundamental(world.a, world.b, settings, rng=np.random.default_rng(seed))
                off[name].append(off_lines_px(found.model, world))
        median = {name: float(np.median(values)) for name, values in off.items()}
        said = ", ".join(f"{name} {value:.3f} px" for name, value in median.items())
        name = "fundamental_error" if plane == 0.0 else "fundamental_error_dominant_plane"
        rows[name] = Figure(median["own"] / median["PoseLib"], "x", f"50 % inliers: {said}")
    return rows


def similarity(sets: int) -> dict[str, Figure]:
    """Error of the image's corners carried over, medians, ours over OpenCV's."""
    truth = np.array([[0.8, -0.3, 40.0], [0.3, 0.8, -20.0], [0.0, 0.0, 1.0]])
    ours, theirs = [], []
    for seed in range(sets):
        a, b, _ = matches(np.random.default_rng(seed), 0.5, H=truth)
        found = fit_similarity(a, b, RansacSettings(threshold=3.0))
        ours.append(corner_error_px(found.model, truth))
        outside = cv2.estimateAffinePartial2D(a, b, ransacReprojThreshold=3.0, confidence=0.999)[0]
        theirs.append(corner_error_px(np.vstack([outside, [0.0, 0.0, 1.0]]), truth))
    said = f"50 % inliers: own {np.median(ours):.3f} px, OpenCV {np.median(theirs):.3f} px"
    return {"similarity_error": Figure(float(np.median(ours) / np.median(theirs)), "x", said)}


def line(sets: int) -> dict[str, Figure]:
    """Error of a line's direction among 40 % outliers, medians, ours over OpenCV's M-estimator."""
    ours, theirs = [], []
    for seed in range(sets):
        rng = np.random.default_rng(seed)
        points = np.column_stack([rng.uniform(0.0, 640.0, 300), 200.0 + rng.normal(0.0, 0.5, 300)])
        points[:120] = rng.uniform(0.0, 640.0, (120, 2))
        ours.append(abs(fit_line(points, RansacSettings(threshold=2.0)).model[0]))
        theirs.append(abs(cv2.fitLine(points.astype(np.float32), cv2.DIST_HUBER, 0, 1e-3, 1e-3).ravel()[1]))
    said = f"own {1e3 * np.median(ours):.2f} mrad, cv2.fitLine (Huber) {1e3 * np.median(theirs):.2f} mrad"
    return {"line_direction_error": Figure(float(np.median(ours) / np.median(theirs)), "x", said)}
