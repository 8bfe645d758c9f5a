"""The tasks of a live camera, each made when it is first chosen."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from factorlab.live.camera.session import TaskChoice
from factorlab.live.camera.task import Task
from factorlab.live.camera.tasks.known import KnownCamera

if TYPE_CHECKING:
    from vision3d.boards import Board
    from vision3d.camera import Camera
    from vision3d.lines import GroundHomography, LineSettings

__all__ = ["TASKS", "TaskSettings", "task_choices"]

TASKS = {"markers": "Markers", "calibrate": "Calibrate", "line": "Line", "features": "Features"}


@dataclass(frozen=True)
class TaskSettings:
    """What the tasks need to know.

    Parameters
    ----------
    camera : its model, with which markers have poses
    marker_m : side of the markers' black squares
    dictionary : of the markers
    board, lens : of a calibration; no board: a checkerboard of 9x6 inner corners and squares of 25 mm
    line : where a line may be, and what it looks like
    height_m, pitch_deg : of the camera above the ground and below the horizon: the line is told in metres
    folder : calibrations are saved in folders of their own in it
    command : stands in reports
    """

    camera: Camera | None = None
    marker_m: float = 0.05
    dictionary: str = "auto"
    board: Board | None = None
    lens: str = "auto"
    line: LineSettings | None = None
    height_m: float | None = None
    pitch_deg: float | None = None
    folder: Path = field(default=Path("recordings"))
    command: str = ""


def task_choices(settings: TaskSettings) -> tuple[TaskChoice, ...]:
    """Every task, with its settings; what a calibration finds, the others know."""
    known = KnownCamera(settings.camera)

    def markers() -> Task:
        from factorlab.live.camera.tasks.markers import MarkersTask

        return MarkersTask(known, settings.marker_m, settings.dictionary)

    def calibrate() -> Task:
        from factorlab.live.camera.tasks.calibrate import CalibrateTask
        from vision3d.boards import Checkerboard

        board = settings.board or Checkerboard(9, 6, 0.025)
        return CalibrateTask(board, settings.lens, settings.folder, settings.command, known)

    def line() -> Task:
        from factorlab.live.camera.tasks.line import LineTask

        return LineTask(settings.line, lambda: _ground(settings, known))

    def features() -> Task:
        from factorlab.live.camera.tasks.features import FeaturesTask

        return FeaturesTask()

    makers = {"markers": markers, "calibrate": calibrate, "line": line, "features": features}
    return tuple(TaskChoice(name, title, makers[name]) for name, title in TASKS.items())


def _ground(settings: TaskSettings, known: KnownCamera) -> GroundHomography | None:
    """The ground, where the camera's model is known and where it hangs."""
    if known.camera is None or settings.height_m is None or settings.pitch_deg is None:
        return None
    from math import radians

    from vision3d.lines import CameraMount, GroundHomography

    mount = CameraMount(settings.height_m, radians(settings.pitch_deg))
    return GroundHomography.from_camera(known.camera, mount)
