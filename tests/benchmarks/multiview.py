"""Figures of several views beside OpenCV, PoseLib and COLMAP, all in this one process.

`python multiview.py [--json] [--only NAME,NAME] [--quick]`.  Each part stands in `measure/NAME.py` and gives
its own rows; `--quick` runs them on fewer seeds while something is being made, and is no measurement.  Ends
with exit code 3 when a must is missed.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path
from time import perf_counter

from measure.figures import Figure, publish, say

sys.path.append(str(Path(__file__).resolve().parents[1]))

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


def measured(parts: list[str], *, quick: bool) -> dict[str, Figure]:
    """The rows of every part, in order."""
    rows: dict[str, Figure] = {}
    for name in parts:
        began = perf_counter()
        rows |= importlib.import_module(f"measure.{name}").figures(quick=quick)
        say(f"{name}: {perf_counter() - began:.0f} s")
    return rows


def main() -> int:
    """Measure, print, and judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default=",".join(PARTS))
    asked = parser.parse_args()
    wanted = asked.only.split(",")
    if unknown := set(wanted) - set(PARTS):
        parser.error(f"no part is called {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    return publish(measured(wanted, quick=asked.quick))


if __name__ == "__main__":
    sys.exit(main())
