"""Camera calibration that knows how sure it is.

from vision3d.calibrate import calibrate, choose_lens, projection_uncertainty
found = choose_lens(views).calibration      # views: vision3d.views.View
found.camera, found.std, found.report.message
projection_uncertainty(found).map_px
"""

from vision3d.calibrate.calibration import Calibration, SolveReport
from vision3d.calibrate.coverage import Coverage, coverage
from vision3d.calibrate.cross_validation import LeaveOneOut, leave_one_out
from vision3d.calibrate.difference import DifferenceMap, difference
from vision3d.calibrate.fit import calibrate
from vision3d.calibrate.lens_choice import LensChoice, LensScore, choose_lens
from vision3d.calibrate.next_pose import NextPose, next_pose, next_poses
from vision3d.calibrate.uncertainty import ProjectionUncertainty, pixel_grid, projection_uncertainty

__all__ = [
    "Calibration",
    "Coverage",
    "DifferenceMap",
    "LeaveOneOut",
    "LensChoice",
    "LensScore",
    "NextPose",
    "ProjectionUncertainty",
    "SolveReport",
    "calibrate",
    "choose_lens",
    "coverage",
    "difference",
    "leave_one_out",
    "next_pose",
    "next_poses",
    "pixel_grid",
    "projection_uncertainty",
]
