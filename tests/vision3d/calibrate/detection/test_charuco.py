"""ChArUco boards and boards of markers: both patterns, mirrors, wrong boards, hidden parts, sigmas."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from vision3d.boards import CharucoBoard, MarkerBoard
from vision3d.calibrate.detection import detect_view, detect_views
from vision3d.camera import Camera
from vision3d.render import render_set

CAMERA = Camera(
    "brown5",
    np.array([533.0, 533.0, 342.0, 234.0]),
    np.array([-0.28, 0.02, 0.0012, -0.0001, 0.16]),
    (640, 480),
)
BOARDS = [
    CharucoBoard(8, 6, 0.03, 0.0225, "4x4_50"),
    CharucoBoard(8, 6, 0.03, 0.018, "4x4_50", legacy=True),
    CharucoBoard(5, 7, 0.03, 0.02, "5x5_100"),
]
TUTORIAL = CharucoBoard(5, 7, 0.04, 0.02, "6x6_250")


@pytest.fixture(scope="module", params=BOARDS, ids=lambda board: board.name)
def rendered(request):
    return render_set(CAMERA, request.param, 4, np.random.default_rng(1))


def test_corners_are_whole_and_honest(rendered):
    detections = detect_views(rendered.named(), rendered.board)
    assert [len(view) for view in detections.views] == [rendered.board.count] * 4
    errors = np.array([v.pixels - truth for v, truth in zip(detections.views, rendered.corners, strict=True)])
    assert np.sqrt(np.mean(errors**2)) < 0.013
    z = errors / np.array([view.sigma_px for view in detections.views])[..., None]
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.25
    assert all(view.findings == () for view in detections.views)


def test_the_other_pattern_is_read_and_said(rendered):
    other = replace(rendered.board, legacy=not rendered.board.legacy)
    view = detect_views(rendered.named()[:1], other).views[0]
    np.testing.assert_allclose(view.pixels, rendered.corners[0], atol=0.1)
    told = any("and was read as such" in said for said in view.findings)
    assert told == (rendered.board.rows % 2 == 0), "only boards with even rows have two patterns"


def test_a_mirror_image_is_said(rendered):
    name, image = rendered.named()[0]
    missed = detect_views([(name, image[:, ::-1])], rendered.board).missed[0]
    assert "the image is mirrored" in missed.reason


def test_another_dictionary_is_told():
    rendered = render_set(CAMERA, BOARDS[2], 1, np.random.default_rng(1))
    missed = detect_views(rendered.named(), replace(BOARDS[2], dictionary="7x7_250")).missed[0]
    assert "try --dictionary 5x5" in missed.reason


def test_another_width_is_told(rendered):
    board = rendered.board
    wrong = CharucoBoard(board.columns + 2, board.rows, 0.03, board.marker_m, "6x6_250")
    wrong = replace(wrong, dictionary=board.dictionary)
    missed = detect_views(rendered.named()[:1], wrong).missed[0]
    assert f"as on a board {board.columns} squares wide" in missed.reason


def test_a_part_of_the_board_is_enough(rendered):
    image, truth = np.array(rendered.images[1]), rendered.corners[1]
    cut = int(np.median(truth[:, 0]))
    image[:, :cut] = 127
    view, _, _ = detect_view("half", image, rendered.board)
    assert 0 < len(view) < rendered.board.count
    np.testing.assert_allclose(view.pixels, truth[view.ids], atol=0.1)
    assert (view.pixels[:, 0] > cut).all()


@pytest.mark.parametrize(("picture", "corners"), [("choriginal.jpg", 24), ("chocclusion_original.jpg", 16)])
@pytest.mark.parametrize("legacy", [False, True])
def test_the_tutorials_pictures(data_dir, picture, corners, legacy):
    image = cv2.imread(str(data_dir / "vision" / "aruco" / picture))
    detections = detect_views([(picture, image)], replace(TUTORIAL, legacy=legacy))
    assert [len(view) for view in detections.views] == [corners]
    assert detections.views[0].findings == ()


def test_boards_of_markers_give_four_corners_each():
    board = MarkerBoard.grid(4, 3, 0.04, 0.01, first=7)
    rendered = render_set(CAMERA, board, 3, np.random.default_rng(2))
    for view, truth in zip(detect_views(rendered.named(), board).views, rendered.corners, strict=True):
        np.testing.assert_array_equal(view.ids, np.arange(48))
        assert (np.abs(view.pixels - truth) < 6.0 * view.sigma_px[:, None]).all()


@pytest.mark.parametrize("board", [TUTORIAL, MarkerBoard.grid(2, 2, 0.04, 0.01)], ids=lambda b: b.kind)
def test_nothing_is_found_where_there_is_nothing(board):
    missed = detect_views([("flat", np.full((240, 320), 127, np.uint8))], board).missed[0]
    assert f"no {board.name} found" in missed.reason
