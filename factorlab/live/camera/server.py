"""The page's server: this computer only, pictures as MJPEG, numbers as server-sent events.

GET  /              the page
GET  /stream.mjpg   pictures with marks; each part says when its frame came (X-Captured-Ns, monotonic clock)
GET  /events        the state as JSON, up to twenty times a second
GET  /state.json    the state once          GET /snapshot.png   the picture that is shown now
GET  /files/…       what the task offers to save
POST /command       {"do": "pause" | "resume" | "again" | "task" | "act" | "overlay" | "record" | "stop"}
"""

from __future__ import annotations

import errno
import json
import socket
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any, ClassVar

from factorlab.live.camera.session import CameraSession
from factorlab.live.camera.state import state_of
from sequential.errors import DataError, FactorlabError

__all__ = ["PageServer"]

HOST = "127.0.0.1"
BOUNDARY = "frame"
EVENT_S = 0.05
PAGE = {
    "/": ("page.html", "text/html; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/charts.js": ("charts.js", "text/javascript; charset=utf-8"),
    "/panels.js": ("panels.js", "text/javascript; charset=utf-8"),
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'"
)
LONGEST = 4096  # bytes of a command
SEND_BUFFER = 1 << 16  # a browser that falls behind shall get a newer picture, not all the old ones


class PageServer(ThreadingHTTPServer):
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

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, session: CameraSession, port: int) -> None:
        self.session, self.leaving = session, threading.Event()
        self.talking: set[threading.Thread] = set()  # those that tell a page what goes on
        try:
            super().__init__((HOST, port), _Handler)
        except OSError as fault:
            raise DataError(_port_fault(port, fault)) from fault
        self._thread = threading.Thread(target=self.serve_forever, args=(0.05,), name="server", daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """What to type into a browser."""
        return f"http://{HOST}:{self.server_port}/"

    def close(self) -> None:
        """Stop serving; pages say that the session is over."""
        self.leaving.set()
        for thread in tuple(self.talking):
            thread.join(timeout=1.0)
        self.shutdown()
        self.server_close()
        self._thread.join()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Keep quiet about browsers that go away."""


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    ANSWERS: ClassVar = {"/stream.mjpg": "_stream", "/events": "_events", "/state.json": "_state",
                         "/snapshot.png": "_snapshot"}  # fmt: skip

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - http.server's name
        """Keep quiet."""

    def do_GET(self) -> None:
        if not self._is_for_us():
            return
        path = self.path.partition("?")[0]
        if path in PAGE:
            name, kind = PAGE[path]
            text = files("factorlab.live.camera").joinpath("page", name).read_bytes()
            self._answer(text, kind)
        elif path in self.ANSWERS:
            getattr(self, self.ANSWERS[path])()
        elif path.startswith("/files/") and (found := self.server.session.task.file(path[7:])) is not None:
            self._answer(found, "application/octet-stream", save_as=path[7:])
        else:
            self._answer(b"there is nothing here\n", "text/plain", HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        if not self._is_for_us(same_origin=True):
            return
        length = self.headers.get("Content-Length", "")
        if self.path != "/command" or not length.isdecimal() or int(length) > LONGEST:
            self.close_connection = True
            self._answer(b"not understood\n", "text/plain", HTTPStatus.BAD_REQUEST)
            return
        try:
            command(self.server.session, json.loads(self.rfile.read(int(length))))
            fault = ""
        except FactorlabError as error:
            fault = str(error)
        except (ValueError, KeyError, TypeError, AttributeError):
            fault = "the command was not understood"
        status = HTTPStatus.CONFLICT if fault else HTTPStatus.OK
        self._answer(
            _json({"fault": fault, "state": state_of(self.server.session)}), "application/json", status
        )

    def _is_for_us(self, *, same_origin: bool = False) -> bool:
        """Refuse pages of other origins that found this port, and names that were made to point here."""
        hosts = {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}
        origin = self.headers.get("Origin")
        foreign = same_origin and origin is not None and origin not in {f"http://{host}" for host in hosts}
        if self.headers.get("Host", "") in hosts and not foreign:
            return True
        self.close_connection = True
        self._answer(b"only for pages of this computer\n", "text/plain", HTTPStatus.FORBIDDEN)
        return False

    def _answer(
        self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK, *, save_as: str = ""
    ) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        if save_as:
            self.send_header("Content-Disposition", f'attachment; filename="{save_as}"')
        self._common()
        self.end_headers()
        self.wfile.write(body)

    def _common(self) -> None:
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")

    def _open(self, kind: str) -> None:
        """The head of an answer that goes on until somebody leaves."""
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Connection", "close")
        self._common()
        self.end_headers()

    def _state(self) -> None:
        self._answer(_json(state_of(self.server.session)), "application/json")

    def _snapshot(self) -> None:
        picture = self.server.session.snapshot()
        if picture is None:
            self._answer(b"no frame yet\n", "text/plain", HTTPStatus.NOT_FOUND)
        else:
            self._answer(picture, "image/png")

    def _stream(self) -> None:
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self._open(f"multipart/x-mixed-replace; boundary={BOUNDARY}")
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
        self.server.talking.add(threading.current_thread())
        try:
            self._tell()
        finally:
            self.server.talking.discard(threading.current_thread())

    def _tell(self) -> None:
        self._open("text/event-stream")
        session, after = self.server.session, 0
        while not self.server.leaving.is_set():
            began = time.monotonic()
            taken = session.shown.take(after, 0.5)  # the state is told now and then without frames as well
            after = taken[0] if taken else after
            self.wfile.write(b"data: " + _json(state_of(session)) + b"\n\n")
            self.server.leaving.wait(max(0.0, EVENT_S - (time.monotonic() - began)))
        self.wfile.write(b"event: over\ndata: {}\n\n")


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


def _json(value: Any) -> bytes:
    return json.dumps(value, ensure_ascii=False, allow_nan=False).encode()


def _port_fault(port: int, fault: OSError) -> str:
    if fault.errno == errno.EADDRINUSE:
        return f"port {port} of {HOST} is in use; close what uses it, or take any free one: --port 0"
    return f"port {port} of {HOST} cannot be used: {fault.strerror}; --port 0 takes any free one"
