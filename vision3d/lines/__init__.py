"""Lines: the one that a robot follows, those of a scene, and the ground they lie on.

reading = find_line(image)                                   # offset, heading, confidence, or a reason
ground = GroundHomography.from_camera(camera, CameraMount(height_m=0.2, pitch_rad=0.6))
ground.read(reading)                                         # metres, with their covariance
"""

from vision3d.lines.detector import find_line
from vision3d.lines.drawing import draw_lane, draw_line, draw_segments
from vision3d.lines.ground import GroundHomography, GroundPoints, GroundReading
from vision3d.lines.lane import Lane, find_lane
from vision3d.lines.mount import CameraMount, planar_pose, plane_homography
from vision3d.lines.scene import Scene, read_scene
from vision3d.lines.segments import SegmentSettings, find_segments, merge_segments
from vision3d.lines.settings import NO_LINE, LineReading, LineSettings
from vision3d.lines.two_rows import TwoRows, read_two_rows
from vision3d.lines.vanishing import VanishingPoint, vanishing_points

__all__ = [
    "NO_LINE",
    "CameraMount",
    "GroundHomography",
    "GroundPoints",
    "GroundReading",
    "Lane",
    "LineReading",
    "LineSettings",
    "Scene",
    "SegmentSettings",
    "TwoRows",
    "VanishingPoint",
    "draw_lane",
    "draw_line",
    "draw_segments",
    "find_lane",
    "find_line",
    "find_segments",
    "merge_segments",
    "planar_pose",
    "plane_homography",
    "read_scene",
    "read_two_rows",
    "vanishing_points",
]
