"""The server: whole pictures with their times, events, files, and nothing for strangers."""

import json
import socket
import threading
import time

import cv2
import numpy as np
import pytest
from live_worlds import ask, asked, wait_for, write_video

from factorlab.live.camera import PageServer, Task, TaskChoice
from factorlab.live.camera.reading import Dots, Label, Line, Reading
from sequential.errors import DataError


class Still(Task):
    """Draws the same marks on every frame, and offers a file."""

    name, columns = "still", ()

    def read(self, frame):
        square = np.array([[20.0, 20.0], [80.0, 20.0], [80.0, 80.0], [20.0, 80.0]])
        nowhere = np.array([[np.nan, 3.0], [1e9, 4.0]])
        return Reading(
            "still", marks=(Line(square, closed=True), Dots(nowhere), Line(nowhere), Label(nowhere[0], "x"))
        )

    def file(self, name):
        return b"text" if name == "camera.yaml" else None


STILL = (TaskChoice("still", "Still", Still),)


@pytest.fixture
def served(live, marker_video):
    session, server = live(marker_video, "still", choices=STILL, loop=True)
    session.start()
    wait_for(lambda: session.shown.number > 0)
    return session, server


def tell(server, wish, **headers):
    text = json.dumps(wish) if isinstance(wish, dict) else wish
    answer, body = ask(server, "/command", method="POST", body=text, **headers)
    return answer.status, body


def parts(server, count):
    """Heads and pictures of a stream."""
    found = []
    with asked(server, "/stream.mjpg") as answer:
        assert answer.getheader("Content-Type") == "multipart/x-mixed-replace; boundary=frame"
        for _ in range(count):
            assert answer.readline() == b"--frame\r\n"
            head = dict(line.decode().strip().split(": ") for line in iter(answer.readline, b"\r\n"))
            found.append((head, answer.read(int(head["Content-Length"]))))
            assert answer.readline() == b"\r\n"
    return found


def test_the_stream_is_whole_pictures_in_order_with_their_times(served):
    _, server = served
    found = parts(server, 8)
    frames = [int(head["X-Frame"]) for head, _ in found]
    assert frames == sorted(frames)
    for head, picture in found:
        assert cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR).shape == (240, 320, 3)
        assert 0 < time.monotonic_ns() - int(head["X-Captured-Ns"]) < 20e9


def test_pictures_are_made_only_while_somebody_watches(served):
    session, server = served
    assert session.shown.take(0, 0.0)[1].jpeg == b""
    parts(server, 2)
    wait_for(lambda: session.shown.take(0, 0.0)[1].jpeg == b"")


def test_a_snapshot_has_marks_unless_they_are_hidden(served):
    session, server = served
    session.reader.pause(on=True)
    time.sleep(0.2)
    image = session.shown.take(0, 0.0)[1].captured.frame.image

    def snapshot():
        answer, body = ask(server, "/snapshot.png")
        assert answer.getheader("Content-Type") == "image/png"
        return cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR)

    assert (snapshot()[20, 30:70] != image[20, 30:70]).all(axis=1).all()
    tell(server, {"do": "overlay", "on": False})
    np.testing.assert_array_equal(snapshot(), image)


def test_events_tell_the_state_and_the_end(served):
    session, server = served
    frames = []
    with asked(server, "/events") as answer:
        assert answer.getheader("Content-Type") == "text/event-stream"
        for _ in range(5):
            line = answer.readline()
            assert line.startswith(b"data: ")
            assert answer.readline() == b"\n"
            frames.append(json.loads(line[6:])["frame"]["index"])
        assert frames == sorted(set(frames))
        ending = threading.Thread(target=lambda: (session.close(), server.close()))
        ending.start()
        assert answer.read().endswith(b"event: over\ndata: {}\n\n")
        ending.join()


def test_files_of_the_task_are_offered_and_no_others(served):
    _, server = served
    answer, body = ask(server, "/files/camera.yaml")
    assert (answer.status, body) == (200, b"text")
    assert answer.getheader("Content-Disposition") == 'attachment; filename="camera.yaml"'
    for path in ("/files/other", "/files/../page.py", "/nothing", "/page/../server.py"):
        assert ask(server, path)[0].status == 404


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/look.css",
        "/page.css",
        "/page.js",
        "/elements.js",
        "/orders.js",
        "/panels.js",
        "/charts.js",
        "/theme.js",
    ],
)
def test_the_page_needs_nothing_from_elsewhere(served, path):
    _, server = served
    answer, body = ask(server, path)
    assert answer.status == 200
    assert "default-src 'none'" in answer.getheader("Content-Security-Policy")
    assert b"http" not in body.replace(b"http://www.w3.org/2000/svg", b"")


def test_strangers_are_refused(served):
    session, server = served
    port = server.server_port
    assert ask(server, "/", Host="evil.example")[0].status == 403
    assert ask(server, "/state.json", Host=f"127.0.0.1.evil.example:{port}")[0].status == 403
    assert tell(server, {"do": "pause"}, Origin="http://evil.example")[0] == 403
    assert not session.reader.paused
    assert tell(server, {"do": "pause"}, Origin=f"http://localhost:{port}")[0] == 200
    assert session.reader.paused


@pytest.mark.parametrize(
    "wish", ["", "{", "[]", "{}", '{"do": "explode"}', '{"do": "task"}', '"text"', "1e999"]
)
def test_what_makes_no_sense_is_refused(served, wish):
    status, body = tell(served[1], wish)
    assert status == 409
    assert json.loads(body)["fault"] == "the command was not understood"


def test_a_command_that_is_too_long_is_refused(served):
    assert tell(served[1], " " * 10_000)[0] == 400
    assert ask(served[1], "/elsewhere", method="POST", body="{}")[0].status == 400


def test_a_wish_that_cannot_be_met_is_a_sentence(served):
    status, body = tell(served[1], {"do": "task", "name": "juggle"})
    assert status == 409
    assert json.loads(body)["fault"] == "there is no task 'juggle', only still"


def test_a_port_in_use_is_a_sentence(served):
    session, server = served
    with pytest.raises(DataError, match=rf"port {server.server_port} of 127.0.0.1 is in use"):
        PageServer(session, server.server_port)


def test_nobody_outside_this_computer_is_served(served):
    assert served[1].socket.getsockname()[0] == "127.0.0.1"


def test_who_falls_behind_gets_new_pictures_and_not_all_the_old_ones(live, tmp_path, rng):
    noise = (rng.integers(0, 255, (240, 320, 3), dtype=np.uint8) for _ in range(75))
    session, server = live(write_video(tmp_path / "noise.avi", noise), "still", choices=STILL)
    session.start()
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=5) as stream:
        stream.sendall(f"GET /stream.mjpg HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\n\r\n".encode())
        wait_for(lambda: session.ended)
        text = b""
        while b"X-Frame: 74\r\n" not in text:
            more = stream.recv(1 << 16)
            assert more, "the last picture never came"
            text += more
    assert text.count(b"X-Frame: ") < 60
