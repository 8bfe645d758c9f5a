"""Sheets on paper: true to size, inside the margins, and sentences where they do not fit."""

import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from sequential.errors import ModelError
from vision3d.boards import CharucoBoard, Checkerboard, CircleGrid, MarkerBoard
from vision3d.sheets import (
    PAPERS,
    Disc,
    board_page,
    largest_square_m,
    marker_pages,
    paper_size,
    pdf_of,
    svg_of,
)

BOARDS = [
    Checkerboard(9, 6, 0.025),
    CharucoBoard(5, 7, 0.03, 0.022),
    CharucoBoard(6, 8, 0.025, 0.018, legacy=True),
    CircleGrid(7, 5, 0.03),
    CircleGrid(4, 11, 0.02, asymmetric=True),
    MarkerBoard.grid(3, 4, 0.04, 0.01, "5x5_100"),
]
NAMES = [board.name for board in BOARDS]


def extent(page):
    """Left, top, right, bottom of what is printed in black, mm."""
    boxes = [
        (s.x - s.radius, s.y - s.radius, s.x + s.radius, s.y + s.radius)
        if isinstance(s, Disc)
        else (s.x, s.y, s.x + s.width, s.y + s.height)
        for s in page.black
    ]
    boxes = np.array(boxes)
    return [*boxes[:, :2].min(axis=0), *boxes[:, 2:].max(axis=0)]


@pytest.mark.parametrize("paper", ["a4", "letter", "a3", "500x400"])
@pytest.mark.parametrize("board", BOARDS, ids=NAMES)
def test_everything_is_on_the_paper_above_the_words(board, paper):
    page = board_page(board, paper)
    left, top, right, bottom = extent(page)
    assert sorted((page.width, page.height)) == sorted(paper_size(paper))
    assert min(left, top) >= 5.0 - 1e-9
    assert right <= page.width - 5.0 + 1e-9
    assert bottom < min(text.y - text.size for text in page.texts)
    assert max(max(line.x1, line.x2) for line in page.lines) <= page.width - 5.0
    assert max(max(line.y1, line.y2) for line in page.lines) <= page.height - 5.0


@pytest.mark.parametrize("board", [b for b in BOARDS if b.kind != "circles"], ids=lambda b: b.name)
def test_the_pattern_has_the_size_of_the_board(board):
    left, top, right, bottom = extent(board_page(board, "a3"))
    width, height = 1e3 * np.ptp(board.outline[:, :2], axis=0)
    np.testing.assert_allclose([right - left, bottom - top], [width, height], atol=1e-9)


def test_circles_have_their_spacing():
    page = board_page(BOARDS[4])
    places = np.array([(disc.x, disc.y) for disc in page.black])
    np.testing.assert_allclose(places - places[0], 1e3 * (BOARDS[4].points - BOARDS[4].points[0])[:, :2])
    assert {disc.radius for disc in page.black} == {0.5e3 * BOARDS[4].diameter_m}


@pytest.mark.parametrize("paper", PAPERS)
def test_the_largest_square_fits_and_a_larger_one_does_not(paper):
    side = largest_square_m(Checkerboard(9, 6, 0.01), paper)
    board_page(Checkerboard(9, 6, side), paper)
    with pytest.raises(ModelError, match=f"squares of {1e3 * side:g} mm would fit"):
        board_page(Checkerboard(9, 6, side + 0.001), paper)


def test_markers_take_as_many_sheets_as_they_need():
    pages = marker_pages("tag36h11", list(range(25)), 0.05)
    labels = [text.words for page in pages for text in page.texts if " id " in text.words]
    assert len(pages) == 3
    assert labels == [f"apriltag_36h11 · id {k} · 50 mm" for k in range(25)]


@pytest.mark.parametrize("board", BOARDS, ids=NAMES)
def test_svg_is_in_millimetres(board):
    page = board_page(board)
    root = ET.fromstring(svg_of(page))  # noqa: S314 - our own
    assert root.get("width") == f"{page.width:g}mm"
    assert root.get("viewBox") == f"0 0 {page.width:g} {page.height:g}"
    assert len(root.findall("{*}path")) == 1, "one area, so that no light shows between its parts"


def test_pdf_says_where_its_objects_are_and_asks_for_no_scaling():
    data = pdf_of(marker_pages("4x4_50", list(range(30)), 0.05))
    table = int(re.search(rb"startxref\n(\d+)", data)[1])
    assert data[table:].startswith(b"xref")
    for number, place in enumerate(re.findall(rb"(\d{10}) 00000 n", data), 1):
        assert data[int(place) :].startswith(f"{number} 0 obj".encode())
    assert b"/PrintScaling /None" in data
    assert b"/Count 3" in data


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: board_page(Checkerboard(9, 6, 0.05), "a4"), "would fit, or take a2"),
        (lambda: board_page(CircleGrid(9, 6, 0.05), "a4"), "a spacing of"),
        (lambda: paper_size("b5"), "no paper 'b5'"),
        (lambda: paper_size("9x9"), "from 20 to 5000"),
        (lambda: marker_pages("4x4_50", [50], 0.05), "has the markers 0 to 49"),
        (lambda: marker_pages("4x4_50", [], 0.05), "no marker to print"),
        (lambda: marker_pages("4x4_50", [1], 0.3), "does not fit on a4"),
        (lambda: largest_square_m(Checkerboard(900, 600, 0.01), "a4"), "take a larger paper"),
    ],
)
def test_what_cannot_be_printed_is_said(make, said):
    with pytest.raises(ModelError, match=said):
        make()
