"""Stereo calibration of OpenCV's thirteen left and right pictures beside OpenCV, and of rendered ones.

RMS is OpenCV's: the root mean square distance of all corners of both images from their projections.  Rows are
those of `cv2.stereoRectify` with alpha 0, over all corners.  Both are also measured on OpenCV's corners
(`cornerSubPix` with half-width 5), on which the reference figures stand.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from measure.figures import Figure, say
from sequential.manifold import SE3
from vision3d.boards import Checkerboard
from vision3d.calibrate import choose_lens
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.images import ImageSet, read_images
from vision3d.render.rig_set import render_board_pairs
from vision3d.stereo import StereoRig, rectify
from vision3d.stereo.fit import calibrate_stereo
from vision3d.stereo.lens_pair import calibrate_with_best_lenses
from vision3d.stereo.row_errors import Measured, measured
from vision3d.stereo.view_pairs import ViewPair, pairs_of_views
from vision3d.views import View

BOARD = Checkerboard(9, 6, 0.025)
SIZE = (640, 480)
REFERENCE = "OpenCV on its corners 0.2151 px, 83.18 mm, rows 0.165 px, squares 25.009 ± 0.204 mm"
SETS, QUICK_SETS, PAIRS = 24, 4, 12
TRUTH = StereoRig(
    Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), SIZE),
    Camera("brown5", (536.2, 535.8, 327.1, 243.3), (-0.27, 0.08, 0.0003, -0.0009, 0.01), SIZE),
    np.array([0.99973, 0.005, 0.01, -0.003, -0.083, 0.0011, 0.0007]),
)


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Rows of the real pairs, and of rendered ones."""
    data = os.environ.get("FACTORLAB_DATA")
    rows: dict[str, Figure] = {}
    if data:
        say("stereo calibration: the real pairs")
        rows |= real_pairs(Path(data) / "vision" / "opencv")
    say("stereo calibration: rendered pairs")
    return rows | rendered_pairs(QUICK_SETS if quick else SETS)


def real_pairs(folder: Path) -> dict[str, Figure]:
    """Ours by default, ours on OpenCV's corners, and OpenCV on both."""
    images = [read_images(str(folder / f"{side}??.jpg")) for side in ("left", "right")]
    ours = pairs_of_views(*(detect_views(one, BOARD).views for one in images))
    theirs = pairs_of_views(*(opencv_views(one) for one in images))
    found, held = calibrate_with_best_lenses(ours, lenses_of(ours))
    sizes, lenses = rows_of(found.rig, ours), (found.rig.left.lens, found.rig.right.lens)
    equal = tuple(of_one_sigma(pair) for pair in theirs)
    same, _ = calibrate_with_best_lenses(equal, lenses_of(equal))
    same_lenses = same.rig.left.lens, same.rig.right.lens
    same_rows = rows_of(same.rig, theirs)
    peer_rms, peer = opencv_rig(theirs)
    peer_rows = rows_of(peer, theirs)
    on_ours_rms, on_ours = opencv_rig(ours)
    on_ours_rows = rows_of(on_ours, ours)
    std = 1e3 * (found.rig.baseline_std_m or 0.0)
    return {
        "stereo_rms": Figure(found.rms_all_px, "px", f"{REFERENCE}; lenses {' and '.join(lenses)}", 0.22),
        "stereo_row_error": Figure(sizes.row_px, "px", "OpenCV on its corners 0.165", 0.17, 0.165),
        "stereo_left_out_row_error": Figure(held.row_px, "px", "pairs that the rig has not seen", 0.17),
        "stereo_baseline": Figure(
            1e3 * found.rig.baseline_m, "mm", f"± {std:.3f}; OpenCV on its corners 83.18"
        ),
        "stereo_square_off": Figure(
            1e3 * abs(sizes.side_m - BOARD.square_m),
            "mm",
            f"{1e3 * sizes.side_m:.3f} ± {1e3 * sizes.side_std_m:.3f} mm measured; OpenCV 25.009 ± 0.204",
            0.05,
            0.01,
        ),
        "stereo_square_scatter": Figure(1e3 * sizes.side_std_m, "mm", "OpenCV on its corners 0.204", 0.204),
        "stereo_rms_same_corners": Figure(
            same.rms_all_px,
            "px",
            f"lenses {' and '.join(same_lenses)}; OpenCV in this run, five coefficients: {peer_rms:.4f}",
            0.22,
        ),
        "stereo_row_error_same_corners": Figure(
            same_rows.row_px,
            "px",
            f"OpenCV in this run {peer_rows.row_px:.4f}",
            0.17,
            0.165,
        ),
        "stereo_opencv_on_our_corners": Figure(
            on_ours_rows.row_px, "px", f"rows of OpenCV's rig from our corners; its RMS {on_ours_rms:.4f}"
        ),
    }


