"""Boards to look at: checkerboards, ChArUco boards, circle grids, markers at known places.

>>> from vision3d.boards import Checkerboard
>>> Checkerboard(9, 6, square_m=0.025).points.shape
(54, 3)
"""

from vision3d.boards.board import Board
from vision3d.boards.charuco import CharucoBoard
from vision3d.boards.checkerboard import Checkerboard
from vision3d.boards.circles import CircleGrid
from vision3d.boards.dictionaries import DICTIONARIES, dictionary_name, opencv_dictionary
from vision3d.boards.marker_board import MarkerBoard
from vision3d.boards.text import KINDS, board_from_text, metres, size_from_text

__all__ = [
    "DICTIONARIES",
    "KINDS",
    "Board",
    "CharucoBoard",
    "Checkerboard",
    "CircleGrid",
    "MarkerBoard",
    "board_from_text",
    "dictionary_name",
    "metres",
    "opencv_dictionary",
    "size_from_text",
]
