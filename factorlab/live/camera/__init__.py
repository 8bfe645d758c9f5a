"""A camera while it runs: frames, a task that looks at them, a recording, and a page on this computer."""

from factorlab.live.camera.server import PageServer
from factorlab.live.camera.session import CameraSession, TaskChoice
from factorlab.live.camera.state import summary_of
from factorlab.live.camera.task import Task
from factorlab.live.camera.tasks import TASKS, TaskSettings, task_choices

__all__ = [
    "TASKS",
    "CameraSession",
    "PageServer",
    "Task",
    "TaskChoice",
    "TaskSettings",
    "summary_of",
    "task_choices",
]
