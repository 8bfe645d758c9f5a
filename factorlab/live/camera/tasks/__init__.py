"""The tasks of a live camera, each made when it is first chosen."""

from __future__ import annotations

from dataclasses import dataclass

from factorlab.live.camera.session import TaskChoice
from factorlab.live.camera.task import Task

__all__ = ["TASKS", "TaskSettings", "task_choices"]

TASKS = {"markers": "Markers", "features": "Features"}


@dataclass(frozen=True)
class TaskSettings:
    """What the tasks need to know.

    Parameters
    ----------
    dictionary : of the markers
    """

    dictionary: str = "auto"


def task_choices(settings: TaskSettings) -> tuple[TaskChoice, ...]:
    """Every task, with its settings."""

    def markers() -> Task:
        from factorlab.live.camera.tasks.markers import MarkersTask

        return MarkersTask(settings.dictionary)

    def features() -> Task:
        from factorlab.live.camera.tasks.features import FeaturesTask

        return FeaturesTask()

    makers = {"markers": markers, "features": features}
    return tuple(TaskChoice(name, title, makers[name]) for name, title in TASKS.items())
