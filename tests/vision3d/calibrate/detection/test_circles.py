"""Grids of circles: found where OpenCV finds them, numbered as it does, without the bias of its centres."""

import cv2
import numpy as np
import pytest

from vision3d.boards import CircleGrid
from vision3d.calibrate.detection import detect_view, detect_views
from vision3d.calibrate.detection.conics import circle_images
from vision3d.camera import Camera
from vision3d.cv import find_circles
from vision3d.render import render_set

CAMERA = Camera(
    "brown5",
    np.array([533.0, 533.0, 342.0, 234.0]),
    np.array([-0.28, 0.02, 0.0012, -0.0001, 0.16]),
    (640, 480),
)
BOARDS = [
    CircleGrid(7, 5, 0.03),
    CircleGrid(4, 11, 0.02, asymmetric=True),
    CircleGrid(4, 8, 0.02, asymmetric=True),
]


@pytest.fixture(scope="module", params=BOARDS, ids=lambda board: board.name)
def rendered(request):
    return render_set(CAMERA, request.param, 4, np.random.default_rng(1))


def truth_of(view, truth, board):
    """Where the view's points truly are, the board turned by 180° where it looks the same so."""
    ways = [truth] if board.half_turn is None else [truth, truth[board.half_turn]]
    return min((way[view.ids] for way in ways), key=lambda way: np.abs(view.pixels - way).max())


def test_centres_are_those_of_the_circles_and_honest(rendered):
    detections = detect_views(rendered.named(), rendered.board)
    assert [len(view) for view in detections.views] == [rendered.board.count] * 4
    errors = np.array([
        view.pixels - truth_of(view, truth, rendered.board)
        for view, truth in zip(detections.views, rendered.corners, strict=True)
    ])  # fmt: skip
    assert np.sqrt(np.mean(errors**2)) < 0.006
    assert np.abs(errors).max() < 0.04
    z = errors / np.array([view.sigma_px for view in detections.views])[..., None]
    assert 0.7 < np.sqrt(np.mean(z**2)) < 1.3


def test_numbers_are_opencvs(rendered):
    board, image = rendered.board, rendered.images[0]
    if board.asymmetric and board.rows % 2 == 0:
        board = BOARDS[1]  # OpenCV numbers grids that look the same upside down as their mirror image
        image = render_set(CAMERA, board, 1, np.random.default_rng(7)).images[0]
    whole, theirs = find_circles(image, *board.shape, asymmetric=board.asymmetric)
    ours = detect_views([("one", image)], board).views[0]
    assert whole
    np.testing.assert_allclose(truth_of(ours, theirs, board), ours.pixels, atol=0.6)


def test_light_circles_are_found_as_well(rendered):
    view, audit, _ = detect_view("negative", 255 - rendered.images[0], rendered.board)
    assert (audit.finder, len(view)) == ("light circles", rendered.board.count)
    np.testing.assert_allclose(truth_of(view, rendered.corners[0], rendered.board), view.pixels, atol=0.05)


def test_a_covered_circle_is_left_out(rendered):
    board, truth = rendered.board, rendered.corners[1]
    image = np.array(rendered.images[1])
    hidden = board.count // 2
    cv2.circle(image, tuple(np.round(truth[hidden]).astype(int).tolist()), 12, 200, -1)
    view, audit, _ = detect_view("covered", image, board)
    assert (len(view), len(audit.lost)) == (board.count - 1, 1)
    np.testing.assert_allclose(truth_of(view, truth, board), view.pixels, atol=0.05)


def test_a_wrong_size_is_told_the_right_one(rendered):
    board = rendered.board
    wrong = CircleGrid(board.columns, board.rows + 2, board.spacing_m, board.asymmetric)
    missed = detect_views(rendered.named()[:2], wrong).missed
    columns, rows = board.shape
    said = {one.seen for one in missed}
    assert said <= {(columns, rows), (rows, columns)}
    assert f"I see {missed[0].seen[0]}x{missed[0].seen[1]} circles" in missed[0].reason


def test_the_bias_of_a_circle_is_the_pinholes(rng):
    """Against the conic of projective geometry: inv(H)ᵀ C inv(H), whose centre is the ellipse's."""
    H = np.eye(3) + 0.2 * rng.standard_normal((3, 3))
    H[:2] *= 300.0
    centres, radius = rng.uniform(-0.5, 0.5, (20, 2)), 0.01

    def to_pixels(plane):
        mapped = np.column_stack([plane, np.ones(len(plane))]) @ H.T
        return mapped[:, :2] / mapped[:, 2:]

    bias, shapes = circle_images(to_pixels, centres, radius)
    for centre, ours, shape in zip(centres, bias, shapes, strict=True):
        C = np.array([[1, 0, -centre[0]], [0, 1, -centre[1]], [*-centre, centre @ centre - radius**2]])
        conic = np.linalg.inv(H).T @ C @ np.linalg.inv(H)
        ellipse = -np.linalg.solve(conic[:2, :2], conic[:2, 2])
        level = conic[2, 2] + ellipse @ conic[:2, 2]
        np.testing.assert_allclose(ours, ellipse - to_pixels(centre[None])[0], rtol=2e-2, atol=1e-6)
        M = conic[:2, :2] / -level
        np.testing.assert_allclose(shape, [M[0, 0], M[0, 1], M[1, 1]], rtol=2e-3)


def test_nothing_is_found_where_there_is_nothing(rng):
    noise = rng.integers(0, 256, (240, 320), dtype=np.uint8)
    missed = detect_views([("noise", noise), ("flat", np.full((240, 320), 9, np.uint8))], BOARDS[0]).missed
    assert [one.seen for one in missed] == [None, None]
