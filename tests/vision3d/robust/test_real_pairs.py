"""Photographs: the fit agrees with OpenCV's and PoseLib's, holds on unseen matches, and is steady."""

import cv2
import numpy as np
import pytest

from vision3d.robust import RansacSettings, fit_fundamental, fit_homography, transfer


def sift_matches(folder, first, second, ratio=0.8):
    """Matched pixels a, b (N, 2), best first."""
    finder = cv2.SIFT_create(4000)
    paths = [str(folder / "vision" / "opencv" / name) for name in (first, second)]
    images = [cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in paths]
    (keys_a, words_a), (keys_b, words_b) = (finder.detectAndCompute(image, None) for image in images)
    pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(words_a, words_b, k=2)
    good = sorted((m for m, n in pairs if m.distance < ratio * n.distance), key=lambda m: m.distance)
    a = np.array([keys_a[m.queryIdx].pt for m in good])
    b = np.array([keys_b[m.trainIdx].pt for m in good])
    return a, b, images[0].shape


def test_the_box_is_found_in_its_scene(data_dir):
    a, b, (height, width) = sift_matches(data_dir, "box.png", "box_in_scene.png")
    corners = np.array([[0.0, 0.0], [width - 1, 0.0], [width - 1, height - 1], [0.0, height - 1]])
    placed = []
    for settings in (
        RansacSettings(),
        RansacSettings(order="prosac"),
        RansacSettings(backend="opencv", opencv_method="USAC_MAGSAC"),
        RansacSettings(backend="poselib", max_iterations=2000),
    ):
        found = fit_homography(a, b, settings)
        assert found.count > 60
        placed.append(transfer(found.model, corners))
    for other in placed[1:]:
        assert np.linalg.norm(placed[0] - other, axis=1).max() < 3.0


def test_a_box_s_place_hardly_depends_on_chance(data_dir):
    a, b, (height, width) = sift_matches(data_dir, "box.png", "box_in_scene.png")
    corners = np.array([[0.0, 0.0], [width - 1, 0.0], [width - 1, height - 1], [0.0, height - 1]])
    placed = [
        transfer(fit_homography(a, b, rng=np.random.default_rng(seed)).model, corners) for seed in range(10)
    ]
    assert np.std(placed, axis=0).max() < 0.2


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_fundamental_matrix_holds_on_matches_it_has_not_seen(data_dir, seed):
    a, b, _ = sift_matches(data_dir, "leuvenA.jpg", "leuvenB.jpg")
    rng = np.random.default_rng(seed)
    half = rng.permutation(len(a)) < len(a) // 2
    shares = {}
    for name, settings in {
        "own": RansacSettings(threshold=1.5, inner_samples=5),
        "opencv": RansacSettings(threshold=1.5, backend="opencv", max_iterations=5000),
        "poselib": RansacSettings(threshold=1.5, backend="poselib", max_iterations=5000),
    }.items():
        F = fit_fundamental(a[half], b[half], settings, rng=rng).model
        shares[name] = np.mean(sampson(F, a[~half], b[~half]) < 1.5)
    assert shares["own"] > 0.3
    assert shares["own"] >= shares["opencv"] - 0.02
    assert shares["own"] >= shares["poselib"] - 0.03


def sampson(F, a, b):
    """Sampson's distances, written anew."""
    x, u = (np.column_stack([p, np.ones(len(p))]) for p in (a, b))
    lines_b, lines_a = x @ F.T, u @ F
    size = lines_b[:, 0] ** 2 + lines_b[:, 1] ** 2 + lines_a[:, 0] ** 2 + lines_a[:, 1] ** 2
    return np.abs(np.sum(u * lines_b, axis=1)) / np.sqrt(size)
