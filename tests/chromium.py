"""A headless Chromium that a test drives through a pipe: load a page, run script in it, look at it.

The messages are those of the DevTools protocol: JSON, each ended by a zero byte.
"""

import base64
import fcntl
import json
import os
import select
import subprocess
import time

QUIET = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)


class Chromium:
    """One window; what its console says and what the page asks the network for is kept."""

    def __init__(self, path, profile, *, size=(1300, 900)):
        commands, answers = os.pipe(), os.pipe()
        ends = [fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, 10) for fd in (commands[0], answers[1])]

        def give_pipes():  # the browser reads commands from descriptor 3 and answers on 4
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        self.process = subprocess.Popen(
            [
                path,
                *QUIET,
                f"--user-data-dir={profile}",
                f"--window-size={size[0]},{size[1]}",
                "--remote-debugging-pipe",
                "about:blank",
            ],
            preexec_fn=give_pipes,  # noqa: PLW1509 - nothing else gives a child descriptors of chosen numbers
            close_fds=False,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for fd in (*ends, commands[0], answers[1]):
            os.close(fd)
        self._in, self._out, self._rest = commands[1], answers[0], b""
        self._number, self._session = 0, None
        self.console, self.asked = [], []
        target = self._wait_target()
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        os.close(self._in)
        self.process.terminate()
        self.process.wait(20)
        os.close(self._out)

    def _wait_target(self):
        end = time.monotonic() + 30
        while time.monotonic() < end:
            pages = [one for one in self.call("Target.getTargets")["targetInfos"] if one["type"] == "page"]
            if pages:
                return pages[0]["targetId"]
            time.sleep(0.05)
        raise TimeoutError("the browser opened no page")

    def call(self, method, **params):
        """Send one command and give its answer; events that come meanwhile are taken note of."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._in, json.dumps(message).encode() + b"\0")
        while True:
            told = self._receive(30)
            if told.get("id") == self._number:
                if "error" in told:
                    raise RuntimeError(told["error"]["message"])
                return told["result"]

    def _receive(self, timeout):
        while b"\0" not in self._rest:
            if not select.select([self._out], [], [], timeout)[0]:
                raise TimeoutError("the browser does not answer")
            self._rest += os.read(self._out, 1 << 20)
        text, _, self._rest = self._rest.partition(b"\0")
        told = json.loads(text)
        self._note(told.get("method"), told.get("params", {}))
        return told

    def _note(self, method, params):
        if method == "Runtime.consoleAPICalled":
            self.console.append(" ".join(str(one.get("value")) for one in params["args"]))
        elif method == "Runtime.exceptionThrown":
            self.console.append(json.dumps(params["exceptionDetails"]))
        elif method == "Log.entryAdded":
            self.console.append(params["entry"]["text"])
        elif method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Network.requestWillBeSent":
            self.asked.append(params["request"]["url"])

    def visit(self, address):
        """Load a page."""
        self._loaded = False
        self.call("Page.navigate", url=address)
        while not self._loaded:
            self._receive(30)

    def run(self, script):
        """The value of a script."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"])
        return answer["result"].get("value")

    def until(self, script, seconds=45):
        """Wait until a script gives something that is true, and give it; it may fail while a page loads."""
        end, fault = time.monotonic() + seconds, ""
        while time.monotonic() < end:
            try:
                if value := self.run(script):
                    return value
            except RuntimeError as error:
                fault = f" ({error})"
            time.sleep(0.05)
        raise AssertionError(
            f"{script} stayed false for {seconds} s{fault}; the page says: {self.text()[:800]}"
        )

    def text(self):
        """What a reader sees."""
        return self.run("document.body.innerText")

    def click(self, selector):
        """Press a button, which has to be there."""
        self.run(f"document.querySelector({json.dumps(selector)}).click()")

    def screenshot(self, path):
        """The window as a PNG file."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def emulate(self, scheme):
        """`light` or `dark`, as the system would say."""
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
