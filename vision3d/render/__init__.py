"""Rendered truth: photographs of boards, markers, lines and scenes by a camera that is known exactly."""

from vision3d.render.ground import GroundLine, RobotView, drive, line_pixels, random_line, render_ground
from vision3d.render.ground_view import GroundView
from vision3d.render.journeys import (
    forward_poses,
    looking_at,
    observe,
    orbit_poses,
    render_journey,
    scene_points,
    sideways_poses,
    turning_poses,
)
from vision3d.render.material import Material, bricks, leaves, photograph, plain, speckles
from vision3d.render.pairs import StereoView, render_stereo, transfer
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
from vision3d.render.rooms import SCENES, corridor, desk, ground, repeated_wall, wall
from vision3d.render.scene import Plane, render_planes
from vision3d.render.shapes import Shape, box, rectangle, sphere
from vision3d.render.solid import RenderedView, Scene, is_seen, render_scene, surface_points
from vision3d.render.texture import Texture, cells, distance_field, picture
from vision3d.render.video import RenderedFrame, moving_board, moving_markers, write_video

__all__ = [
    "SCENES",
    "GroundLine",
    "GroundView",
    "Material",
    "Plane",
    "RenderedFrame",
    "RenderedSet",
    "RenderedView",
    "RobotView",
    "Scene",
    "Shape",
    "StereoView",
    "Texture",
    "board_pixels",
    "board_planes",
    "board_poses",
    "board_texture",
    "box",
    "bricks",
    "cells",
    "charuco_texture",
    "checkerboard_texture",
    "circles_texture",
    "corridor",
    "desk",
    "distance_field",
    "drive",
    "forward_poses",
    "ground",
    "is_seen",
    "leaves",
    "line_pixels",
    "looking_at",
    "marker_corners",
    "marker_texture",
    "moving_board",
    "moving_markers",
    "observe",
    "orbit_poses",
    "photograph",
    "picture",
    "plain",
    "random_line",
    "rectangle",
    "render_ground",
    "render_journey",
    "render_planes",
    "render_scene",
    "render_set",
    "render_stereo",
    "repeated_wall",
    "scene_points",
    "sideways_poses",
    "speckles",
    "sphere",
    "surface_points",
    "transfer",
    "turning_poses",
    "wall",
    "write_video",
]
