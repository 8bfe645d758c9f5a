"""Segments, vanishing points and lanes."""

import cv2
import numpy as np
import pytest

from sequential.errors import ModelError
from vision3d.boards import Checkerboard
from vision3d.camera import Camera
from vision3d.lines import (
    CameraMount,
    SegmentSettings,
    draw_lane,
    draw_line,
    draw_segments,
    find_lane,
    find_line,
    find_segments,
    merge_segments,
    planar_pose,
    vanishing_points,
)
from vision3d.render import GroundLine, Plane, board_texture, render_ground, render_planes
from vision3d.rigid import transform

CAMERA = Camera("pinhole", (500.0, 500.0, 320.0, 240.0), (), (640, 480))
MOUNT = CameraMount(0.25, 0.25)


def road(pose=(0.0, 0.0, 0.0), half=0.15):
    lines = [GroundLine(np.array([[-0.5, y], [6.0, y]]), 0.03, ink=0.9, floor=0.3) for y in (half, -half)]
    return render_ground(CAMERA, MOUNT, lines, np.array(pose), rng=np.random.default_rng(4))


def test_pieces_of_one_line_are_one():
    slope = np.array([1.0, 0.3])
    ends = [
        np.concatenate([[a, 5.0 + 0.3 * a], [b, 5.0 + 0.3 * b]]) for a, b in ((0, 80), (100, 160), (170, 300))
    ]
    other = np.array([[20.0, 200.0, 90.0, 120.0]])
    merged = merge_segments(np.vstack([*ends, other]))
    assert len(merged) == 2
    along = merged[0, 2:] - merged[0, :2]
    assert abs(along[1] / along[0] - slope[1]) < 1e-6
    assert np.linalg.norm(along) == pytest.approx(300 * np.hypot(1.0, 0.3), rel=1e-6)
    np.testing.assert_allclose(merged[1], other[0])


def test_parallel_lines_and_distant_pieces_stay_apart():
    apart = np.array([[0.0, 0.0, 100.0, 0.0], [0.0, 6.0, 100.0, 6.0], [300.0, 0.0, 380.0, 0.0]])
    assert len(merge_segments(apart)) == 3


@pytest.mark.parametrize("method", ["lsd", "hough"])
def test_segments_lie_on_the_edges(method):
    texture = board_texture(Checkerboard(3, 3, 0.06))
    pose = np.array([np.cos(0.1), 0.0, 0.0, np.sin(0.1), -0.06, -0.06, 0.5])
    image = render_planes(CAMERA, [Plane(pose, texture)], rng=np.random.default_rng(1))
    segments = find_segments(image, SegmentSettings(method=method))
    assert len(segments) >= 8
    # the edges of the squares, in pixels
    edges = [
        CAMERA.project(transform(pose, np.array(ends)))
        for k in np.arange(-1, 4) * 0.06
        for ends in ([[-0.06, k, 0], [0.18, k, 0]], [[k, -0.06, 0], [k, 0.18, 0]])
    ]
    good = 0
    for segment in segments:
        distances = []
        for a, b in edges:
            normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
            distances.append(np.abs((segment.reshape(2, 2) - a) @ normal).max())
        good += min(distances) < 1.5
    assert good >= 8


def test_the_unknown_way_to_segments_is_refused():
    with pytest.raises(ModelError, match="hough"):
        SegmentSettings(method="canny")


def test_vanishing_points_of_a_plane_are_those_of_its_directions():
    texture = board_texture(Checkerboard(7, 5, 0.05))
    pose = np.array([np.cos(0.35), np.sin(0.35) * 0.8, np.sin(0.35) * 0.6, 0.0, -0.13, -0.1, 0.6])
    image = render_planes(CAMERA, [Plane(pose, texture)], rng=np.random.default_rng(1))
    points = vanishing_points(find_segments(image), (640, 480))
    truth = [transform(pose, axis) - pose[4:] for axis in np.eye(3)[:2]]
    found = [np.linalg.solve(CAMERA.matrix, point.homogeneous) for point in points[:2]]
    for direction in truth:
        cosines = [abs(direction @ one) / np.linalg.norm(one) for one in found]
        assert np.degrees(np.arccos(max(cosines))) < 1.5
    assert sum(point.share for point in points) > 0.7
    assert all("lines" in point.words for point in points)


