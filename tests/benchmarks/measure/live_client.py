"""A live page's server in a process of its own, and a client that notes when each picture came."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple


class Pictures(NamedTuple):
    """What came in a time: number of each frame, when the server had it, when it was here (ns)."""

    frames: list[int]
    captured_ns: list[int]
    received_ns: list[int]

    @property
    def fps(self) -> float:
        """Pictures a second."""
        return (len(self.frames) - 1) / ((self.received_ns[-1] - self.received_ns[0]) * 1e-9)

    @property
    def latency_ms(self) -> list[float]:
        """From the arrival of each frame at the server to its picture being here."""
        return [(b - a) * 1e-6 for a, b in zip(self.captured_ns, self.received_ns, strict=True)]


class Served:
    """The running command; `summary` is what it prints at the end."""

    def __init__(self, process: subprocess.Popen[str], address: str) -> None:
        self.process, self.address = process, address
        self.port = int(re.search(r":(\d+)/", address)[1])
        self.summary: dict[str, Any] = {}

    def state(self) -> dict[str, Any]:
        """What the page shows."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request("GET", "/state.json")
        with contextlib.closing(connection), connection.getresponse() as answer:
            return json.load(answer)

    def pictures(self, seconds: float, warm_s: float = 2.0) -> Pictures:
        """Take the stream for some seconds, after a while that is not counted."""
        found = Pictures([], [], [])
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request("GET", "/stream.mjpg")
        begun = time.monotonic()
        with contextlib.closing(connection), connection.getresponse() as answer:
            while (passed := time.monotonic() - begun) < warm_s + seconds:
                answer.readline()  # the boundary
                head = dict(line.decode().strip().split(": ") for line in iter(answer.readline, b"\r\n"))
                answer.read(int(head["Content-Length"]) + 2)
                if passed > warm_s:
                    found.frames.append(int(head["X-Frame"]))
                    found.captured_ns.append(int(head["X-Captured-Ns"]))
                    found.received_ns.append(time.monotonic_ns())
        return found


@contextlib.contextmanager
def served(source: Path, *options: str) -> Iterator[Served]:
    """`factorlab live camera` on a file, until the block ends."""
    command = [sys.executable, "-m", "factorlab", "live", "camera", str(source)]
    process = subprocess.Popen(
        [*command, "--no-browser", "--port", "0", "--json", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    line = process.stderr.readline()
    found = re.search(r"http://\S+", line)
    if found is None:
        sys.exit(line + process.stderr.read())
    one = Served(process, found[0])
    try:
        yield one
    finally:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        one.summary = json.loads(out) if process.returncode == 0 else sys.exit(out + err)
