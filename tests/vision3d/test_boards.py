"""Boards: places of their points equal OpenCV's, their symmetries, and how they are written."""

import cv2
import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from vision3d.boards import (
    DICTIONARIES,
    CharucoBoard,
    Checkerboard,
    CircleGrid,
    MarkerBoard,
    board_from_text,
    dictionary_name,
    metres,
    opencv_dictionary,
    size_from_text,
)

EVERY_BOARD = [
    Checkerboard(9, 6, 0.025),
    Checkerboard(8, 6, 0.03),
    Checkerboard(7, 5, 0.03),
    CharucoBoard(5, 7, 0.04, 0.02, "6x6_250"),
    CharucoBoard(8, 6, 0.03, 0.02, legacy=True),
    CircleGrid(7, 5, 0.02),
    CircleGrid(4, 11, 0.02, asymmetric=True),
    CircleGrid(4, 10, 0.02, asymmetric=True),
    MarkerBoard.grid(4, 3, 0.04, 0.01),
    MarkerBoard.single(23, 0.05, "tag36h11"),
]
LATTICES = [board for board in EVERY_BOARD if board.shape != (0, 0)]


@pytest.mark.parametrize("board", EVERY_BOARD, ids=lambda b: b.name)
def test_points_lie_inside_the_outline_and_are_read_only(board):
    assert board.points.shape == (board.count, 3)
    low, high = board.outline.min(axis=0), board.outline.max(axis=0)
    assert ((board.points >= low - 1e-12) & (board.points <= high + 1e-12)).all()
    assert len(np.unique(board.points.round(9), axis=0)) == board.count
    for array in (board.points, board.outline):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1.0


@pytest.mark.parametrize("board", LATTICES, ids=lambda b: b.name)
def test_lattice_numbers_the_points_row_by_row(board):
    columns, rows = board.shape
    assert board.count == columns * rows
    np.testing.assert_array_equal(board.lattice @ [1, columns], np.arange(board.count))
    neighbours = np.linalg.norm(np.diff(board.points[:: columns or 1], axis=0), axis=1)
    assert neighbours.min() >= board.pitch_m * (1 - 1e-12)


@pytest.mark.parametrize("board", [b for b in LATTICES if b.half_turn is not None], ids=lambda b: b.name)
def test_half_turn_maps_the_board_onto_itself(board):
    centred = board.points[:, :2] - board.points[:, :2].mean(axis=0)
    np.testing.assert_allclose(-centred[board.half_turn], centred, atol=1e-12)


def test_which_boards_look_the_same_upside_down():
    assert Checkerboard(9, 6, 1.0).half_turn is None
    assert Checkerboard(8, 6, 1.0).half_turn is not None
    assert Checkerboard(7, 7, 1.0).half_turn is not None
    assert CircleGrid(4, 11, 0.02, asymmetric=True).half_turn is None
    assert CircleGrid(4, 10, 0.02, asymmetric=True).half_turn is not None
    assert CircleGrid(4, 5, 0.02).half_turn is not None
    assert CharucoBoard(5, 7, 0.04, 0.02).half_turn is None


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize(("columns", "rows"), [(5, 7), (8, 6), (7, 4), (6, 5)])
def test_charuco_is_opencvs(columns, rows, legacy):
    board = CharucoBoard(columns, rows, 0.04, 0.03, "5x5_100", legacy)
    theirs = board.opencv()
    np.testing.assert_allclose(np.reshape(theirs.getChessboardCorners(), (-1, 3)), board.points, atol=1e-7)
    np.testing.assert_allclose(np.reshape(theirs.getObjPoints(), (-1, 4, 3)), board.marker_corners, atol=1e-7)
    picture = theirs.generateImage((columns * 40, rows * 40), marginSize=0)
    for row in range(rows):
        for column in range(columns):
            corner = picture[row * 40 + 2, column * 40 + 2]
            assert (corner < 128) == board.is_dark(column, row)


