"""The page as a browser sees it: visible, silent on the console, alone with itself."""

import json
import re
import subprocess

import pytest
from chromium import QUIET

from factorlab.compare import compare, document
from factorlab.report import write_report

NOBODY = "not an origin"


@pytest.fixture
def page(walker, tmp_path):
    tables = (compare(walker, ("ekf", "ieks"), tune=True),)
    return write_report(tables, document(tables, "factorlab compare walk"), tmp_path / "out")


def browse(browser, folder, page, *options):
    """One visit with a fresh profile: (standard output, standard error)."""
    done = subprocess.run(
        [browser, *QUIET, f"--user-data-dir={folder / 'profile'}", *options, page.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout, done.stderr


def test_the_verdict_is_visible_and_the_console_silent(browser, tmp_path, page):
    dom, log = browse(browser, tmp_path, page, "--enable-logging=stderr", "--v=0", "--dump-dom")
    verdict = re.search(r'<table class="verdict">.*?</table>', dom, re.DOTALL)
    assert verdict
    assert re.search(r'class="badge (PASS|WARN|FAIL)"', verdict.group())
    assert dom.count("<svg") == 8
    assert "CONSOLE" not in log


def requests_of(browser, tmp_path, page):
    """Network addresses that a page asks for; what the browser asks on its own account has no origin."""
    netlog = tmp_path / f"{page.stem}.netlog"
    browse(browser, tmp_path, page, f"--log-net-log={netlog}", "--dump-dom")
    text = netlog.read_text(encoding="utf-8").rstrip()
    whole = json.loads(text if text.endswith("}") else text.rstrip(",") + "]}")
    params = [event.get("params", {}) for event in whole["events"]]
    asked = {
        p["url"] for p in params if "url" in p and p.get("initiator", "not an origin") != "not an origin"
    }
    return {url for url in asked if url.startswith(("http:", "https:", "ws:", "wss:"))}


def test_no_network_request(browser, tmp_path, page):
    assert not requests_of(browser, tmp_path, page)


def test_a_network_request_would_be_seen(browser, tmp_path):
    page = tmp_path / "guilty.html"
    page.write_text('<img src="http://127.0.0.1:9/pixel.png">', encoding="utf-8")
    assert requests_of(browser, tmp_path, page) == {"http://127.0.0.1:9/pixel.png"}


def test_the_page_paints(browser, tmp_path, page):
    picture = tmp_path / "page.png"
    browse(browser, tmp_path, page, f"--screenshot={picture}", "--window-size=1200,2000")
    assert picture.stat().st_size > 50_000, "a blank page compresses to almost nothing"
