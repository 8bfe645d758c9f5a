"""A follower that drives: its pace, its changes, what is kept of it, and how it ends."""

import math
import threading
import time

import numpy as np
import pytest
from live_worlds import wait_for

from factorlab.l19.follower import CURVES, DETECTORS, LIMITS, Follower, FollowerSettings
from factorlab.live.follower import csv_of, document_of, state_of, summary_of
from factorlab.live.follower.controls import CONTROLS, HELP, changed
from factorlab.live.follower.controls import DETECTORS as DETECTOR_TITLES
from factorlab.live.follower.journey import COLUMNS, SHOWN
from factorlab.live.follower.state import Cursor
from sequential.errors import DataError


def done(follower, steps, **settings):
    """A drive that is over."""
    session, _ = follower(steps=steps, wait=False, **settings)
    wait_for(session.ended.is_set)
    return session


def test_the_session_drives_as_the_simulator_alone_does(follower):
    session = done(follower, 60, noise=20.0, seed=4)
    robot = Follower(FollowerSettings(curve="circuit", noise=20.0, seed=4))
    steps = [robot.step() for _ in range(60)]
    table = session.journey.table()
    np.testing.assert_array_equal(table["offset_m"], [one.offset_m for one in steps])
    np.testing.assert_array_equal(table["x_est_m"], [one.estimate[0] for one in steps])
    assert session.journey.rms_m == pytest.approx(np.sqrt(np.mean(np.square([s.offset_m for s in steps]))))


def test_the_clock_sets_the_pace(follower):
    session, _ = follower(pace=1.0, start=False)
    session.start()
    wait_for(lambda: session.last)
    began = time.monotonic()
    wait_for(lambda: len(session.journey.rows) >= 21)
    assert time.monotonic() - began > 0.8  # twenty periods of 50 ms, never quicker than the clock


def test_a_pause_holds_the_robot(follower):
    session, _ = follower()
    wait_for(lambda: len(session.journey.rows) > 3)
    session.pause(on=True)
    time.sleep(0.1)
    still = len(session.journey.rows)
    time.sleep(0.2)
    assert len(session.journey.rows) == still
    session.pause(on=False)
    wait_for(lambda: len(session.journey.rows) > still)


def test_a_change_drives_on_and_another_seed_begins_anew(follower):
    session, _ = follower()
    wait_for(lambda: len(session.journey.rows) > 3)
    session.change({"kp": 9.0, "noise": 10})
    assert (session.journey.number, session.journey.changes) == (1, 1)
    session.change({"kp": 9.0})  # as it was
    assert session.journey.changes == 1
    session.change({"seed": 5})
    assert session.journey.number == 2
    assert session.journey.settings == FollowerSettings(curve="circuit", kp=9.0, noise=10.0, seed=5)
    session.change({"curve": "slalom"})
    assert (session.journey.number, session.lines) == (session.journeys[-1].number, 2)


def test_the_same_settings_drive_the_same_way_again(follower):
    session = done(follower, 40, noise=30.0)
    first = session.journey.table()
    session.restart()
    wait_for(session.ended.is_set)
    assert session.journey.number == 2
    np.testing.assert_array_equal(session.journey.table()["x_m"], first["x_m"])


def test_few_drives_are_kept(follower):
    session, _ = follower()
    for number in range(1, 12):
        wait_for(lambda: session.journey.rows)
        assert session.journey.number == number
        session.restart()
    assert len(session.journeys) == 8
    assert [one.number for one in session.journeys] == list(range(5, 13))


def test_the_state_tells_every_step_once(follower):
    session, _ = follower()
    cursor, rows = Cursor(), []
    wait_for(lambda: len(session.journey.rows) > 5)
    for _ in range(5):
        way = cursor.news(session)["way"]
        assert way["begin"] == len(rows)
        rows += way["rows"]
        time.sleep(0.05)
    assert len(rows) > 10
    t = np.array(rows)[:, SHOWN.index("t_s")]
    np.testing.assert_allclose(np.diff(t), 0.05, atol=1e-9)
    session.restart()
    wait_for(lambda: session.journey.rows)
    assert cursor.news(session)["way"]["begin"] == 0


