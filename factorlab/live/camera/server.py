"""The page's server: this computer only, pictures as MJPEG, numbers as server-sent events.

GET  /              the page
GET  /stream.mjpg   pictures with marks; each part says when its frame came (X-Captured-Ns, monotonic clock)
GET  /events        the state as JSON, up to twenty times a second
GET  /state.json    the state once          GET /snapshot.png   the picture that is shown now
GET  /files/…       what the task offers to save
POST /command       {"do": "pause" | "resume" | "again" | "task" | "act" | "overlay" | "record" | "stop"}
"""

from __future__ import annotations

import socket
from http import HTTPStatus
from typing import Any, ClassVar

from factorlab.live.camera.session import CameraSession
from factorlab.live.camera.state import state_of
from factorlab.live.serving import LocalServer, PageHandler

__all__ = ["PageServer"]

BOUNDARY = "frame"
SEND_BUFFER = 1 << 16  # a browser that falls behind shall get a newer picture, not all the old ones


class PageServer(LocalServer):
    """Serves a session on 127.0.0.1 from threads of its own.

    Parameters
    ----------
    session : started
    port : 0 takes any that is free

    Raises
    ------
    DataError
        where the port is in use or may not be used.
    """

    def __init__(self, session: CameraSession, port: int) -> None:
        self.session = session
        super().__init__(_Handler, port)


class _Handler(PageHandler):
    server: PageServer
    ROOM = "factorlab.live.camera"
    FILES = ("page.html", "page.css", "page.js", "charts.js", "panels.js")
    ANSWERS: ClassVar = {"/stream.mjpg": "_stream", "/events": "_events", "/snapshot.png": "_snapshot"}

    def get(self, path: str) -> bool:
        if path in self.ANSWERS:
            getattr(self, self.ANSWERS[path])()
            return True
        name = path.removeprefix("/files/")
        found = self.server.session.task.file(name) if name != path else None
        if found is not None:
            self.answer(found, "application/octet-stream", save_as=name)
        return found is not None

    def post(self, wish: Any) -> None:
        command(self.server.session, wish)

    def state(self) -> dict[str, Any]:
        return state_of(self.server.session)

    def _snapshot(self) -> None:
        picture = self.server.session.snapshot()
        if picture is None:
            self.answer(b"no frame yet\n", "text/plain", HTTPStatus.NOT_FOUND)
        else:
            self.answer(picture, "image/png")

    def _stream(self) -> None:
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self.begin(f"multipart/x-mixed-replace; boundary={BOUNDARY}")
        session, after = self.server.session, 0
        with session.watching():
            while not self.server.leaving.is_set():
                taken = session.shown.take(after, 0.5)
                if taken is None:
                    if session.shown.closed:
                        return
                    continue
                after, shown = taken
                if shown.jpeg:
                    head = (
                        f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(shown.jpeg)}\r\n"
                        f"X-Frame: {shown.captured.frame.index}\r\n"
                        f"X-Captured-Ns: {shown.captured.captured_ns}\r\n\r\n"
                    )
                    self.wfile.write(head.encode() + shown.jpeg + b"\r\n")

    def _events(self) -> None:
        session, after = self.server.session, 0

        def news() -> dict[str, Any]:
            nonlocal after
            taken = session.shown.take(after, 0.5)  # the state is told now and then without frames as well
            after = taken[0] if taken else after
            return state_of(session)

        self.tell(news)


def command(session: CameraSession, wish: dict[str, Any]) -> None:
    """Do what the page asks for.

    Raises
    ------
    FactorlabError
        where it cannot be done.
    ValueError, KeyError, TypeError, AttributeError
        where it makes no sense.
    """
    match wish["do"]:
        case "pause" | "resume":
            session.reader.pause(on=wish["do"] == "pause")
        case "again":
            session.reader.again()
        case "task":
            session.choose(str(wish["name"]))
        case "act":
            session.act(str(wish["name"]))
        case "overlay":
            session.show_marks(on=bool(wish["on"]))
        case "record":
            session.start_recording()
        case "stop":
            session.stop_recording()
        case _:
            raise ValueError(wish["do"])
