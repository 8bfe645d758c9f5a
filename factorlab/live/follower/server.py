"""The page's server, on this computer only.

GET  /              the page
GET  /setup.json    sliders and curves          GET /line.json    points of the line
GET  /events        state and newest steps as JSON, up to twenty times a second
GET  /state.json    the state once              GET /trajectoire.csv    the last drive
POST /command       {"do": "pause" | "resume" | "restart" | "set" | "pace"}
"""

from __future__ import annotations

import math
from typing import Any

from factorlab.live.follower.journey import COLUMNS
from factorlab.live.follower.session import FollowerSession
from factorlab.live.follower.state import Cursor, line_of, setup_of, state_of
from factorlab.live.serving import FRENCH, LocalServer, PageHandler, as_bytes

__all__ = ["FollowerServer", "csv_of"]


class FollowerServer(LocalServer):
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

    def __init__(self, session: FollowerSession, port: int) -> None:
        self.session = session
        super().__init__(_Handler, port, FRENCH)


class _Handler(PageHandler):
    server: FollowerServer
    ROOM = "factorlab.live.follower"
    FILES = ("page.html", "page.css", "page.js", "controls.js", "map.js", "strips.js")

    def get(self, path: str) -> bool:
        session = self.server.session
        if path == "/setup.json":
            self.answer(as_bytes(setup_of()), "application/json")
        elif path == "/line.json":
            self.answer(as_bytes(line_of(session)), "application/json")
        elif path == "/trajectoire.csv":
            text = csv_of(session.journey.rows)
            self.answer(text.encode(), "text/csv; charset=utf-8", save_as="trajectoire.csv")
        elif path == "/events":
            cursor = Cursor()
            self.tell(lambda: cursor.news(session))
        else:
            return False
        return True

    def post(self, wish: Any) -> None:
        command(self.server.session, wish)

    def state(self) -> dict[str, Any]:
        return state_of(self.server.session)


def command(session: FollowerSession, wish: dict[str, Any]) -> None:
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
            session.pause(on=wish["do"] == "pause")
        case "restart":
            session.restart()
        case "set":
            session.change(wish["settings"])
        case "pace":
            session.set_pace(float(wish["pace"]))
        case _:
            raise ValueError(wish["do"])


def csv_of(rows: list[tuple[float, ...]]) -> str:
    """Steps as a table, a line each; empty cells where the line was not found."""
    lines = [",".join(COLUMNS)]
    lines += [",".join("" if math.isnan(cell) else f"{cell:.9g}" for cell in row) for row in list(rows)]
    return "\n".join(lines) + "\n"