def test_the_ellipse_is_that_of_the_world(follower):
    """The filter's covariance is in the robot's axes: turned, it keeps trace and determinant."""
    session = done(follower, 120)
    xx, xy, yy = state_of(session)["step"]["cov"]
    cov = session.last.cov[:2, :2]
    assert xx + yy == pytest.approx(np.trace(cov))
    assert xx * yy - xy**2 == pytest.approx(np.linalg.det(cov), rel=1e-6)
    heading = session.last.estimate[2]
    left = np.array([-np.sin(heading), np.cos(heading)])
    assert left @ [[xx, xy], [xy, yy]] @ left == pytest.approx(cov[1, 1])


def test_the_summary_and_the_report(follower):
    session = done(follower, 200)
    summary = summary_of(session)["journey"]
    table = session.journey.table()
    assert summary["steps"] == 200
    assert summary["lost_s"] is None
    assert summary["worst_m"] == np.abs(table["offset_m"]).max()
    assert summary["length_m"] == pytest.approx(0.3 * 199 * 0.05, rel=0.1)
    assert summary["estimate_rms_m"] < summary["odometry_rms_m"]
    document = document_of(session)
    assert [one.verdict for one in document.verdicts] == ["PASS", "PASS", "PASS"]
    assert document.lang == "fr"
    assert document.to_json()["journey"]["rms_m"] == summary["rms_m"] < 0.01


def test_a_lost_line_is_told(follower):
    session = done(follower, 120, noise=200.0)
    document = document_of(session)
    assert document.failed
    assert document.conclusion.startswith("La ligne a été perdue à ")
    lost = session.journey.table()["lost"]
    assert summary_of(session)["journey"]["lost_share"] == lost.mean() > 0.5
    assert session.journey.lost_s == session.journey.table()["t_s"][np.argmax(lost)]


def test_the_table_has_a_row_a_step_and_empty_cells_where_nothing_was_seen(follower):
    session = done(follower, 60, noise=200.0)
    head, *lines = csv_of(session.journey.rows).splitlines()
    assert head.split(",") == list(COLUMNS)
    assert len(lines) == 60
    rows = [line.split(",") for line in lines]
    found = [row[COLUMNS.index("found")] == "1" for row in rows]
    assert not all(found)
    assert [row[COLUMNS.index("bottom_px")] != "" for row in rows] == found
    assert "nan" not in "".join(lines)


def test_sliders_are_those_of_the_simulator():
    names = {one.name for one in CONTROLS}
    assert names == set(LIMITS) == set(HELP)
    for one in CONTROLS:
        low, high = LIMITS[one.name]
        assert low <= one.low / one.scale < one.high / one.scale <= high
        assert one.low <= getattr(FollowerSettings(), one.name) * one.scale <= one.high
    assert tuple(DETECTOR_TITLES) == DETECTORS


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"bruit": 3}, "il n'y a pas de réglage 'bruit', seulement noise, blur_s"),
        ({"noise": -1}, "Bruit de l'image : attendu entre 0 et 200 niveaux de gris, reçu -1"),
        ({"blur_s": 1.2}, "Flou de bougé : attendu entre 0 et 1000 ms, reçu 1200"),
        ({"kp": math.nan}, "Kp : attendu entre 0 et 150"),
        ({"curve": "huit"}, "curve : il n'y a pas de 'huit', seulement " + ", ".join(CURVES)),
        ({"seed": -3}, "la graine doit être un entier positif ou nul"),
    ],
)
def test_what_cannot_be_set_is_a_sentence_and_changes_nothing(wish, words):
    with pytest.raises(DataError, match=words.replace("(", r"\(")):
        changed(FollowerSettings(), wish)


def test_a_simulator_that_fails_is_told(follower, monkeypatch):
    session, _ = follower(start=False)

    def broken():
        raise RuntimeError("wheels fell off")

    monkeypatch.setattr(session._robot, "step", broken)
    session.start()
    wait_for(session.ended.is_set)
    assert session.fault == "la simulation s'est arrêtée : RuntimeError : wheels fell off"
    session.restart()
    wait_for(lambda: session.journey.rows)
    assert session.fault == ""


def test_closing_ends_the_thread(follower):
    session, server = follower()
    wait_for(lambda: session.last)
    session.close()
    server.close()
    assert not {thread.name for thread in threading.enumerate()} & {"follower", "server"}
