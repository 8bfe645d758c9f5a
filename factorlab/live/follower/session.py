"""The robot at work: steps at the pace of the clock, in a thread of its own, until it is closed."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower import PERIOD_S, Follower, FollowerSettings, Step
from factorlab.live.follower.controls import changed
from factorlab.live.follower.journey import Journey
from factorlab.live.follower.own_detector import OwnDetector
from sequential.errors import FactorlabError

__all__ = ["PACES", "FollowerSession"]

LATE_S = 0.25  # a computer that is slower than the robot makes it drive more slowly
KEPT = 8  # drives in the table
LONGEST = 72_000  # steps of one drive: an hour of the robot
PACES = (0.25, 1.0, 2.0, 5.0)


class FollowerSession:
    """Drives the simulated robot.

    A drive ends at the end of the line, or after `steps`; the robot then stands until it is put back on the
    start.  Where the line is lost the robot stands as well, and drives on once it sees the line again.

    Parameters
    ----------
    settings : to begin with
    steps : of one drive; None drives on
    wait : False drives as quickly as the computer can
    own : a detector in a file, instead of the settings' one
    """

    def __init__(
        self,
        settings: FollowerSettings,
        *,
        steps: int | None = None,
        wait: bool = True,
        own: OwnDetector | None = None,
    ) -> None:
        self.own = own
        self._robot = Follower(settings, own)
        self.settings, self.steps, self.wait = settings, steps, wait
        self.pace = 1.0
        self.journeys = [Journey(1, settings)]
        self.last: Step | None = None
        self.line: NDArray[np.float64] = np.asarray(self._robot.line)
        self.lines = 1  # how many lines there were: a page asks for the points when the number changes
        self.fault = ""
        self.ended = threading.Event()
        self._lock = threading.RLock()
        self._going, self._stop = threading.Event(), threading.Event()
        self._going.set()
        self._thread = threading.Thread(target=self._run, name="follower", daemon=True)

    def start(self) -> None:
        """Begin to drive."""
        self._thread.start()

    @property
    def journey(self) -> Journey:
        """The drive that goes on, or the last one."""
        return self.journeys[-1]

    @property
    def driven(self) -> list[Journey]:
        """The drives that have steps, the last one last."""
        return [one for one in self.journeys if one.rows]

    @property
    def paused(self) -> bool:
        """Whether the robot waits."""
        return not self._going.is_set()

    def pause(self, *, on: bool) -> None:
        """Let the robot wait, or go on."""
        (self._going.clear if on else self._going.set)()

    def set_pace(self, pace: float) -> None:
        """Seconds of the robot in a second of the clock."""
        self.pace = min(max(pace, PACES[0]), PACES[-1])

    def change(self, wish: Mapping[str, Any]) -> None:
        """Drive on with other settings; another line or another seed begins anew.

        Raises
        ------
        DataError
            where a setting is not known or makes no sense; nothing is changed then.
        """
        with self._lock:
            settings = changed(self.settings, wish)
            if settings == self.settings:
                return
            self.settings = settings
            if {"curve", "seed"} & set(wish):
                self.restart()
                return
            self._robot.change(settings)
            if self.journey.rows:
                self.journey.changes += 1
            else:
                self.journey.settings = settings

    def restart(self) -> None:
        """Put the robot back on the start, with the settings as they are now.

        Raises
        ------
        DataError
            where the file of a detector was changed and cannot be read any more.
        """
        if self.own is not None:
            self.own.read()
        with self._lock:
            self._robot = Follower(self.settings, self.own)
            line = np.asarray(self._robot.line)
            if not np.array_equal(line, self.line):
                self.line, self.lines = line, self.lines + 1
            if self.journey.rows:
                self.journeys = [*self.journeys[1 - KEPT :], Journey(self.journey.number + 1, self.settings)]
            else:
                self.journey.settings = self.settings
            self.last, self.fault = None, ""
            self.ended.clear()
        self.pause(on=False)

    def close(self) -> None:
        """End the drive."""
        self._stop.set()
        self._going.set()
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)

    def _run(self) -> None:
        due = time.monotonic()
        while not self._stop.is_set():
            if self.ended.is_set() or not self._going.is_set():
                self._stop.wait(0.02)
                due = time.monotonic()
                continue
            due += self._step() / self.pace
            now = time.monotonic()
            if not self.wait or now > due + LATE_S:
                due = now
            else:
                self._stop.wait(max(due - now, 0.0))

    def _step(self) -> float:
        """One step; returns how long it takes the robot, s."""
        with self._lock:
            try:
                step = self._robot.step()
            except FactorlabError as fault:
                self.fault = str(fault)
                self.ended.set()
                return 0.0
            except Exception as fault:  # noqa: BLE001 - told on the page; the robot stands
                self.fault = f"la simulation s'est arrêtée : {type(fault).__name__} : {fault}"
                self.ended.set()
                return 0.0
            journey = self.journey
            journey.add(step)
            self.last = step
            journey.arrived = step.arrived or len(journey.rows) >= (self.steps or LONGEST)
            if journey.arrived:
                self.ended.set()
            return PERIOD_S
