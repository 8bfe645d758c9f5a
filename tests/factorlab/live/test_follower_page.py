"""The follower's page in a browser: it drives, loses the line in noise, and finds it again; all in French."""

import contextlib
import json
import re
import signal
import subprocess
import sys

import pytest

INK = """(() => {
    const copy = new OffscreenCanvas(map.width, map.height);
    copy.getContext("2d").drawImage(map, 0, 0);
    const { data } = copy.getContext("2d").getImageData(0, 0, copy.width, copy.height);
    let count = 0;
    for (let k = 3; k < data.length; k += 4) count += data[k] > 0;
    return count;
})()"""


def slide(window, name, value):
    """Move a slider as a hand would."""
    window.run(
        f"(() => {{ const s = document.getElementById({json.dumps(name)}); s.value = {value};"
        " s.dispatchEvent(new Event('input', { bubbles: true })); })()"
    )


def press(window, key):
    """A key, with nothing in focus."""
    window.run("document.activeElement.blur()")
    for kind in ("keyDown", "keyUp"):
        window.call("Input.dispatchKeyEvent", type=kind, key=key, text=key if kind == "keyDown" else "")


def visit(window, server, steps=10):
    window.visit(server.address)
    window.until(f"document.body.dataset.steps > {steps}")


def test_the_robot_drives_and_the_page_asks_nobody_else(window, follower):
    _, server = follower(pace=1.0)
    visit(window, server)
    assert window.run("headline.textContent") == "Le robot suit la ligne"
    window.until("camera.width === 600")
    assert window.run(INK) > 2000
    window.until(f"camera.toDataURL() !== {json.dumps(window.run('camera.toDataURL()'))}")
    assert window.run("rms.textContent").endswith(" cm")
    assert {address.rpartition("/")[0] + "/" for address in window.asked} == {server.address}


def test_every_slider_has_a_name_a_unit_and_limits(window, follower):
    _, server = follower()
    visit(window, server, 0)
    sliders = window.run(
        """[...document.querySelectorAll("#controls input[type=range]")].map((one) =>
           [one.id, one.labels[0].textContent, one.ariaValueText, Number(one.min) < Number(one.max)])"""
    )
    assert [one[0] for one in sliders] == [
        "noise", "blur_s", "look_ahead", "kp", "ki", "kd",
        "speed_m_s", "wheel_noise", "gyro_noise", "bridging_s",
    ]  # fmt: skip
    assert all(label and told and spans for _, label, told, spans in sliders)
    assert "18,0 rad/s par m" in sliders[3][2]


def test_noise_loses_the_line_and_less_noise_finds_it_again(window, follower):
    session, server = follower()
    visit(window, server, 20)
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
    window.until("badge.hidden && advice.hidden")
    rows = window.run("[...document.querySelectorAll('#attempts tbody tr')].map(r => r.innerText)")
    assert len(rows) == 2
    assert "perdu à" in rows[0]


def test_a_robot_that_sees_the_line_again_drives_on_by_itself(window, follower):
    session, server = follower(noise=200.0)
    window.visit(server.address)
    window.until("document.body.dataset.lost === 'true'")
    slide(window, "noise", 0)
    window.until("headline.textContent.startsWith('Le robot a retrouvé la ligne')")
    assert session.journey.number == 1
    assert session.last.command[0] > 0


def test_gains_change_the_way(window, follower):
    """A third of the gain leaves a larger error in the same bends."""
    errors = []
    for kp in (18.0, 5.0):
        session, server = follower()
        visit(window, server, 0)
        slide(window, "kp", kp)
        window.until(f"kp.value === '{kp:g}'")
        window.click("#restart")
        window.until("document.body.dataset.journey === '2' && document.body.dataset.steps > 150")
        assert session.settings.kp == kp
        errors.append(session.journey.rms_m)
    assert errors[1] > 2 * errors[0]


def test_keys_do_what_buttons_do(window, follower):
    session, server = follower(pace=1.0)
    visit(window, server)
    press(window, " ")
    window.until("pause.textContent === 'Reprendre' && headline.textContent === 'En pause'")
    still = len(session.journey.rows)
    press(window, "z")
    window.until("zoom.getAttribute('aria-pressed') === 'true'")
    assert len(session.journey.rows) == still
    press(window, "g")
    window.until("seed.value === '1' && document.body.dataset.journey === '2'")
    assert session.settings.seed == 1
    press(window, "r")
    window.until("document.body.dataset.journey === '3'")


def test_another_curve_is_another_line_on_the_map(window, follower):
    session, server = follower()
    visit(window, server)
    window.run("curve.value = 'slalom'; curve.dispatchEvent(new Event('change'))")
    window.until("document.body.dataset.journey === '2' && document.body.dataset.steps > 5")
    assert session.settings.curve == "slalom"
    assert session.lines == 2
    assert window.run("curve.selectedOptions[0].textContent").startswith("slalom : ")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_has_no_sideways_scrolling_in_either_theme(window, follower, scheme):
    _, server = follower()
    window.emulate(scheme)
    window.call("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=2, mobile=True)
    visit(window, server, 0)
    assert window.run("document.documentElement.dataset.theme") == scheme
    assert window.run("document.documentElement.scrollWidth") == 390
    assert window.run("map.width") == 2 * window.run("map.clientWidth")


@contextlib.contextmanager
def command(port):
    """`factorlab l19 suiveur` in a process of its own, and the port of its page; ends as by Ctrl-C."""
    with subprocess.Popen(
        [sys.executable, "-m", "factorlab", "l19", "suiveur", "--no-browser", "--port", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            found = None
            while found is None:
                found = re.search(r":(\d+)/", process.stderr.readline())
            yield int(found[1])
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)
    assert process.returncode == 0


def test_the_page_hears_the_end_of_the_command_and_its_next_start(window):
    with command(0) as port:
        window.visit(f"http://127.0.0.1:{port}/")
        window.until("document.body.dataset.steps > 2")
    window.until("fault.textContent.startsWith('Le programme est terminé')")
    assert window.run("restart.disabled")
    with command(port):
        window.until("fault.hidden && document.body.dataset.steps > 2")
        window.visit("about:blank")
    window.console.clear()  # where the browser says that nobody answered meanwhile
