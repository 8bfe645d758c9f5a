"""Boards in images, audited: every point with its standard deviation, every doubt as a sentence.

from vision3d.calibrate.detection import detect_views
detections = detect_views(pairs_of_name_and_image, Checkerboard(9, 6, 0.025))
"""

from vision3d.calibrate.detection.detect import detect_view, detect_views, grey_of
from vision3d.views import Detections, Missed, View, ViewAudit

__all__ = ["Detections", "Missed", "View", "ViewAudit", "detect_view", "detect_views", "grey_of"]
