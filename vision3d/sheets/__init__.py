"""Sheets to print: boards and markers, true to size, as SVG and PDF.

>>> from vision3d.boards import Checkerboard
>>> from vision3d.sheets import board_page, pdf_of
>>> pdf_of([board_page(Checkerboard(9, 6, 0.025), "a4")])[:5]
b'%PDF-'
"""

from vision3d.sheets.layout import board_page, calibration_command, largest_square_m, marker_pages
from vision3d.sheets.page import PAPERS, Disc, Line, Page, Rect, Text, paper_size
from vision3d.sheets.pdf import pdf_of
from vision3d.sheets.svg import svg_of

__all__ = [
    "PAPERS",
    "Disc",
    "Line",
    "Page",
    "Rect",
    "Text",
    "board_page",
    "calibration_command",
    "largest_square_m",
    "marker_pages",
    "paper_size",
    "pdf_of",
    "svg_of",
]
