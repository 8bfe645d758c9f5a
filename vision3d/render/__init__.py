"""Rendered truth: photographs of boards, markers and ground lines by a camera that is known exactly."""

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

__all__ = [
    "Plane",
    "RenderedSet",
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
    "marker_corners",
    "marker_texture",
    "picture",
    "render_planes",
    "render_set",
]
