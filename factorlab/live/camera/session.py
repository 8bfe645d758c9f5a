"""A live session: a source, the task at work on it, a recording if one is wanted, and what the page shows."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.live.camera.drawing import drawn
from factorlab.live.camera.rates import Rates
from factorlab.live.camera.reader import Captured, FrameReader
from factorlab.live.camera.reading import Reading
from factorlab.live.camera.recording import Recorded, Recording
from factorlab.live.camera.task import Task
from factorlab.live.channel import Newest
from sequential.errors import DataError, FactorlabError
from vision3d.frames import FrameSource

__all__ = ["CameraSession", "Shown", "TaskChoice"]

JPEG_QUALITY = 85


@dataclass(frozen=True)
class TaskChoice:
    """A task that the page offers: `make` is called when it is first chosen."""

    name: str
    title: str
    make: Callable[[], Task]


@dataclass(frozen=True)
class Shown:
    """A frame with what is known of it; `jpeg` is empty while nobody watches."""

    captured: Captured
    task: str
    reading: Reading
    jpeg: bytes


class CameraSession:
    """Runs a task over the frames of a source until it is closed.

    Three threads: one reads frames, one works on them, and a recording writes in its own.

    Parameters
    ----------
    source : open
    choices : the tasks there are
    task : name of the first
    recordings : folder in which recordings are made, each in a folder named by its time and task
    fast : a file is played as quickly as the task takes every frame
    """

    def __init__(
        self,
        source: FrameSource,
        choices: tuple[TaskChoice, ...],
        task: str,
        *,
        recordings: Path = Path("recordings"),
        fast: bool = False,
    ) -> None:
        self.choices = {choice.name: choice for choice in choices}
        self.recordings, self.fast = recordings, fast
        self.reader = FrameReader(source, fast=fast, taken=self._record_frame)
        self.shown = Newest[Shown]()
        self.rates, self.recorded = Rates(), list[Recorded]()
        self.overlay, self.message = True, ""
        self.faults: list[str] = []
        self._lock = threading.RLock()
        self.tasks: dict[str, Task] = {}  # those that were at work
        self._task = self.tasks[task] = self._made(task)
        self._watchers = self._done = 0  # clients that want pictures; frames worked on
        self._recording: Recording | None = None
        self._lap, self._version = 1, 0
        self._redraw, self._read_again, self._stop = threading.Event(), threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="task", daemon=True)

    def start(self) -> None:
        """Begin."""
        self.reader.start()
        self._thread.start()

    @property
    def task(self) -> Task:
        """The one at work."""
        return self._task

    @property
    def recording(self) -> Recording | None:
        """The one that is being made."""
        return self._recording

    @property
    def ended(self) -> bool:
        """Whether the source is over and everything it gave has been worked on."""
        return self.reader.ended.is_set() and self._done == self.reader.frames.number

    def choose(self, name: str) -> None:
        """Let another task work from the next frame on.

        Raises
        ------
        FactorlabError
            where it cannot be made; the task before stays at work.
        """
        if name not in self.choices:
            raise DataError(f"there is no task {name!r}, only {', '.join(self.choices)}")
        made = self.tasks.get(name) or self._made(name)  # which takes its time: the task before goes on
        with self._lock:
            self.tasks[name] = made
            self._task, self.message = self.tasks[name], ""
            self._task.restart()
        self._read_again.set()

    def _made(self, name: str) -> Task:
        task = self.choices[name].make()
        task.prepare()
        return task

    def act(self, action: str) -> None:
        """Press a button of the task."""
        self.message = self._task.act(action)
        self._read_again.set()

    def show_marks(self, *, on: bool) -> None:
        """Draw marks on the picture, or leave it as it came."""
        self.overlay = on
        self._redraw.set()

    def start_recording(self) -> Path:
        """Record from the next frame on; returns the folder.

        Raises
        ------
        DataError
            where the source is over, or nothing can be written there.
        """
        if self.ended:
            raise DataError("the source is over, there is nothing to record; play it again first")
        with self._lock:
            if self._recording is None:
                stamp = datetime.now().astimezone().strftime("%Y%m%d-%H%M%S")
                folder = _free(self.recordings / f"{stamp}-{self._task.name}")
                source = self.reader.source
                self._recording = Recording(folder, source.size, source.fps, wait=self.fast)
            return self._recording.folder

    def stop_recording(self) -> Recorded | None:
        """End the recording, with everything that was taken on the disk."""
        with self._lock:
            recording, self._recording = self._recording, None
        if recording is None:
            return None
        recorded = recording.close()
        self.recorded.append(recorded)
        if recorded.fault:
            self.faults.append(recorded.fault)
        return recorded

    @contextmanager
    def watching(self) -> Iterator[None]:
        """While somebody watches, pictures are made."""
        with self._lock:
            self._watchers += 1
        self._redraw.set()
        try:
            yield
        finally:
            with self._lock:
                self._watchers -= 1

    def snapshot(self) -> bytes | None:
        """The picture that is shown now, as the bytes of a PNG file; None before the first."""
        import cv2

        if (newest := self.shown.take(0, 0.0)) is None:
            return None
        shown = newest[1]
        image = shown.captured.frame.image
        return bytes(cv2.imencode(".png", drawn(image, shown.reading.marks) if self.overlay else image)[1])

    def close(self) -> None:
        """End everything; what was recorded is complete when this returns."""
        self._stop.set()
        self.reader.close()
        if self._thread.is_alive():
            self._thread.join(timeout=30.0)
        self.stop_recording()
        for task in self.tasks.values():
            task.close()
        self.shown.close()

    def _record_frame(self, captured: Captured) -> None:
        with self._lock:
            recording = self._recording
        if recording is None:
            return
        recording.add_frame(captured)
        if recording.fault:
            self.stop_recording()

    def _run(self) -> None:
        while not self._stop.is_set():
            taken = self.reader.frames.take(self._done, 0.1)
            if taken is not None:
                number, captured = taken
                self._work(captured, skipped=number - self._done - 1)
                self._done = number
            elif self._redraw.is_set() or self._read_again.is_set() or self._task.version != self._version:
                self._show_again()
            elif self.ended:
                self.stop_recording()

    def _work(self, captured: Captured, *, skipped: int) -> None:
        self._redraw.clear()
        self._read_again.clear()
        with self._lock:
            task, recording = self._task, self._recording
        if self.reader.laps != self._lap:
            self._lap = self.reader.laps
            task.restart()
        self._version = task.version
        began = time.monotonic_ns()
        reading = _read(task, captured)
        ended = time.monotonic_ns()
        self.shown.put(Shown(captured, task.name, reading, self._picture(captured, reading)))
        self.rates.add(captured.captured_ns, began, ended, time.monotonic_ns(), skipped)
        if recording is not None:
            recording.add_reading(captured, task.name, task.columns, reading)

    def _show_again(self) -> None:
        """The frame that stands still, as the task or the switch that was changed sees it."""
        task = self._task
        changed = self._read_again.is_set() or task.version != self._version
        self._redraw.clear()
        self._read_again.clear()
        self._version = task.version
        if (newest := self.shown.take(0, 0.0)) is None:
            return
        shown = newest[1]
        reading = _read(task, shown.captured) if changed else shown.reading
        self.shown.put(
            replace(shown, task=task.name, reading=reading, jpeg=self._picture(shown.captured, reading))
        )

    def _picture(self, captured: Captured, reading: Reading) -> bytes:
        if not self._watchers:
            return b""
        image = captured.frame.image
        return jpeg(drawn(image, reading.marks) if self.overlay else image)


def _read(task: Task, captured: Captured) -> Reading:
    """What the task says; a fault in it is told on the page, and the next frame is tried."""
    try:
        return task.read(captured.frame)
    except FactorlabError as fault:
        return Reading(str(fault), state="bad")
    except Exception as fault:  # noqa: BLE001 - one frame must not end a session
        return Reading(f"the task failed on this frame: {type(fault).__name__}: {fault}", state="bad")


def jpeg(image: NDArray[np.uint8]) -> bytes:
    """The image as the bytes of a JPEG file."""
    import cv2

    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1])


def _free(folder: Path) -> Path:
    """The folder, or with a number behind it where there is one already."""
    names = (folder.with_name(f"{folder.name}-{k}") for k in range(2, 1000))
    return next((path for path in (folder, *names) if not path.exists()), folder)
