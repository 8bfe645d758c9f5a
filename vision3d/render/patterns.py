"""Textures of calibration boards and markers, in the frames in which their points are given.

The origin is that of `board.points` (a checkerboard's first inner corner), or the centre of a single marker.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold.quaternion import quaternion_from_matrix
from vision3d.boards import (
    DICTIONARIES,
    Board,
    CharucoBoard,
    Checkerboard,
    CircleGrid,
    MarkerBoard,
    dictionary_name,
    opencv_dictionary,
)
from vision3d.render.scene import Plane
from vision3d.render.texture import DARK, LIGHT, PAPER, Texture, cells
from vision3d.rigid import compose

__all__ = [
    "board_planes",
    "board_texture",
    "charuco_texture",
    "checkerboard_texture",
    "circles_texture",
    "marker_corners",
    "marker_texture",
]

SQUARE_MARGIN = 0.6  # paper round a checkerboard, in squares


def board_texture(board: Board) -> Texture:
    """The texture of a checkerboard, a ChArUco board or a circle grid."""
    match board:
        case Checkerboard():
            return checkerboard_texture(board)
        case CharucoBoard():
            return charuco_texture(board)
        case CircleGrid():
            return circles_texture(board)
    raise ModelError(f"no single texture shows a {board.name}; take `board_planes`")


def board_planes(board: Board, camera_T_board: NDArray[np.float64]) -> list[Plane]:
    """Planes that show any board at a pose (7,): one, or one a marker where markers stand by themselves."""
    if not isinstance(board, MarkerBoard):
        return [Plane(camera_T_board, board_texture(board))]
    planes = []
    for number, corners in zip(board.ids, board.corners, strict=True):
        across, down = corners[1] - corners[0], corners[3] - corners[0]
        size = float(np.linalg.norm(across))
        x, y = across / size, down / np.linalg.norm(down)
        own = quaternion_from_matrix(np.column_stack([x, y, np.cross(x, y)]))
        pose = compose(camera_T_board, np.concatenate([own, corners.mean(axis=0)]))
        planes.append(Plane(pose, marker_texture(board.dictionary, int(number), size)))
    return planes


def checkerboard_texture(board: Checkerboard, *, dark: float = DARK, light: float = LIGHT) -> Texture:
    """A checkerboard with its paper: (columns + 1) by (rows + 1) squares, the top left one black."""
    across = _with_margin(board.columns, board.square_m)
    down = _with_margin(board.rows, board.square_m)
    odd = np.add.outer(np.arange(board.rows + 1), np.arange(board.columns + 1)) % 2
    values = np.full((board.rows + 3, board.columns + 3), PAPER, dtype=np.float32)
    values[1:-1, 1:-1] = np.where(odd == 1, light, dark)
    return cells(across, down, values)


def _with_margin(corners: int, square: float) -> NDArray[np.float64]:
    """Edges of the squares round so many inner corners, and of the paper round them."""
    edges = square * np.arange(-1, corners + 1)
    margin = SQUARE_MARGIN * square
    return np.concatenate([[edges[0] - margin], edges, [edges[-1] + margin]])


def marker_corners(size_m: float) -> NDArray[np.float64]:
    """Corners (4, 3) of a marker in its own frame, m: clockwise from the top left, as OpenCV orders them."""
    half = 0.5 * size_m
    return np.array([[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]])


def marker_texture(
    dictionary: str,
    number: int,
    size_m: float,
    *,
    quiet: float = 1.0,
    dark: float = DARK,
    light: float = PAPER,
) -> Texture:
    """An ArUco or AprilTag marker with white paper round it.

    Parameters
    ----------
    dictionary : any way of writing its name: "4x4_50", "apriltag_36h11"
    number : the marker's id
    size_m : side of the black square, m
    quiet : width of the paper round it, in modules of the marker
    """
    bits = marker_bits(dictionary, number)
    module = size_m / len(bits)
    edges = module * np.arange(len(bits) + 1) - 0.5 * size_m
    values = np.where(bits, light, dark)
    if quiet > 0:
        edges = np.concatenate([[edges[0] - quiet * module], edges, [edges[-1] + quiet * module]])
        values = np.pad(values, 1, constant_values=light)
    return cells(edges, edges, values)


def marker_bits(dictionary: str, number: int) -> NDArray[np.bool_]:
    """Modules (n + 2, n + 2) of a marker with its black border, True where white."""
    import cv2

    known = DICTIONARIES[dictionary_name(dictionary)]
    if not 0 <= number < known.count:
        raise ModelError(f"ids of {dictionary} go from 0 to {known.count - 1}; got {number}")
    image = cv2.aruco.generateImageMarker(opencv_dictionary(dictionary), number, known.bits + 2)
    bits: NDArray[np.bool_] = np.asarray(image) > 127
    return bits


def charuco_texture(board: CharucoBoard, *, dark: float = DARK, light: float = PAPER) -> Texture:
    """A ChArUco board with its paper; the markers stand in the light squares, counted row by row."""
    square, marker = board.square_m, board.marker_m
    whites = [(i, j) for i in range(board.rows) for j in range(board.columns) if not board.is_dark(j, i)]
    tags = [marker_bits(board.dictionary, k) for k in range(len(whites))]
    modules = len(tags[0])
    # edges of squares and, within each square, of the modules of a marker
    inside = 0.5 * (square - marker) + marker * np.arange(modules + 1) / modules
    once = np.concatenate([[0.0], inside])
    margin = 0.5 * square
    across, down = (
        np.concatenate(
            [[-margin], *(square * k + once for k in range(count)), [square * count, square * count + margin]]
        )
        for count in (board.columns, board.rows)
    )
    step = len(once)
    values = np.full((len(down) - 1, len(across) - 1), light, dtype=np.float32)
    white = set(whites)
    for i in range(board.rows):
        for j in range(board.columns):
            at = (slice(1 + i * step, 1 + (i + 1) * step), slice(1 + j * step, 1 + (j + 1) * step))
            values[at] = light if (i, j) in white else dark
    for (i, j), bits in zip(whites, tags, strict=True):
        top, left = 2 + i * step, 2 + j * step
        values[top : top + modules, left : left + modules] = np.where(bits, light, dark)
    return cells(across, down, values)


def circles_texture(board: CircleGrid, *, dark: float = DARK) -> Texture:
    """A grid of black circles on paper."""
    points = board.points[:, :2]
    radius = 0.5 * board.diameter_m
    xs, ys = (np.unique(np.round(points[:, k], 9)) for k in (0, 1))
    across, down = (_between(values, 0.6 * board.spacing_m) for values in (xs, ys))
    shape = (len(down) - 1, len(across) - 1)
    radii = np.zeros(shape)
    columns = np.searchsorted(across, points[:, 0]) - 1
    rows = np.searchsorted(down, points[:, 1]) - 1
    radii[rows, columns] = radius
    cell = min(np.diff(across)[1:-1].min(), np.diff(down)[1:-1].min())
    if radius > 0.5 * cell:
        raise ModelError(
            f"circles of {2 * radius:g} m are wider than the {cell:g} m between columns or rows, which the "
            "renderer cannot draw; take a smaller diameter_m"
        )
    return cells(across, down, np.full(shape, PAPER), radii, np.full(shape, dark))


def _between(values: NDArray[np.float64], margin: float) -> NDArray[np.float64]:
    """Edges of cells of equal width with the values in their middles, and of a margin."""
    half = 0.5 * float(np.diff(values).min())
    inner = np.concatenate([values - half, [values[-1] + half]])
    return np.concatenate([[inner[0] - margin], inner, [inner[-1] + margin]])
