"""What importing vision3d costs, and that it needs no open3d: fresh interpreters, medians."""

from __future__ import annotations

import resource
import subprocess
import sys
from statistics import median

from measure.figures import Figure

WITHOUT_OPEN3D = "import sys; sys.modules['open3d'] = None; "
EVERY_ROOM = (
    "import vision3d, vision3d.camera, vision3d.features, vision3d.robust, vision3d.two_view, "
    "vision3d.triangulate, vision3d.stereo, vision3d.sfm, vision3d.cloud"
)


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """CPU seconds of imports beyond those of a bare interpreter."""
    rounds = 3 if quick else 9
    seconds = {"bare": [], "package": [], "rooms": []}
    for _ in range(rounds):
        for name, text in (("bare", "import numpy"), ("package", "import vision3d"), ("rooms", EVERY_ROOM)):
            seconds[name].append(of_a_start(WITHOUT_OPEN3D + text))
    bare = median(of_a_start("pass") for _ in range(rounds))
    return {
        "import_vision3d": Figure(max(median(seconds["package"]) - bare, 0.0), "s", "–", 0.3),
        "import_every_room_without_open3d": Figure(
            median(seconds["rooms"]) - bare,
            "s",
            f"NumPy alone {median(seconds['bare']) - bare:.2f} s",
            aim=0.3,
        ),
    }


def of_a_start(text: str) -> float:
    """CPU seconds of an interpreter that runs one line."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", text], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
