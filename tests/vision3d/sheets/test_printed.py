"""Sheets as a browser and a PDF reader show them: found again, every point where it was meant to be."""

import subprocess

import cv2
import numpy as np
import pypdfium2
import pytest

from vision3d.boards import CharucoBoard, Checkerboard, CircleGrid, MarkerBoard
from vision3d.calibrate.detection import detect_views
from vision3d.markers import detect_markers
from vision3d.sheets import board_page, marker_pages, pdf_of, svg_of

BOARDS = [
    Checkerboard(9, 6, 0.025),
    CharucoBoard(5, 7, 0.03, 0.022),
    CharucoBoard(6, 8, 0.025, 0.018, legacy=True),
    CircleGrid(7, 5, 0.03),
    CircleGrid(4, 11, 0.02, asymmetric=True),
    MarkerBoard.grid(3, 4, 0.04, 0.01, "5x5_100"),
]
GAP_PX = 20


def assert_found_in_place(image, board, scale):
    """The board is seen whole, its points `scale` px a metre from one another, upright."""
    view = detect_views([("sheet", image)], board).views[0]
    assert len(view) == board.count
    measured = (view.pixels - view.pixels.mean(axis=0)) / scale
    meant = (view.points - view.points.mean(axis=0))[:, :2]
    ways = (measured, -measured) if board.half_turn is not None else (measured,)
    error_m = min(np.abs(way - meant).max() for way in ways)
    assert error_m < 0.1e-3, "a tenth of a millimetre"


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.name)
def test_pdf(board):
    page = pypdfium2.PdfDocument(pdf_of([board_page(board)]))[0]
    image = page.render(scale=2.0).to_numpy()
    assert detect_views([("sheet", image[..., :3])], board).views[0].findings == ()
    assert_found_in_place(image[..., :3], board, 2.0 * 72.0 / 0.0254)


def test_pdf_of_single_markers():
    document = pypdfium2.PdfDocument(pdf_of(marker_pages("tag36h11", list(range(8, 24)), 0.04)))
    assert len(document) == 1
    found = detect_markers(np.array(document[0].render(scale=2.0).to_numpy()[..., :3]), "tag36h11")
    assert [marker.id for marker in found] == list(range(8, 24))
    sides = [marker.side_px * 0.0254 / 72.0 / 2.0 for marker in found]
    np.testing.assert_allclose(sides, 0.04, atol=0.1e-3)


def test_svg_in_a_browser(browser, tmp_path):
    pages = [board_page(board) for board in BOARDS]
    images = []
    for number, page in enumerate(pages):
        (tmp_path / f"{number}.svg").write_text(svg_of(page), encoding="utf-8")
        images.append(f'<img src="{number}.svg" style="display:block;margin-bottom:{GAP_PX}px">')
    (tmp_path / "all.html").write_text(f'<body style="margin:0">{"".join(images)}</body>', encoding="utf-8")
    heights = [round(page.height * 96 / 25.4) + GAP_PX for page in pages]
    shot = tmp_path / "all.png"
    subprocess.run(
        [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
         "--hide-scrollbars", f"--window-size=1200,{sum(heights) + 50}", f"--screenshot={shot}",
         (tmp_path / "all.html").as_uri()],
        check=True, capture_output=True, timeout=60,
    )  # fmt: skip
    picture = cv2.imread(str(shot))
    tops = np.cumsum([0, *heights])
    for board, top, height in zip(BOARDS, tops, heights, strict=False):
        assert_found_in_place(picture[top : top + height - GAP_PX], board, 96.0 / 0.0254)
