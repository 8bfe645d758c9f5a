"""Figures of factor graphs: SLAM, pose graphs, markers with an IMU, camera-IMU calibration.

`python graphs.py [--json] [--only NAME,NAME] [--quick]`.  Each part stands in `measure/NAME.py` and gives
its own rows; `--quick` runs them on fewer seeds while something is being made, and is no measurement.  Ends
with exit code 3 when a must is missed.
"""

from __future__ import annotations

import sys

from measure.parts import run_parts

PARTS = (
    "pose_graphs",
    "false_loops",
    "mrclam_slam",
    "simulated_loops",
    "victoria_park",
    "planar_monocular",
    "starry_night",
    "incremental_graphs",
    "marker_corners",
    "marker_inertial",
    "camera_imu",
    "vision_imu_orientation",
)

if __name__ == "__main__":
    sys.exit(run_parts(__doc__, PARTS))
