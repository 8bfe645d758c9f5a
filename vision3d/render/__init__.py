"""Rendered truth: photographs of boards, markers and ground lines by a camera that is known exactly."""

from vision3d.render.ground import GroundLine, RobotView, drive, line_pixels, random_line, render_ground
from vision3d.render.patterns import (
    board_planes,
    board_texture,
    charuco_texture,
    checkerboard_texture,
    circles_texture,
    marker_corners,
    marker_texture,
)
from vision3d.render.poses import RenderedSet, board_pixels, board_poses, render_set
from vision3d.render.scene import Plane, render_planes
from vision3d.render.texture import Texture, cells, distance_field, picture
from vision3d.render.video import RenderedFrame, moving_board, moving_markers, write_video

__all__ = [
    "GroundLine",
    "Plane",
    "RenderedFrame",
    "RenderedSet",
    "RobotView",
    "Texture",
    "board_pixels",
    "board_planes",
    "board_poses",
    "board_texture",
    "cells",
    "charuco_texture",
    "checkerboard_texture",
    "circles_texture",
    "distance_field",
    "drive",
    "line_pixels",
    "marker_corners",
    "marker_texture",
    "moving_board",
    "moving_markers",
    "picture",
    "random_line",
    "render_ground",
    "render_planes",
    "render_set",
    "write_video",
]
