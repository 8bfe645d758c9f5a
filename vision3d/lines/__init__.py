"""Lines: the one that a robot follows, those of a scene, and the ground they lie on."""

from vision3d.lines.detector import find_line
from vision3d.lines.ground import GroundHomography, GroundPoints, GroundReading
from vision3d.lines.mount import CameraMount, planar_pose, plane_homography
from vision3d.lines.settings import NO_LINE, LineReading, LineSettings

__all__ = [
    "NO_LINE",
    "CameraMount",
    "GroundHomography",
    "GroundPoints",
    "GroundReading",
    "LineReading",
    "LineSettings",
    "find_line",
    "planar_pose",
    "plane_homography",
]
