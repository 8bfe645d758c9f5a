"""What the files of the traps and of C3 define for themselves holds for more than their own figures."""

import importlib
import re
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
COURSE = ROOT / "examples" / "l19"


@pytest.fixture(scope="module")
def load():
    """Import a file of the course by its name."""
    sys.path.insert(0, str(COURSE))  # they share figures.py and claims.py
    yield importlib.import_module
    sys.path.remove(str(COURSE))


def test_a_wrapped_angle_is_the_same_direction_in_the_half_open_turn(load, rng):
    replier = load("22_p2_angle_non_replie").replier
    angles = np.concatenate([rng.uniform(-100, 100, 2000), np.pi * np.arange(-9, 10)])
    wrapped = replier(angles)
    assert ((wrapped > -np.pi) & (wrapped <= np.pi)).all()
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-10)


@pytest.mark.parametrize("share", [-0.95, -0.5, 0.0, 0.5, 0.95])
def test_intersected_covariances_are_never_too_sure(load, rng, share):
    """Whatever two errors have in common, the error of the fusion is no larger than announced."""
    intersect = load("23_p3_capteurs_correles").covariance_intersection
    for _ in range(20):
        roots = rng.standard_normal((2, 2, 2))
        A, B = roots @ roots.transpose(0, 2, 1) + 0.1 * np.eye(2)
        left, right = np.linalg.cholesky(A), np.linalg.cholesky(B)
        turn = np.linalg.qr(rng.standard_normal((2, 2)))[0]
        cross = share * left @ turn @ right.T  # any correlation that two errors can have, up to |share|
        a, b = rng.standard_normal((2, 2))
        mean, P, w = intersect(a, A, b, B)
        from_a, from_b = w * P @ np.linalg.inv(A), (1 - w) * P @ np.linalg.inv(B)
        np.testing.assert_allclose(from_a + from_b, np.eye(2), atol=1e-9)
        np.testing.assert_allclose(mean, from_a @ a + from_b @ b, atol=1e-9)
        both = from_a @ cross @ from_b.T
        true = from_a @ A @ from_a.T + from_b @ B @ from_b.T + both + both.T
        assert np.linalg.eigvalsh(P - true).min() > -1e-9
        assert np.trace(P) <= min(np.trace(A), np.trace(B)) + 1e-9


def test_levels_and_light_are_each_others_inverse(load):
    colours = load("24_p4_couleur_sous_une_autre_lumiere")
    levels = np.arange(256)
    np.testing.assert_array_equal(colours.to_levels(colours.to_light(levels)), levels)
    assert (np.diff(colours.to_light(levels)) > 0).all()


def test_white_paper_is_white_again_under_every_light(load, rng):
    colours = load("24_p4_couleur_sous_une_autre_lumiere")
    paper = np.full((160, 160, 3), 250, np.uint8)
    for gains in colours.LIGHTS.values():
        seen = colours.balanced(colours.lit(paper, gains, rng))
        np.testing.assert_allclose(np.median(seen, axis=(0, 1)), 255, atol=1)


def test_a_plane_seen_without_distortion_is_measured_exactly(load, rng):
    distortion = load("25_p5_distorsion_oubliee")
    for _ in range(20):
        H = np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3)) * [[1, 1, 50], [1, 1, 50], [1e-3, 1e-3, 0]]
        seen = distortion.transfer(H, distortion.GRID_MM)
        np.testing.assert_allclose(distortion.measure(seen), 0, atol=1e-6)
        assert distortion.bend_px(seen) < 1e-9


def test_the_learnt_network_tells_the_paints_apart(load):
    detection = load("13_c3_detection")
    weights, bias = detection.learn(np.random.default_rng(2))
    for kind, name in enumerate(detection.CLASSES[1:], 1):
        for light in (0.4, 1.0):
            seen = light * np.array(detection.PAINT[name][::-1]) / 255
            assert np.argmax(weights @ seen + bias) == kind


def test_rectangles_are_counted_once(load):
    score = load("13_c3_detection").score_boxes
    truth = np.array([[1, 0, 0, 40, 40], [2, 100, 0, 40, 40]])
    right = np.array([[2.0, 0, 40, 40], [100, 4, 40, 40]])
    assert score(right, np.array([1, 2]), truth)[:2] == (2, 0)
    assert score(right, np.array([1, 1]), truth)[:2] == (1, 1), "another class is a false alarm"
    assert score(np.empty((0, 4)), np.empty(0, int), truth) == (0, 0, 0.0)


def test_every_trap_and_question_is_answered_by_an_example():
    answers = re.split(r"^### ", (ROOT / "docs" / "faq.md").read_text(encoding="utf-8"), flags=re.MULTILINE)[
        1:
    ]
    assert len(answers) >= 20
    links = [re.findall(r"\]\(([^)#\s]+)\)", answer) for answer in answers]
    assert all(links), "each answer leads somewhere"
    lost = [link for one in links for link in one if not (ROOT / "docs" / link).is_file()]
    assert not lost
    shown = {link.rpartition("/")[2][:2] for one in links for link in one if "examples/l19" in link}
    assert {"21", "22", "23", "24", "25"} <= shown
