"""Bad light, bad focus, few pixels, many pixels, wide lenses: boards are found, and sigma stays honest."""

import numpy as np
import pytest

from sequential.errors import ModelError
from vision3d.boards import Checkerboard, CircleGrid
from vision3d.calibrate.detection import detect_views
from vision3d.calibrate.detection.smooth import fit_smooth
from vision3d.camera import Camera
from vision3d.render import board_pixels, board_poses, render_set

BOARD = Checkerboard(9, 6, 0.025)
DISTORTION = np.array([-0.28, 0.02, 0.0012, -0.0001, 0.16])


def brown(scale=1.0):
    size = (round(640 * scale), round(480 * scale))
    return Camera("brown5", np.array([533.0, 533.0, 342.0, 234.0]) * scale, DISTORTION, size)


FISHEYE = Camera(
    "fisheye4", np.array([300.0, 300.0, 320.0, 240.0]), np.array([0.02, -0.01, 0.003, -0.001]), (640, 480)
)
CONDITIONS = {
    "noise 4 times": (brown(), {"noise": 8.0}),
    "noise 8 times": (brown(), {"noise": 16.0}),
    "blurred": (brown(), {"blur_px": 2.0}),
    "very blurred": (brown(), {"blur_px": 4.0}),
    "dark": (brown(), {"exposure": 40.0}),
    "overexposed": (brown(), {"exposure": 320.0}),
    "squares of 14 px": (brown(0.5), {}),
    "squares of 8 px": (brown(0.3), {}),
    "fisheye": (FISHEYE, {}),
}


@pytest.mark.parametrize("condition", CONDITIONS)
def test_boards_are_found_and_sigmas_honest(condition):
    camera, settings = CONDITIONS[condition]
    rendered = render_set(camera, BOARD, 5, np.random.default_rng(3), **settings)
    detections = detect_views(rendered.named(), BOARD)
    assert [len(view) for view in detections.views] == [54] * 5
    assert not any(audit.suspicious for audit in detections.audits)
    errors = np.array([v.pixels - truth for v, truth in zip(detections.views, rendered.corners, strict=True)])
    z = errors / np.array([view.sigma_px for view in detections.views])[..., None]
    assert 0.75 < np.sqrt(np.mean(z**2)) < 1.3


def test_blur_and_darkness_are_said():
    blurred = render_set(brown(), BOARD, 1, np.random.default_rng(3), blur_px=4.0)
    assert "edges are blurred by 4" in detect_views(blurred.named(), BOARD).views[0].findings[0]
    dark = render_set(brown(), BOARD, 1, np.random.default_rng(3), exposure=20.0, noise=0.5)
    assert "give more light" in detect_views(dark.named(), BOARD).views[0].findings[0]


def test_a_large_image_is_searched_reduced_and_measured_whole():
    rendered = render_set(brown(3.0), BOARD, 1, np.random.default_rng(3))
    view = detect_views(rendered.named(), BOARD).views[0]
    assert np.sqrt(np.mean((view.pixels - rendered.corners[0]) ** 2)) < 0.015


def test_images_that_are_mirrored_against_the_others_are_named():
    board = Checkerboard(7, 5, 0.03)
    rendered = render_set(brown(), board, 4, np.random.default_rng(5))
    named = [(name, image[:, ::-1] if name == "view02" else image) for name, image in rendered.named()]
    findings = detect_views(named, board).findings
    assert any("view02 is mirrored against the others" in said for said in findings)
    assert not any("mirrored" in said for said in detect_views(rendered.named(), board).findings)


@pytest.mark.parametrize("board", [Checkerboard(8, 6, 0.03), Checkerboard(7, 5, 0.03)], ids=lambda b: b.name)
def test_a_board_that_looks_the_same_upside_down_is_said(board):
    rendered = render_set(brown(), board, 1, np.random.default_rng(5))
    assert "looks the same upside down" in detect_views(rendered.named(), board).findings[0]


def test_circles_have_no_window():
    with pytest.raises(ModelError, match="circles have none"):
        detect_views([], CircleGrid(7, 5, 0.03), window=5)


@pytest.mark.parametrize("camera", [brown(), FISHEYE], ids=["brown", "fisheye"])
def test_a_view_of_a_plane_is_smooth(camera):
    """What a lens makes of a plane is within 0.003 px of the model: residuals are the corners' own."""
    for pose in board_poses(camera, BOARD, 10, np.random.default_rng(1)):
        smooth = fit_smooth(BOARD.points, board_pixels(camera, BOARD, pose), camera.size)
        assert smooth.scale_px < 0.003
        np.testing.assert_allclose(
            smooth.at(BOARD.points[:, :2]), board_pixels(camera, BOARD, pose) - smooth.residuals, atol=1e-9
        )


def test_one_corner_out_of_line_does_not_move_the_others(rng):
    pixels = board_pixels(brown(), BOARD, board_poses(brown(), BOARD, 1, rng)[0])
    noisy = pixels + 0.02 * rng.standard_normal(pixels.shape)
    noisy[22] += [3.0, -2.0]
    smooth = fit_smooth(BOARD.points, noisy, (640, 480))
    assert 0.014 < smooth.scale_px < 0.028
    np.testing.assert_allclose(smooth.residuals[22], [3.0, -2.0], atol=0.1)
    assert np.abs(np.delete(smooth.residuals, 22, axis=0)).max() < 0.1
