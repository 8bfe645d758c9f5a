"""Figures of several views beside OpenCV, PoseLib and COLMAP, all in this one process.

`python multiview.py [--json] [--only NAME,NAME] [--quick]`.  Each part stands in `measure/NAME.py` and gives
its own rows; `--quick` runs them on fewer seeds while something is being made, and is no measurement.  Ends
with exit code 3 when a must is missed.
"""

from __future__ import annotations

import sys

from measure.parts import run_parts

PARTS = (
    "relative_pose",
    "homography_ransac",
    "stereo_calibration",
    "dense_stereo",
    "structure_from_motion",
    "bundle_adjustment",
    "triangulation",
    "start_of_vision",
)

if __name__ == "__main__":
    sys.exit(run_parts(__doc__, PARTS))