def rendered_pairs(sets: int) -> dict[str, Figure]:
    """Errors of right_T_left over their standard deviations, detection included."""
    z, nees, rows = [], [], []
    for seed in range(sets):
        rendered = render_board_pairs(TRUTH, BOARD, PAIRS, np.random.default_rng(seed))
        views = [
            detect_views([(f"{k}", image) for k, image in enumerate(images)], BOARD).views
            for images in (rendered.left, rendered.right)
        ]
        if len(views[0]) != len(views[1]):
            continue
        rig = calibrate_stereo(pairs_of_views(*views), "brown5").rig
        error = SE3().local(rig.right_T_left, TRUTH.right_T_left)
        z.append(error / np.sqrt(np.diag(rig.cov)))
        nees.append(error @ np.linalg.solve(rig.cov, error) / 6.0)
        rows.append(true_rows(rig))
    said = f"{len(z)} rendered sets of {PAIRS} pairs; 1 = honest"
    size = float(np.sqrt(np.mean(np.square(z))))
    return {
        "stereo_pose_z_rms": Figure(size, "", said, 1.3, 1.15),
        "stereo_pose_nees": Figure(
            float(np.mean(nees)), "", f"over its 6 degrees of freedom; {said}", 1.5, 1.2
        ),
        "stereo_true_row_error": Figure(
            float(np.sqrt(np.mean(np.square(rows)))),
            "px",
            "true points all over the image, rectified by the rig",
        ),
    }


def true_rows(rig: StereoRig) -> float:
    """RMS row difference of true points that the boards covered, rectified by an estimated rig."""
    x, y = np.meshgrid(np.linspace(80, 560, 9), np.linspace(60, 420, 7))
    rays = TRUTH.left.unproject(np.column_stack([x.ravel(), y.ravel()]))
    left, right = TRUTH.project(0.6 * rays)
    seen = ((right >= 0) & (right <= np.array(SIZE) - 1)).all(axis=1)
    errors = rectify(rig).row_errors(left[seen], right[seen])
    return float(np.sqrt(np.mean(errors**2)))


def rows_of(rig: StereoRig, pairs: tuple[ViewPair, ...]) -> Measured:
    """Rows and squares over all corners."""
    return measured(rectify(rig, alpha=0.0), pairs)


def lenses_of(pairs: tuple[ViewPair, ...]) -> tuple[str, str]:
    """The lens of each camera that predicts left-out pictures best."""
    left, right = ([getattr(pair, side) for pair in pairs] for side in ("left", "right"))
    return choose_lens(left).chosen, choose_lens(right).chosen


def opencv_views(images: ImageSet) -> list[View]:
    """Corners as the reference found them."""
    views = []
    for name, image in images:
        found, corners = cv2.findChessboardCorners(image, BOARD.shape)
        if not found:
            continue
        refined = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), (3, 50, 1e-4)).reshape(-1, 2)
        points = BOARD.points
        views.append(View(name, SIZE, points, refined, np.arange(len(points)), 0.1))
    return views


def of_one_sigma(pair: ViewPair) -> ViewPair:
    """All corners equally sure, as OpenCV takes them."""
    left, right = (
        None if view is None else replace(view, sigma_px=np.array(0.1)) for view in (pair.left, pair.right)
    )
    return ViewPair(pair.name, left, right)


def opencv_rig(pairs: tuple[ViewPair, ...]) -> tuple[float, StereoRig]:
    """OpenCV's joint calibration, five coefficients, begun from each camera alone: its RMS and its rig."""
    common = [pair.common() for pair in pairs]
    points = [np.float32(left.points) for left, _ in common]
    seen = [[np.float32(views[k].pixels).reshape(-1, 1, 2) for views in common] for k in (0, 1)]
    alone = [cv2.calibrateCamera(points, one, SIZE, None, None)[1:3] for one in seen]
    rms, K1, d1, K2, d2, R, T, *_ = cv2.stereoCalibrate(
        points,
        *seen,
        *alone[0],
        *alone[1],
        SIZE,
        flags=cv2.CALIB_USE_INTRINSIC_GUESS,
        criteria=(3, 100, 1e-5),
    )
    left, right = (Camera.from_matrix(K, d, SIZE) for K, d in ((K1, d1), (K2, d2)))
    return float(rms), StereoRig.from_opencv(left, right, R, T)
