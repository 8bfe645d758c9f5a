"""The follower's page in a browser: it drives, loses the line in noise, and finds it again; all in French."""

import contextlib

import pytest

from factorlab.l19.follower import FollowerSettings
from factorlab.live.follower import FollowerServer, FollowerSession


@pytest.fixture
def follower():
    """Begin sessions, each with its page; they end with the test."""
    with contextlib.ExitStack() as begun:

        def begin(*, pace=1.0, **settings):
            session = FollowerSession(FollowerSettings(**{"curve": "circuit"} | settings))
            session.pace = pace
            begun.callback(session.close)
            server = FollowerServer(session, 0)
            begun.callback(server.close)
            session.start()
            return session, server

        yield begin


def slide(window, name, value):
    """Move a slider as a hand would."""
    window.run(
        f"(() => {{ const s = document.getElementById('{name}'); s.value = {value};"
        " s.dispatchEvent(new Event('input', { bubbles: true })); })()"
    )


INK = """(() => {
    const { width, height } = map;
    const { data } = map.getContext("2d").getImageData(0, 0, width, height);
    let count = 0;
    for (let k = 3; k < data.length; k += 4) count += data[k] > 0;
    return count;
})()"""


def test_the_robot_drives_and_the_page_asks_nobody_else(window, follower):
    _, server = follower()
    window.visit(server.address)
    window.until("document.body.dataset.steps > 10")
    assert window.run("headline.textContent") == "Le robot suit la ligne"
    assert window.run("camera.width") == 600
    assert window.run(INK) > 2000
    assert window.run("rms.textContent").endswith(" cm")
    assert window.run("document.querySelectorAll('#controls input[type=range]').length") == 10
    assert {address.rpartition("/")[0] + "/" for address in window.asked} == {server.address}


def test_noise_loses_the_line_and_less_noise_finds_it_again(window, follower):
    session, server = follower(pace=5.0)
    window.visit(server.address)
    window.until("document.body.dataset.steps > 20")
    slide(window, "noise", 200)
    window.until("document.body.dataset.lost === 'true'")
    assert session.settings.noise == 200.0
    assert window.run("headline.textContent").startswith("Ligne perdue à ")
    assert "baissez le bruit" in window.run("advice.textContent")
    assert window.run("badge.textContent") == "ligne perdue"
    slide(window, "noise", 0)
    window.until("noise.value === '0'")
    window.click("#restart")
    window.until("document.body.dataset.journey === '2' && document.body.dataset.steps > 20")
    assert window.run("document.body.dataset.lost") == "false"
    assert window.run("badge.hidden")
    rows = window.run("[...document.querySelectorAll('#attempts tbody tr')].map(r => r.innerText)")
    assert len(rows) == 2
    assert "perdu à" in rows[0]


def test_gains_change_the_way(window, follower):
    """Kp of a third leaves a larger error in the same bends."""
    errors = []
    for kp in (18.0, 5.0):
        session, server = follower(pace=5.0)
        window.visit(server.address)
        window.until("document.body.dataset.steps > 0")
        slide(window, "kp", kp)
        window.until(f"kp.value === '{kp:g}'")
        window.click("#restart")
        window.until("document.body.dataset.journey === '2' && document.body.dataset.steps > 150")
        assert session.settings.kp == kp
        errors.append(session.journey.rms_m)
    assert errors[1] > 2 * errors[0]
