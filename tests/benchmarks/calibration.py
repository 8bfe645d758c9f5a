"""Camera calibration: OpenCV's sample images, rendered truth, Monte Carlo of the uncertainty, choice of lens.

`python calibration.py [--json] [--quick]`; --quick takes a tenth of the sets and runs.  Needs FACTORLAB_DATA.
The first part runs the command itself.  Rendered sets are images by a known camera, found, refined and
calibrated by the default settings; z is (estimate − truth) / stated σ.  The Monte Carlo draws corners of the
sample images' own poses and camera with Gaussian noise.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from measure.calibration_choice import choice_figures
from measure.calibration_rendered import rendered_figures
from measure.calibration_spread import spread_figures
from measure.figures import Figure, publish, say

BOARD = ("--board", "9x6", "--square", "25mm")
PUBLISHED_WINDOW = 11


def sample_images() -> list[Path]:
    """The thirteen pictures of OpenCV's left camera."""
    found = sorted((Path(os.environ.get("FACTORLAB_DATA", "")) / "vision" / "opencv").glob("left[01]?.jpg"))
    if not found:
        sys.exit(
            "no left??.jpg under FACTORLAB_DATA/vision/opencv: set FACTORLAB_DATA to the folder of the data"
        )
    return found


def command(*options: str) -> dict:
    """What `factorlab calibrate camera … --json` says about the sample images."""
    line = [sys.executable, "-m", "factorlab", "calibrate", "camera", *map(str, sample_images()), *BOARD]
    done = subprocess.run([*line, *options, "--json"], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(options) or 'the default command'}: {done.stderr}")
    return json.loads(done.stdout)


def sample_figures() -> dict[str, Figure]:
    """Row 1: views, RMS, leave-one-out RMS, and whether the window of OpenCV's own result is flagged."""
    own, forced = command(), command("--window", str(PUBLISHED_WINDOW))
    said = (
        f"lens {own['camera']['lens']}, fx {own['camera']['parameters']['fx']:.2f}; tutorial 0.408, 5x5 0.195"
    )
    flagged = forced["detection"]["moved"]
    return {
        "left_views_used": Figure(own["views"]["used"], "views", "of 13", 13, 13, "higher"),
        "left_rms": Figure(own["rms_px"], "px", said, 0.20, 0.197),
        "left_leave_one_out_rms": Figure(own["leave_one_out_rms_px"], "px", "5x5 0.201", 0.21, 0.202),
        "left_window_11_flagged": Figure(
            len(flagged), "corners", f"that move, RMS {forced['rms_px']:.3f} px", 1, None, "higher"
        ),
        "left_seconds": Figure(sum(own["seconds"].values()), "s", "detection, lens, adjustment, checks"),
    }


def main() -> int:
    """Measure and publish."""
    share = 0.1 if "--quick" in sys.argv[1:] else 1.0
    say("OpenCV's sample images")
    figures = sample_figures()
    say("rendered sets")
    figures |= rendered_figures(max(4, round(200 * share)))
    say("Monte Carlo of the projection uncertainty")
    figures |= spread_figures(sample_images(), max(60, round(1000 * share)))
    say("choice of the lens")
    figures |= choice_figures(sample_images(), max(2, round(20 * share)))
    return publish(figures)


if __name__ == "__main__":
    sys.exit(main())
