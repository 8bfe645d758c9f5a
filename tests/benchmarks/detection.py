"""Detection of boards beside OpenCV's, on rendered images whose corners are known, and on the real ones.

`python detection.py [--json] [--quick]`; --quick takes a quarter of the images; needs FACTORLAB_DATA.  Errors
are RMS of a coordinate; z is error / stated σ.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
from measure.figures import Figure, publish, say

from vision3d.boards import CharucoBoard, Checkerboard, CircleGrid
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.cv import detect_charuco, find_chessboard, find_circles, refine_corners
from vision3d.render import render_set

CAMERA = Camera("brown5", (533.0, 533.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (640, 480))
LEFT, TUTORIAL = Checkerboard(9, 6, 0.025), CharucoBoard(5, 7, 0.04, 0.02, "6x6_250")
BOARDS = {
    "checkerboard": LEFT,
    "charuco": CharucoBoard(8, 6, 0.03, 0.0225, "4x4_50"),
    "circles": CircleGrid(7, 5, 0.03),
    "acircles": CircleGrid(4, 11, 0.02, asymmetric=True),
}
BEST_CV2 = {"checkerboard": "cornerSubPix ±5", "charuco": "CharucoDetector"}


def theirs(image, board):
    """What OpenCV finds: ids and pixels; nothing where it finds nothing."""
    if isinstance(board, CharucoBoard):
        found = detect_charuco(image, board.opencv())
        return found.ids, found.corners
    if isinstance(board, CircleGrid):
        whole, pixels = find_circles(image, *board.shape, asymmetric=board.asymmetric)
    else:
        whole, pixels = find_chessboard(image, *board.shape)
        pixels = refine_corners(image, pixels, 5)
    return (np.arange(board.count), pixels) if whole else (np.empty(0, int), np.empty((0, 2)))


def errors(ids, pixels, truth, board):
    """Errors (N, 2); a board that looks the same upside down may be numbered from either end."""
    ways = (truth[ids], truth[::-1][ids])
    best = min(ways, key=lambda way: np.abs(pixels - way).sum())
    return pixels - (best if board.half_turn is not None or not isinstance(board, CharucoBoard) else ways[0])


def rendered_figures(count: int) -> dict[str, Figure]:
    """Corners by kind of board."""
    figures = {}
    for kind, board in BOARDS.items():
        rendered = render_set(CAMERA, board, count, np.random.default_rng(11))
        detect_views(rendered.named()[:1], board)
        begin = perf_counter()
        views = detect_views(rendered.named(), board, workers=1).views
        seconds = (perf_counter() - begin) / count
        truth = dict(zip((name for name, _ in rendered.named()), rendered.corners, strict=True))
        ours = [errors(view.ids, view.pixels, truth[view.name], board) for view in views]
        z = [off / view.sigma_px[:, None] for off, view in zip(ours, views, strict=True)]
        pairs = zip(rendered.images, rendered.corners, strict=True)
        other = [errors(*theirs(image, board), corners, board) for image, corners in pairs]
        cv2_error = rms(other)
        name = BEST_CV2.get(kind, "findCirclesGrid")
        figures |= {
            f"{kind}_found": Figure(len(views), "images", f"of {count}", count, None, "higher"),
            f"{kind}_error": Figure(rms(ours), "px", f"{name} {cv2_error:.4f}", cv2_error, 0.5 * cv2_error),
            f"{kind}_z": Figure(rms(z), "", "RMS of error / σ", 1.35, 1.2),
            f"{kind}_ms": Figure(1e3 * seconds, "ms", "an image of 640x480, one thread"),
        }
    return figures


def rms(parts) -> float:
    """Root of the mean square of all entries."""
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def real_figures() -> dict[str, Figure]:
    """OpenCV's own images."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "")) / "vision"
    if not folder.is_dir():
        sys.exit(f"there is no {folder}: set FACTORLAB_DATA to the folder of the data")
    files = sorted((folder / "opencv").glob("left??.jpg"))
    left = [(file.name, cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)) for file in files]
    moved = [len(audit.moved) for audit in detect_views(left, LEFT, window=11).audits]
    figures = {
        "left_found": Figure(len(detect_views(left, LEFT).views), "images", "of 13", 13, 13, "higher"),
        "left_moved_by_window_11": Figure(sum(moved), "corners", "15 between windows", 1, None, "higher"),
    }
    for name, count in (("choriginal", 24), ("chocclusion_original", 16)):
        image = cv2.imread(str(folder / "aruco" / f"{name}.jpg"))
        found = sum(len(view) for view in detect_views([(name, image)], TUTORIAL).views)
        figures[f"{name}_corners"] = Figure(found, "corners", f"{count}", count, None, "higher")
    return figures


def main() -> int:
    """Measure and publish."""
    say("rendered boards")
    figures = rendered_figures(10 if "--quick" in sys.argv[1:] else 40)
    say("OpenCV's images")
    return publish(figures | real_figures())


if __name__ == "__main__":
    sys.exit(main())
