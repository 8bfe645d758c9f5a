"""Square markers (ArUco, AprilTag): found, their poses with both readings and the odds, followed in time.

>>> from vision3d.markers import MarkerTracker, detect_markers, marker_pose
>>> for marker in detect_markers(image, "6x6_250", camera=camera):  # doctest: +SKIP
...     pose = marker_pose(camera, marker.corners, 0.05, marker.cov)
...     pose.camera_T_marker, pose.odds, pose.certain
"""

from vision3d.markers.boards import BoardPose, board_pose, find_board_pose, marker_board_pose
from vision3d.markers.detection import Marker, detect_markers, find_markers
from vision3d.markers.hypothesis import MarkerMotion
from vision3d.markers.pose import CERTAIN, MarkerPose, Mode, marker_corners, marker_pose, marker_poses
from vision3d.markers.sightings import MarkerSightings
from vision3d.markers.tracking import MarkerTracker, TrackedMarker

__all__ = [
    "CERTAIN",
    "BoardPose",
    "Marker",
    "MarkerMotion",
    "MarkerPose",
    "MarkerSightings",
    "MarkerTracker",
    "Mode",
    "TrackedMarker",
    "board_pose",
    "detect_markers",
    "find_board_pose",
    "find_markers",
    "marker_board_pose",
    "marker_corners",
    "marker_pose",
    "marker_poses",
]
