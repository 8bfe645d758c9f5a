"""Camera calibration that knows how sure it is.

from vision3d.calibrate import calibrate
found = calibrate(views, "brown5")      # views: vision3d.views.View
found.camera, found.std, found.report.message
"""

from vision3d.calibrate.calibration import Calibration, SolveReport
from vision3d.calibrate.fit import calibrate

__all__ = ["Calibration", "SolveReport", "calibrate"]