def test_parallel_lines_meet_nowhere_near():
    segments = np.array([[0.0, 40.0 * k, 300.0, 40.0 * k] for k in range(8)])
    (point,) = vanishing_points(segments, (640, 480))
    assert point.pixel is None
    assert point.words == "8 level lines, parallel in the image"


def test_noise_has_no_vanishing_point(rng):
    ends = rng.uniform(0, 600, (40, 2))
    angles = rng.uniform(0, np.pi, 40)
    segments = np.hstack([ends, ends + 40 * np.column_stack([np.cos(angles), np.sin(angles)])])
    found = vanishing_points(segments, (640, 480), least_share=0.25)
    assert not found
    assert vanishing_points(np.zeros((0, 4)), (640, 480)) == ()


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.0, 0.06, 0.1), (0.5, -0.05, -0.15)])
def test_a_lane_lies_between_its_lines(pose):
    lane = find_lane(road(pose))
    assert lane.found
    world = MOUNT.world_pose(planar_pose(*pose))
    forward = transform(world, np.array([[100.0, 0.0, 0.0]]))
    np.testing.assert_allclose(lane.meeting_px, CAMERA.project(forward)[0], atol=6.0)
    inner = 0.15 - 0.015  # the lines are 3 cm wide
    near = CAMERA.project(transform(world, np.array([[x, inner, 0.0] for x in np.linspace(0.3, 1.5, 400)])))
    at_bottom = np.interp(-lane.left[1], -near[:, 1], near[:, 0])
    assert lane.left[0] == pytest.approx(at_bottom, abs=4.0)


def test_a_robot_left_of_the_middle_sees_the_lane_to_its_right():
    lane = find_lane(road((0.0, 0.05, 0.0)))
    assert lane.offset == pytest.approx(0.05 / 0.27, abs=0.03)
    assert abs(find_lane(road()).offset) < 0.02


def test_no_lane_is_said(rng):
    lane = find_lane(np.full((480, 640), 120, np.uint8))
    assert not lane.found
    assert "lean towards each other" in lane.reason
    assert np.isnan(lane.offset)


def test_drawings_change_the_image_where_things_are():
    image = road()
    lane = find_lane(image)
    drawn = draw_lane(image, lane)
    assert drawn.shape == (480, 640, 3)
    assert not np.array_equal(drawn[470, 320], [image[470, 320]] * 3)
    assert np.array_equal(drawn[10, 10], [image[10, 10]] * 3)
    segments = find_segments(image)
    points = vanishing_points(segments, (640, 480))
    assert (draw_segments(image, segments, points) != cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)).any()
    single = render_ground(CAMERA, MOUNT, GroundLine(np.array([[-1.0, 0], [5.0, 0]])), np.zeros(3))
    reading = find_line(single)
    x, y = np.round(reading.bottom_px).astype(int)
    assert draw_line(single, reading)[y, x].tolist() == [0, 130, 240]
    nothing = find_line(np.full((480, 640), 99, np.uint8))
    assert (draw_line(single, nothing) == single[:, :, None]).all()


def test_a_building_has_upright_and_level_lines(data_dir):
    image = cv2.imread(str(data_dir / "vision/opencv/building.jpg"))
    segments = find_segments(image)
    points = vanishing_points(segments, image.shape[1::-1])
    assert len(segments) > 80
    assert points[0].share + points[1].share > 0.7
    kinds = {point.words.split()[1] for point in points}
    assert {"upright", "level"} <= kinds
