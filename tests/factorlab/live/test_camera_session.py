"""A session: every frame once, pauses, tasks that change, sources that break off, faults that are told."""

import time

import cv2
import numpy as np
import pytest
from live_worlds import Unplugged, wait_for

from factorlab.live.camera import Task, TaskChoice, summary_of
from factorlab.live.camera.reading import Reading
from factorlab.live.camera.server import command
from factorlab.live.camera.state import state_of
from sequential.errors import DataError


class Witness(Task):
    """Remembers which frames it saw; each takes `pause` seconds."""

    name, columns = "witness", ("brightness",)

    def __init__(self, pause=0.0, fails_on=()):
        self.pause, self.fails_on = pause, fails_on
        self.seen, self.restarts, self.prepared = [], 0, 0

    @property
    def actions(self):
        return (("hello", "Say hello"),)

    def prepare(self):
        self.prepared += 1

    def read(self, frame):
        self.seen.append(frame.index)
        time.sleep(self.pause)
        if frame.index in self.fails_on:
            raise ValueError("no such thing")
        return Reading("seen", "good", rows=({"brightness": float(frame.image.mean())},))

    def act(self, action):
        return "hello yourself" if action == "hello" else super().act(action)

    def restart(self):
        self.restarts += 1


def choices(**tasks):
    return tuple(TaskChoice(name, name.title(), lambda task=task: task) for name, task in tasks.items())


def test_fast_leaves_nothing_out(live, marker_video):
    witness = Witness(pause=0.003)
    session, _ = live(marker_video, "witness", choices=choices(witness=witness), fast=True)
    session.start()
    wait_for(lambda: session.ended)
    assert witness.seen == list(range(50))
    summary = summary_of(session)
    assert (summary["frames"], summary["worked_on"], summary["skipped"]) == (50, 50, 0)
    assert witness.prepared == 1


def test_a_slow_task_gets_the_newest_frame_and_what_it_missed_is_counted(live, marker_video):
    witness = Witness(pause=0.15)
    session, _ = live(marker_video, "witness", choices=choices(witness=witness))
    began = time.monotonic()
    session.start()
    wait_for(lambda: session.ended)
    assert time.monotonic() - began >= 49 / 25  # plays at its own speed
    assert (np.diff(witness.seen) > 1).any()
    summary = summary_of(session)
    assert summary["frames"] == 50 == summary["worked_on"] + summary["skipped"]


def test_a_pause_holds_a_file_where_it_is(live, marker_video):
    witness = Witness()
    session, _ = live(marker_video, "witness", choices=choices(witness=witness))
    session.start()
    wait_for(lambda: len(witness.seen) > 3)
    command(session, {"do": "pause"})
    time.sleep(0.1)
    still = session.reader.count
    time.sleep(0.3)
    assert session.reader.count == still
    assert state_of(session)["paused"]
    command(session, {"do": "resume"})
    wait_for(lambda: session.ended)
    assert session.reader.count == 50
    assert witness.seen[-1] == 49


def test_a_file_can_be_played_again(live, marker_video):
    witness = Witness()
    session, _ = live(marker_video, "witness", choices=choices(witness=witness), fast=True)
    session.start()
    wait_for(lambda: session.ended)
    before = witness.restarts
    command(session, {"do": "again"})
    wait_for(lambda: session.reader.count == 100 and session.ended)
    assert witness.seen == 2 * list(range(50))
    assert witness.restarts == before + 1


def test_another_task_takes_over(live, marker_video):
    first, second = Witness(), Witness()
    session, _ = live(marker_video, "first", choices=choices(first=first, second=second), loop=True)
    session.start()
    wait_for(lambda: len(first.seen) > 2)
    assert second.prepared == 0
    command(session, {"do": "task", "name": "second"})
    wait_for(lambda: len(second.seen) > 2)
    assert second.prepared == 1
    assert first.seen[-1] < second.seen[0]
    command(session, {"do": "act", "name": "hello"})
    assert state_of(session)["message"] == "hello yourself"
    with pytest.raises(DataError, match="no task 'third', only first, second"):
        session.choose("third")
    with pytest.raises(DataError, match="has no action 'jump'"):
        session.act("jump")
    assert session.task is second


def test_a_task_that_cannot_be_made_leaves_the_one_before(live, marker_video):
    def refuse():
        raise DataError("this one needs a board")

    both = (*choices(witness=Witness()), TaskChoice("board", "Board", refuse))
    session, _ = live(marker_video, "witness", choices=both, loop=True)
    session.start()
    with pytest.raises(DataError, match="needs a board"):
        session.choose("board")
    wait_for(lambda: session.shown.number > 2)
    assert state_of(session)["task"] == "witness"


def test_a_fault_in_a_task_is_told_and_does_not_end_the_session(live, marker_video):
    witness = Witness(fails_on=(49,))
    session, _ = live(marker_video, "witness", choices=choices(witness=witness), fast=True)
    session.start()
    wait_for(lambda: session.ended)
    reading = state_of(session)["reading"]
    assert reading["state"] == "bad"
    assert "ValueError: no such thing" in reading["headline"]
    assert len(witness.seen) == 50


def test_a_camera_that_is_unplugged_is_told_and_can_be_plugged_in_again(live, monkeypatch):
    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    witness = Witness()
    session, _ = live("0", "witness", choices=choices(witness=witness))
    session.start_recording()
    session.start()
    wait_for(lambda: session.ended and session.recorded)
    assert state_of(session)["fault"].startswith("camera 0 stopped giving frames after 40")
    assert session.recorded[0].frames == 40
    with pytest.raises(DataError, match="source is over"):
        session.start_recording()
    command(session, {"do": "again"})
    wait_for(lambda: session.reader.count == 80)
    assert witness.restarts == 1


def test_a_reader_that_fails_is_told(live, marker_video, monkeypatch):
    session, _ = live(marker_video, "witness", choices=choices(witness=Witness()))

    def broken(self):
        yield 0, "", np.zeros((240, 320, 3), np.uint8)
        raise RuntimeError("bus error")

    monkeypatch.setattr(type(session.reader.source), "_lap", broken)
    session.start()
    wait_for(lambda: session.ended)
    assert "broke off: bus error" in state_of(session)["fault"]


def test_closing_ends_every_thread(live, marker_video):
    import threading

    session, server = live(marker_video, "witness", choices=choices(witness=Witness()), loop=True)
    session.start()
    wait_for(lambda: session.shown.number > 1)
    session.close()
    server.close()
    names = {thread.name for thread in threading.enumerate()}
    assert not names & {"frames", "task", "server", "recording"}
