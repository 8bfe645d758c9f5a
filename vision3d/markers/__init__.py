"""Square markers (ArUco, AprilTag): found, their poses with both readings and the odds, followed in time."""

from vision3d.markers.detection import Marker, detect_markers, find_markers

__all__ = ["Marker", "detect_markers", "find_markers"]
