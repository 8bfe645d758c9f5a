"""Figures of the course: the checker of exercises, the line follower, the UKF beside the EKF, all examples.

`python course.py [--json] [--only NAME,NAME] [--quick]`.  Each part stands in `measure/NAME.py` and gives
its own rows; `--quick` runs them on fewer seeds while something is being made, and is no measurement.  Ends
with exit code 3 when a must is missed.
"""

from __future__ import annotations

import sys

from measure.parts import run_parts

PARTS = ("course_check", "line_follower", "course_ukf", "examples_time")

if __name__ == "__main__":
    sys.exit(run_parts(__doc__, PARTS))
