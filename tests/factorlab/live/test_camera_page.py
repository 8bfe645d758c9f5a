"""The page in a browser: the picture moves, numbers arrive, buttons work, the console is silent."""

import contextlib
import re
import signal
import subprocess
import sys

import pytest

PIXELS = """(() => {
    const canvas = new OffscreenCanvas(picture.naturalWidth, picture.naturalHeight);
    canvas.getContext("2d").drawImage(picture, 0, 0);
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.reduce((sum, value, k) => (sum + value * (1 + (k % 8191))) % 1000000007, 0);
})()"""


def test_the_picture_and_the_numbers_of_markers(window, live, marker_video):
    session, server = live(marker_video, loop=True)
    session.start()
    window.visit(server.address)
    window.until("document.body.dataset.frame > 5")
    window.until("picture.naturalWidth === 320 && picture.naturalHeight === 240")
    window.until(f"{PIXELS} !== {window.run(PIXELS)}")
    assert window.run("headline.textContent") == "2 markers"
    cells = window.run("[...document.querySelectorAll('#tables td:first-child')].map(c => c.textContent)")
    assert cells == ["3", "7"]
    assert float(window.run("latency.textContent").split()[0]) < 1000
    assert {address.rpartition("/")[0] + "/" for address in window.asked} == {server.address}


def test_buttons_do_what_they_say(window, live, marker_video):
    session, server = live(marker_video, loop=True)
    session.start()
    window.visit(server.address)
    window.until("document.body.dataset.frame > 2")
    window.click("#pause")
    window.until("pause.textContent === 'Resume' && badge.textContent === 'paused'")
    still = session.reader.count
    window.click("#marks")
    window.until("marks.getAttribute('aria-pressed') === 'false'")
    assert session.reader.count <= still + 1
    window.click("#pause")
    window.until(f"document.body.dataset.frame > {still + 3}")
    window.click("#record")
    window.until("badge.textContent === '● REC' && parseFloat(recording.textContent) > 0.2")
    window.click("#record")
    window.until("recording.textContent.includes(' frames, ')")
    assert session.recorded[0].frames > 3
    window.click("#tasks button:nth-child(4)")
    window.until("document.body.dataset.task === 'features' && headline.textContent.endsWith('corners')")


def test_the_page_says_when_the_session_is_over(window, live, marker_video):
    session, server = live(marker_video)
    session.start()
    window.visit(server.address)
    window.until("badge.textContent === 'ended'")
    window.click("#pause")  # now: play again
    window.until("badge.hidden && document.body.dataset.frame >= 1")
    session.close()
    server.close()
    window.until("fault.textContent.startsWith('factorlab live has ended')")
    window.console.clear()  # where the browser says that nobody answers any more


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_paints_in_both_themes(window, live, marker_video, tmp_path, scheme):
    session, server = live(marker_video, loop=True)
    session.start()
    window.emulate(scheme)
    window.visit(server.address)
    window.until("document.body.dataset.frame > 2")
    assert window.run("document.documentElement.dataset.theme") == scheme
    ground = window.run(r"getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number)")
    assert (sum(ground) < 150) == (scheme == "dark")
    window.screenshot(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 20_000


@contextlib.contextmanager
def command(source, port):
    """`factorlab live camera` in a process of its own, and the port of its page; ends as by Ctrl-C."""
    options = ("--loop", "--no-browser", "--port", str(port))
    with subprocess.Popen(
        [sys.executable, "-m", "factorlab", "live", "camera", str(source), *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield int(re.search(r":(\d+)/", process.stderr.readline())[1])
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)
    assert process.returncode == 0


def test_the_page_hears_the_end_of_the_command_and_its_next_start(window, marker_video):
    with command(marker_video, 0) as port:
        window.visit(f"http://127.0.0.1:{port}/")
        window.until("document.body.dataset.frame > 2")
    window.until("fault.textContent.startsWith('factorlab live has ended')")
    with command(marker_video, port):
        window.until("fault.hidden && picture.naturalWidth === 320 && document.body.dataset.frame > 2")
        window.visit("about:blank")
    window.console.clear()  # where the browser says that nobody answered meanwhile