def test_marker_grid_is_opencvs():
    board = MarkerBoard.grid(4, 3, 0.04, 0.01, "4x4_50", first=5)
    theirs = cv2.aruco.GridBoard((4, 3), 0.04, 0.01, opencv_dictionary("4x4_50"), np.arange(5, 17))
    np.testing.assert_allclose(np.reshape(theirs.getObjPoints(), (-1, 4, 3)), board.corners, atol=1e-7)
    np.testing.assert_array_equal(np.ravel(theirs.getIds()), board.ids)
    np.testing.assert_array_equal(np.ravel(board.opencv().getIds()), board.ids)


def test_asymmetric_grid_is_opencvs_formula():
    points = CircleGrid(4, 11, 0.02, asymmetric=True).points
    expected = [((2 * j + i % 2) * 0.02, i * 0.02, 0.0) for i in range(11) for j in range(4)]
    np.testing.assert_allclose(points, expected, atol=1e-12)


@pytest.mark.parametrize("name", DICTIONARIES)
def test_dictionaries_are_opencvs(name):
    theirs, ours = opencv_dictionary(name), DICTIONARIES[name]
    assert (theirs.markerSize, len(theirs.bytesList)) == (ours.bits, ours.count)
    assert dictionary_name(ours.opencv) == name


@pytest.mark.parametrize(
    ("written", "name"),
    [("DICT_4X4_50", "4x4_50"), ("tag36h11", "apriltag_36h11"), ("AprilTag 25h9", "apriltag_25h9"),
     ("36h11", "apriltag_36h11"), ("ARUCO-ORIGINAL", "aruco_original"), ("6X6_250", "6x6_250")],
)  # fmt: skip
def test_dictionaries_are_known_however_they_are_written(written, name):
    assert dictionary_name(written) == name


def test_lengths_carry_units():
    assert metres("25mm") == metres("2.5 cm") == metres("0.025m") == metres(0.025) == pytest.approx(0.025)
    assert metres("1in") == pytest.approx(0.0254)
    assert [size_from_text(t) for t in ("9x6", "9 X 6", "9×6", "9,6")] == [(9, 6)] * 4


def test_boards_are_built_from_text():
    assert board_from_text("9x6", square="25mm") == Checkerboard(9, 6, 0.025)
    assert board_from_text("4x11", square="2cm", kind="acircles").asymmetric
    charuco = board_from_text("5x7", square="40mm", kind="charuco", marker="20mm", dictionary="6x6_250")
    assert charuco == CharucoBoard(5, 7, 0.04, 0.02, "6x6_250")
    assert board_from_text("4x3", square="40mm", kind="markers").count == 48


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Checkerboard(1, 6, 0.025), "at least 2; got 1"),
        (lambda: Checkerboard(9, 6, -1.0), "positive length"),
        (lambda: Checkerboard(9, 6, float("nan")), "positive length"),
        (lambda: CharucoBoard(5, 7, 0.02, 0.04), "does not fit"),
        (lambda: CharucoBoard(12, 12, 0.02, 0.01, "4x4_50"), "72 markers, and 4x4_50 only 50"),
        (lambda: CircleGrid(4, 5, 0.02, diameter_m=0.03), "touch"),
        (lambda: MarkerBoard.grid(8, 8, 0.04, 0.01, "4x4_50"), "from 0 to 49"),
        (lambda: board_from_text("9 by 6", square="25mm"), "such as 9x6; got '9 by 6'"),
        (lambda: board_from_text("9x6", square="25"), "did you mean 25mm"),
        (lambda: board_from_text("9x6", square="25 furlongs"), "with a unit"),
        (lambda: board_from_text("9x6", square="0mm"), "more than 0"),
        (lambda: board_from_text("9x6", square="1mm", kind="chess"), "one of checkerboard"),
        (lambda: dictionary_name("apriltag_36h12"), "no marker dictionary"),
    ],
)  # fmt: skip
def test_what_is_no_board_is_said(make, said):
    with pytest.raises(ModelError, match=said):
        make()


def test_marker_boards_need_four_corners_each():
    with pytest.raises(ShapeError, match=r"\(2, 4, 3\)"):
        MarkerBoard(np.arange(2), np.zeros((2, 3)))
    with pytest.raises(ModelError, match="repeat"):
        MarkerBoard(np.array([3, 3]), np.zeros((2, 4, 3)))
