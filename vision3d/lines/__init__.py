"""Lines: the one that a robot follows, those of a scene, and the ground they lie on."""

from vision3d.lines.mount import CameraMount, planar_pose

__all__ = ["CameraMount", "planar_pose"]
