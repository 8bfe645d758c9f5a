"""Two pictures: the motion between them, what it is known from, and where a point of one lies in the other.

view = estimate_two_view(camera_a, camera_b, pixels_a, pixels_b)
"""

from vision3d.two_view.epipolar import epipolar_curve, epipolar_lines, fundamental_matrix, sampson_px
from vision3d.two_view.estimate import estimate_two_view
from vision3d.two_view.motion import (
    decompose_essential,
    essential_matrix,
    local_motion,
    recover_pose,
    retract_motion,
)
from vision3d.two_view.planes import decompose_homography, plane_homography
from vision3d.two_view.result import TwoView
from vision3d.two_view.uncalibrated import cameras_from_fundamental, projective_cameras

__all__ = [
    "TwoView",
    "cameras_from_fundamental",
    "decompose_essential",
    "decompose_homography",
    "epipolar_curve",
    "epipolar_lines",
    "essential_matrix",
    "estimate_two_view",
    "fundamental_matrix",
    "local_motion",
    "plane_homography",
    "projective_cameras",
    "recover_pose",
    "retract_motion",
    "sampson_px",
]
