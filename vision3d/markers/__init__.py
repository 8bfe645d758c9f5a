"""Square markers (ArUco, AprilTag): found, their poses with both readings and the odds, followed in time.

>>> from vision3d.markers import detect_markers, marker_pose
>>> for marker in detect_markers(image, "6x6_250"):  # doctest: +SKIP
...     pose = marker_pose(camera, marker.corners, 0.05, marker.cov_px2)
...     pose.camera_T_marker, pose.odds, pose.certain
"""

from vision3d.markers.detection import Marker, detect_markers, find_markers
from vision3d.markers.pose import CERTAIN, MarkerPose, Mode, marker_corners, marker_pose, marker_poses

__all__ = [
    "CERTAIN",
    "Marker",
    "MarkerPose",
    "Mode",
    "detect_markers",
    "find_markers",
    "marker_corners",
    "marker_pose",
    "marker_poses",
]
