"""The job in the student's process: each exercise of the file, check after check."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from factorlab.l19.exercises.calling import Caller
from factorlab.l19.exercises.finding import Sheet

__all__ = ["ROOMS", "judge"]

PLAIN_S, COMPILED_S = 3.0, 60.0  # what one call may take
ROOMS = {
    "E1": "factorlab.l19.exercises.e1_kalman",
    "E2": "factorlab.l19.exercises.e2_median",
    "E3": "factorlab.l19.exercises.e3_infrared",
    "E4": "factorlab.l19.exercises.e4_components",
    "K3": "factorlab.l19.exercises.k3_angle",
    "D3": "factorlab.l19.exercises.d3_sigma_points",
}


def judge(names: Mapping[str, Any], arguments: Mapping[str, Any], emit: Callable[[Any], None]) -> None:
    """Run the checks of arguments["exercises"], each with the names that the file should define for it."""
    compiled = {"numba", "sequential", "vision3d"} & set(sys.modules)  # compiles at its first call
    call = Caller(Path(arguments["path"]), limit_s=COMPILED_S if compiled else PLAIN_S)
    for exercise, wanted in arguments["exercises"].items():
        sheet = Sheet(exercise, {name: names[name] for name in wanted if name in names}, call, emit)
        lost = [name for name in wanted if name not in names]
        for name in lost:
            said = f"`{name}` n'est pas encore défini là où le fichier s'arrête : corrigez cette ligne."
            sheet.wrong(name, f"le nom {name}", said)
        if len(lost) < len(wanted):
            importlib.import_module(ROOMS[exercise]).check(sheet)
