"""The contract of a task: frames come in, readings go out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from factorlab.live.camera.reading import Reading
from sequential.errors import DataError
from vision3d.frames import Frame

__all__ = ["Action", "Task"]

Action = tuple[str, str]  # name, and the words on its button


class Task(ABC):
    """Looks at frames, one after the other; whatever is kept between them is its own.

    One thread calls `read`, another may call `act` at any time.
    """

    name: ClassVar[str]
    columns: ClassVar[tuple[str, ...]]  # of the CSV, after frame and t_s

    @property
    def version(self) -> int:
        """Counts what changes without a frame, such as work that goes on behind the task."""
        return 0

    @property
    def actions(self) -> tuple[Action, ...]:
        """Buttons of the page for this task."""
        return ()

    def prepare(self) -> None:  # noqa: B027 - most tasks need nothing
        """Load and compile what the first frame would have to wait for."""

    @abstractmethod
    def read(self, frame: Frame) -> Reading:
        """What is seen in this frame; one that stands still may come again, when something has changed."""

    def act(self, action: str) -> str:
        """Do what a button says; returns a sentence for the page.

        Raises
        ------
        DataError
            where there is no such action, or it cannot be done now.
        """
        raise DataError(f"the task {self.name} has no action {action!r}")

    def file(self, name: str) -> bytes | None:
        """A file that the page offers to save; None where there is none of that name."""
        return None

    def restart(self) -> None:  # noqa: B027 - most tasks keep nothing
        """Forget what depends on the frames before: the source begins anew."""

    def summary(self) -> dict[str, object]:
        """What the whole run amounts to, as JSON takes it."""
        return {}

    def close(self) -> None:  # noqa: B027 - as above
        """End what still goes on."""
