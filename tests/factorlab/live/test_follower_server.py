"""The follower's server: its files, its events, its commands, and sentences in French."""

import csv
import io
import json

import pytest
from live_worlds import ask, asked, wait_for

from factorlab.live.follower import FollowerServer
from sequential.errors import DataError


def tell(server, wish, **headers):
    answer, body = ask(server, "/command", method="POST", body=json.dumps(wish), **headers)
    return answer.status, json.loads(body) if answer.status != 403 else {}


OWN = ("", "page.css", "page.js", "controls.js", "map.js", "strips.js")
SHARED = ("look.css", "elements.js", "orders.js", "theme.js")


@pytest.mark.parametrize("name", [*OWN, *SHARED])
def test_the_page_needs_nothing_from_elsewhere(follower, name):
    _, server = follower(start=False)
    answer, body = ask(server, f"/{name}")
    assert answer.status == 200
    assert "default-src 'none'" in answer.getheader("Content-Security-Policy")
    assert b"http" not in body.replace(b"http://www.w3.org/2000/svg", b"")


def test_what_the_page_begins_with(follower):
    session, server = follower(start=False)
    setup = json.loads(ask(server, "/setup.json")[1])
    assert [one["name"] for one in setup["controls"]][:2] == ["noise", "blur_s"]
    assert list(setup["curves"]) == ["sinus", "droite", "slalom", "hasard", "circuit"]
    assert setup["defaults"]["kp"] == 18.0
    line = json.loads(ask(server, "/line.json")[1])
    assert len(line["points"]) == len(session.line)
    state = json.loads(ask(server, "/state.json")[1])
    assert state["step"] is None
    assert state["journey"]["rms_m"] is None


def test_events_tell_the_way_and_the_end(follower):
    session, server = follower()
    rows = 0
    with asked(server, "/events") as answer:
        assert answer.getheader("Content-Type") == "text/event-stream"
        for _ in range(5):
            line = answer.readline()
            assert answer.readline() == b"\n"
            way = json.loads(line.removeprefix(b"data: "))["way"]
            assert way["begin"] == rows
            rows += len(way["rows"])
        session.close()
        server.leaving.set()
        assert answer.read().endswith(b"event: over\ndata: {}\n\n")


def test_commands(follower):
    session, server = follower()
    wait_for(lambda: session.last)
    assert tell(server, {"do": "pause"})[1]["state"]["paused"]
    assert not tell(server, {"do": "resume"})[1]["state"]["paused"]
    assert (
        tell(server, {"do": "set", "settings": {"kp": 7.5, "blur_s": 0.1}})[1]["state"]["settings"]["kp"]
        == 7.5
    )
    assert tell(server, {"do": "pace", "pace": 2})[1]["state"]["pace"] == 2.0
    assert tell(server, {"do": "restart"})[1]["state"]["journey"]["number"] == 2


def test_a_wish_that_cannot_be_met_is_a_sentence_in_french(follower):
    _, server = follower(start=False)
    status, told = tell(server, {"do": "set", "settings": {"kp": 700}})
    assert status == 409
    assert told["fault"] == "Kp : attendu entre 0 et 150 rad/s par m, reçu 700"
    for wish in ({"do": "explode"}, [], {}, {"do": "set", "settings": {"kp": "fort"}}, {"do": "pace"}):
        status, told = tell(server, wish)
        assert (status, told["fault"]) == (409, "la commande n'a pas été comprise")


def test_strangers_are_refused(follower):
    session, server = follower(start=False)
    assert ask(server, "/", Host="evil.example")[0].status == 403
    assert tell(server, {"do": "pause"}, Origin="http://evil.example")[0] == 403
    assert not session.paused


def test_the_way_as_a_file(follower):
    session, server = follower(steps=30, wait=False)
    wait_for(session.ended.is_set)
    answer, body = ask(server, "/trajectoire.csv")
    assert answer.getheader("Content-Disposition") == 'attachment; filename="trajectoire.csv"'
    rows = list(csv.DictReader(io.StringIO(body.decode())))
    assert len(rows) == 30
    assert float(rows[-1]["x_m"]) == pytest.approx(session.last.pose[0])


def test_what_is_not_there_is_not_found(follower):
    _, server = follower(start=False)
    for path in ("/nothing", "/files/x", "/page/../server.py", "/../session.py"):
        assert ask(server, path)[0].status == 404


def test_a_port_in_use_is_a_sentence(follower):
    session, server = follower(start=False)
    with pytest.raises(DataError, match=rf"le port {server.server_port} de 127.0.0.1 est déjà pris ; fermez"):
        FollowerServer(session, server.server_port)
