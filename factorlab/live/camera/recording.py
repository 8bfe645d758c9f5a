"""A recording of what a camera saw and of what a task said about it."""

from __future__ import annotations

import json
import queue
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from factorlab.live.camera.reader import Captured
from factorlab.live.camera.reading import Reading
from factorlab.live.plain import plain
from factorlab.live.rows import GrowingFile
from sequential.errors import DataError

__all__ = ["Recorded", "Recording"]

WAITING = 90  # frames that may wait for the disk
HEAD = ("frame", "t_s")


@dataclass(frozen=True)
class Recorded:
    """What a recording amounts to.

    Parameters
    ----------
    folder : holds video.avi, frames.csv, readings.jsonl and a CSV a task
    frames, readings : written
    lost : frames for which the disk was too slow
    duration_s : from the first frame to the last
    fault : why it ended early; empty where it did not
    """

    folder: Path
    frames: int
    readings: int
    lost: int
    duration_s: float
    fault: str

    def to_json(self) -> dict[str, Any]:
        """The same for a program."""
        return {**vars(self), "folder": str(self.folder)}


class Recording:
    """Writes in a thread of its own, so that a slow disk does not slow the page.

    The video holds the frames as they came, without marks, at the nominal rate; `frames.csv` has their true
    times.  Lines go to `….part` until the end, and whole ones only, so that a computer that stops leaves what
    came before.

    Parameters
    ----------
    folder : is made
    size : (width, height) of the frames
    fps : nominal
    wait : a full queue holds up who adds frames instead of losing them

    Raises
    ------
    DataError
        where the folder is there already, or no video can be written in it.
    """

    def __init__(self, folder: Path, size: tuple[int, int], fps: float, *, wait: bool = False) -> None:
        import cv2

        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            raise DataError(f"{folder} is there already; a recording needs a folder of its own") from None
        except OSError as fault:
            raise DataError(f"{folder} cannot be made: {fault.strerror}; record to another folder") from fault
        self.folder, self._wait = folder, wait
        self._video = cv2.VideoWriter(
            str(folder / "video.avi"), cv2.VideoWriter.fourcc(*"MJPG"), min(max(fps, 1.0), 240.0), size
        )
        if not self._video.isOpened():
            raise DataError(f"no video can be written to {folder}; is there room, and may you write there?")
        self._files: dict[str, GrowingFile] = {}
        self._stamps: list[int] = []
        self._readings = self._lost = 0
        self._fault = ""
        self._queue: queue.Queue[Any] = queue.Queue(WAITING)
        self._lock = threading.Lock()
        self._over = False
        self._thread = threading.Thread(target=self._write, name="recording", daemon=True)
        self._thread.start()

    @property
    def seconds(self) -> float:
        """Recorded so far."""
        return (self._stamps[-1] - self._stamps[0]) * 1e-9 if self._stamps else 0.0

    @property
    def fault(self) -> str:
        """Why nothing more is written; empty while all is well."""
        return self._fault

    def add_frame(self, captured: Captured) -> None:
        """Take a frame; without `wait`, one that finds no room is counted as lost."""
        with self._lock:
            if self._over:
                return
            try:
                self._queue.put(captured, block=self._wait)
            except queue.Full:
                self._lost += 1

    def add_reading(self, captured: Captured, task: str, columns: tuple[str, ...], reading: Reading) -> None:
        """Take what a task said of a frame."""
        with self._lock:
            if not self._over:
                self._queue.put((captured, task, columns, reading))

    def close(self) -> Recorded:
        """Write what waits, and end the files; a second time only tells what there is."""
        with self._lock:
            first, self._over = not self._over, True
        if first:
            self._queue.put(None)
        self._thread.join()
        return Recorded(self.folder, len(self._stamps), self._readings, self._lost, self.seconds, self._fault)

    def _write(self) -> None:
        while (item := self._queue.get()) is not None:
            if self._fault:
                continue  # whoever waits for room must not wait for ever
            try:
                if isinstance(item, Captured):
                    self._write_frame(item)
                else:
                    self._write_reading(*item)
            except (DataError, OSError) as fault:
                self._fault = f"the recording in {self.folder} ended early: {fault}"
        self._video.release()
        for name, file in self._files.items():
            try:
                file.close()
            except (DataError, OSError) as fault:
                self._fault = self._fault or f"{self.folder / name} is incomplete: {fault}"

    def _write_frame(self, captured: Captured) -> None:
        frame = captured.frame
        self._video.write(frame.image)
        if not self._stamps:
            self._file("frames.csv").write("frame,t_s,captured_unix_ns\n")
        self._stamps.append(frame.t_ns)
        unix_ns = time.time_ns() - time.monotonic_ns() + captured.captured_ns
        self._file("frames.csv").write(f"{frame.index},{frame.t_ns * 1e-9:.9f},{unix_ns}\n")

    def _write_reading(
        self, captured: Captured, task: str, columns: tuple[str, ...], reading: Reading
    ) -> None:
        frame = captured.frame
        head = {"frame": frame.index, "t_s": frame.t_ns * 1e-9, "task": task}
        line = json.dumps({**head, **reading.to_json()}, ensure_ascii=False, allow_nan=False)
        self._file("readings.jsonl").write(line + "\n")
        self._readings += 1
        table = f"{task}.csv"
        if table not in self._files:
            self._file(table).write(",".join((*HEAD, *columns)) + "\n")
        for row in reading.rows:
            self._file(table).write(_csv_line({**head, **plain(row)}, (*HEAD, *columns)))

    def _file(self, name: str) -> GrowingFile:
        if name not in self._files:
            self._files[name] = GrowingFile(self.folder / name)
        return self._files[name]


def _csv_line(row: Mapping[str, Any], columns: tuple[str, ...]) -> str:
    """Cells in the order of the columns; what is missing is an empty cell."""
    cells = []
    for name in columns:
        value = row.get(name)
        text = "" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)
        cells.append('"' + text.replace('"', '""') + '"' if any(sign in text for sign in ',"\n') else text)
    return ",".join(cells) + "\n"
