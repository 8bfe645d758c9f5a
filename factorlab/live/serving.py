"""A page's server on this computer only: files, state once and as events, commands; nothing for strangers.

A room that shows something live derives one handler from `PageHandler` and says which files its page has
(`FILES`), what it answers besides (`get`), and what a command does (`post`).  Files that several pages share
(`SHARED`) lie in this package's own folder `page`.
"""

from __future__ import annotations

import errno
import json
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any, ClassVar

from sequential.errors import DataError, FactorlabError

__all__ = ["ENGLISH", "FRENCH", "LocalServer", "PageHandler", "PageWords", "as_bytes"]

HOST = "127.0.0.1"
EVENT_S = 0.05
KINDS = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
SHARED = ("look.css", "elements.js", "orders.js", "theme.js")
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'"
)
LONGEST = 4096  # bytes of a command
PageWords = Mapping[str, str]

ENGLISH: PageWords = {
    "in use": "port {port} of {host} is in use; close what uses it, or take any free one: --port 0",
    "unusable": "port {port} of {host} cannot be used: {why}; --port 0 takes any free one",
    "not understood": "the command was not understood",
}
FRENCH: PageWords = {
    "in use": "le port {port} de {host} est déjà pris ; fermez le programme qui l'utilise (une page restée "
    "ouverte dans un autre terminal ?), ou prenez un port libre : --port 0",
    "unusable": "le port {port} de {host} ne peut pas servir : {why} ; --port 0 prend un port libre",
    "not understood": "la commande n'a pas été comprise",
}


class LocalServer(ThreadingHTTPServer):
    """Serves a page on 127.0.0.1 from threads of its own.

    Parameters
    ----------
    handler : of requests
    port : 0 takes any that is free
    words : sentences in the page's language

    Raises
    ------
    DataError
        where the port is in use or may not be used.
    """

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, handler: type[PageHandler], port: int, words: PageWords = ENGLISH) -> None:
        self.words, self.leaving = words, threading.Event()
        self.talking: set[threading.Thread] = set()  # those that tell a page what goes on
        try:
            super().__init__((HOST, port), handler)
        except OSError as fault:
            name = "in use" if fault.errno == errno.EADDRINUSE else "unusable"
            raise DataError(words[name].format(port=port, host=HOST, why=fault.strerror)) from fault
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


class PageHandler(BaseHTTPRequestHandler, ABC):
    """Answers one browser; a page's own handler says what there is."""

    server: LocalServer
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    ROOM: ClassVar[str]  # the package whose folder `page` holds the files
    FILES: ClassVar[tuple[str, ...]]  # page.html is what the address alone gives

    @abstractmethod
    def get(self, path: str) -> bool:
        """Answer for a path that is no file of the page; False where there is nothing."""

    @abstractmethod
    def post(self, wish: Any) -> None:
        """Do what the page asks for.

        Raises
        ------
        FactorlabError
            where it cannot be done.
        ValueError, KeyError, TypeError, AttributeError
            where it makes no sense.
        """

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """What the page shows, as strict JSON takes it."""

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - http.server's name
        """Keep quiet."""

    def do_GET(self) -> None:
        """Serve a file, the state, or what the page's own handler has."""
        if not self._is_for_us():
            return
        path = self.path.partition("?")[0]
        name = path[1:] or "page.html"
        if name in SHARED or name in self.FILES:
            room = "factorlab.live" if name in SHARED else self.ROOM
            kind = KINDS[name.rpartition(".")[2]]
            self.answer(files(room).joinpath("page", name).read_bytes(), f"{kind}; charset=utf-8")
        elif path == "/state.json":
            self.answer(as_bytes(self.state()), "application/json")
        elif not self.get(path):
            self.answer(b"there is nothing here\n", "text/plain", HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Do a command and tell the state after it, with a sentence where it could not be done."""
        if not self._is_for_us(same_origin=True):
            return
        length = self.headers.get("Content-Length", "")
        if self.path != "/command" or not length.isdecimal() or int(length) > LONGEST:
            self.close_connection = True
            self.answer(b"not understood\n", "text/plain", HTTPStatus.BAD_REQUEST)
            return
        try:
            self.post(json.loads(self.rfile.read(int(length))))
            fault = ""
        except FactorlabError as error:
            fault = str(error)
        except (ValueError, KeyError, TypeError, AttributeError):
            fault = self.server.words["not understood"]
        status = HTTPStatus.CONFLICT if fault else HTTPStatus.OK
        self.answer(as_bytes({"fault": fault, "state": self.state()}), "application/json", status)

    def answer(
        self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK, *, save_as: str = ""
    ) -> None:
        """Send a whole answer."""
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        if save_as:
            self.send_header("Content-Disposition", f'attachment; filename="{save_as}"')
        self._rules()
        self.end_headers()
        self.wfile.write(body)

    def begin(self, kind: str) -> None:
        """Send the head of an answer that goes on until somebody leaves."""
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Connection", "close")
        self._rules()
        self.end_headers()

    def tell(self, news: Callable[[], dict[str, Any]]) -> None:
        """Send what `news` gives as server-sent events, up to twenty times a second, and the end."""
        self.server.talking.add(threading.current_thread())
        try:
            self.begin("text/event-stream")
            while not self.server.leaving.is_set():
                began = time.monotonic()
                self.wfile.write(b"data: " + as_bytes(news()) + b"\n\n")
                self.server.leaving.wait(max(0.0, EVENT_S - (time.monotonic() - began)))
            self.wfile.write(b"event: over\ndata: {}\n\n")
        finally:
            self.server.talking.discard(threading.current_thread())

    def _is_for_us(self, *, same_origin: bool = False) -> bool:
        """Refuse pages of other origins that found this port, and names that were made to point here."""
        hosts = {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}
        origin = self.headers.get("Origin")
        foreign = same_origin and origin is not None and origin not in {f"http://{host}" for host in hosts}
        if self.headers.get("Host", "") in hosts and not foreign:
            return True
        self.close_connection = True
        self.answer(b"only for pages of this computer\n", "text/plain", HTTPStatus.FORBIDDEN)
        return False

    def _rules(self) -> None:
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")


def as_bytes(value: Any) -> bytes:
    """Strict JSON."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False).encode()
