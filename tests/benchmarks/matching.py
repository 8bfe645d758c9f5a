"""Matching beside OpenCV on pictures warped by known homographies, and on pairs that share nothing.

`python matching.py [--json] [--quick]`.  The pictures are scikit-image's, and OpenCV's where FACTORLAB_DATA
is set; each is warped strongly, in other light and with noise.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from measure.figures import Figure, interleaved, publish, say

sys.path.append(str(Path(__file__).resolve().parents[1]))

from warped_photos import drawing, moved, warped

from factorlab.match import MatchSettings, match_pictures
from factorlab.match.precision import corner_places
from vision3d.features import detect_features, match_features, refine_matches

OPENCV = ("home.jpg", "leuvenA.jpg", "building.jpg", "box_in_scene.png")
SCIKIT = ("astronaut", "camera", "coffee", "chelsea", "rocket")
RATIO, THRESHOLD_PX = 0.8, 3.0


def pictures() -> dict[str, np.ndarray]:
    """Grey pictures of 640 px at most, by name."""
    from skimage import data

    found = {"drawing": drawing(np.random.default_rng(1))}
    for name in SCIKIT:
        image = getattr(data, name)()
        found[name] = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    folder = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"
    for name in OPENCV:
        if (folder / name).is_file():
            found[name] = cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE)
    return {name: small(image) for name, image in found.items()}


def small(image: np.ndarray) -> np.ndarray:
    """No side above 640 px."""
    share = 640 / max(image.shape)
    return image if share >= 1 else cv2.resize(image, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)


def opencv(a: np.ndarray, b: np.ndarray, method: int) -> np.ndarray | None:
    """The tutorial: SIFT, the ratio test, findHomography."""
    sift = cv2.SIFT.create()
    (ka, da), (kb, db) = sift.detectAndCompute(a, None), sift.detectAndCompute(b, None)
    pairs = [m for m, n in cv2.BFMatcher().knnMatch(da, db, k=2) if m.distance < RATIO * n.distance]
    pa = np.array([ka[m.queryIdx].pt for m in pairs])
    pb = np.array([kb[m.trainIdx].pt for m in pairs])
    return cv2.findHomography(pa, pb, method, THRESHOLD_PX)[0] if len(pairs) >= 4 else None


def of_warps(quick: bool) -> dict[str, list[float]]:
    """Mean corner errors of every pair by each means, and what ours says of them."""
    told: dict[str, list[float]] = {name: [] for name in ("ours", "orb", "RANSAC", "MAGSAC", "nees")}
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as name:
        files = [str(Path(name) / f"{side}.png") for side in "ab"]
        for image in pictures().values():
            for scale, angle in ((0.9, 0.2), (0.6, 0.7))[: 1 if quick else 2]:
                a, b, truth = warped(image, rng, strength=0.15, scale=scale, angle=angle, noise=3.0)
                for path, one in zip(files, (a, b), strict=True):
                    cv2.imwrite(path, one)
                height, width = a.shape
                corners = np.array([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], float)
                there = moved(truth, corners)
                for kind, row in (("sift", "ours"), ("orb", "orb")):
                    done = match_pictures(*files, MatchSettings(features=kind, model="homography"))
                    if done.geometry is None:
                        told[row].append(np.inf)
                        continue
                    places, covs = corner_places(done, done.geometry)
                    told[row].append(float(np.hypot(*(places - there).T).mean()))
                    if kind == "sift":
                        error = places - there
                        each = np.einsum("ni,nij,nj->n", error, np.linalg.inv(covs), error)
                        told["nees"] += (each / 2).tolist()
                for row, method in (("RANSAC", cv2.RANSAC), ("MAGSAC", cv2.USAC_MAGSAC)):
                    H = opencv(a, b, method)
                    error = np.inf if H is None else float(np.hypot(*(moved(H, corners) - there).T).mean())
                    told[row].append(error)
    return told


def of_refinement() -> tuple[float, float, float]:
    """Robust error (px) of SIFT matches as detected and as refined, and the median NEES of the latter."""
    rng, before, after, nees = np.random.default_rng(2), [], [], []
    for image in pictures().values():
        a, b, truth = warped(image, rng, strength=0.1, scale=0.8, angle=0.3, noise=3.0)
        fa, fb = detect_features(a), detect_features(b)
        matches = match_features(fa, fb)
        pa, pb = matches.points(fa, fb)
        fine, cov, ok = refine_matches(a, b, pa, pb, warps=matches.warps(fa, fb))
        there = moved(truth, pa)
        right = ok & (np.hypot(*(pb - there).T) < THRESHOLD_PX)
        error = (fine - there)[right]
        before.append((pb - there)[right])
        after.append(error)
        nees.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(cov[right]), error))

    def spread(rows: list[np.ndarray]) -> float:
        return float(np.median(np.abs(np.concatenate(rows))) / 0.6745)

    return spread(before), spread(after), float(np.median(np.concatenate(nees)) / 1.386)


def of_strangers(quick: bool) -> tuple[int, int]:
    """How many of all pairs of different pictures pass for overlapping, and of how many."""
    said = tried = 0
    with tempfile.TemporaryDirectory() as name:
        files = []
        for k, image in enumerate(pictures().values()):
            files.append(str(Path(name) / f"{k}.png"))
            cv2.imwrite(files[-1], np.clip(image, 0, 255).astype(np.uint8))
        for a, b in itertools.islice(itertools.combinations(files, 2), 10 if quick else None):
            for model in ("homography", "fundamental"):
                done = match_pictures(a, b, MatchSettings(model=model, count=1500))
                said += done.geometry is not None
                tried += 1
    return said, tried


def of_speed() -> float:
    """Time of the ratio test on ORB's bits over that of OpenCV's brute force."""
    rng = np.random.default_rng(3)
    a, b, _ = warped(drawing(rng), rng)
    fa, fb = detect_features(a, "orb", count=2000), detect_features(b, "orb", count=2000)
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
    times = interleaved(
        {
            "ours": lambda: match_features(fa, fb, cross_check=False),
            "theirs": lambda: [
                m
                for m, n in matcher.knnMatch(fa.descriptors, fb.descriptors, k=2)
                if m.distance < 0.8 * n.distance
            ],
        }
    )
    return times["ours"] / times["theirs"]


def main() -> int:
    """Measure, print, and judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    warps = of_warps(quick)
    say("warps done")
    middle = {name: float(np.median(values)) for name, values in warps.items()}
    before, after, nees = of_refinement()
    said, tried = of_strangers(quick)
    tutorial = f"cv2.RANSAC {middle['RANSAC']:.3g}, USAC_MAGSAC {middle['MAGSAC']:.3g} px"
    usual, worst = middle["RANSAC"], max(warps["RANSAC"])
    rows = {
        "homography_corner_error_sift": Figure(middle["ours"], "px", tutorial, usual, 0.5 * usual),
        "homography_corner_error_orb": Figure(middle["orb"], "px", f"SIFT, {tutorial}", usual),
        "homography_worst_of_pairs": Figure(max(warps["ours"]), "px", f"cv2.RANSAC {worst:.3g} px", worst),
        "corner_nees_median_over_expected": Figure(middle["nees"] / 0.693, "", "1", 4.0, 1.5),
        "match_error_refined": Figure(after, "px", f"detected {before:.3g} px", 0.5 * before, 0.3 * before),
        "match_nees_median_over_expected": Figure(nees, "", "1", 2.0, 1.3),
        "strangers_said_to_overlap": Figure(said, f"of {tried}", "one in a hundred", 0.01 * tried, 0),
        "hamming_ratio_test_time": Figure(of_speed(), "x", "cv2.BFMatcher knn", 3.0, 1.0),
    }  # fmt: skip
    return publish(rows)


if __name__ == "__main__":
    sys.exit(main())
