"""The documentation builds without a warning, is whole without a network, and shows commands that exist."""

import ast
import fcntl
import importlib
import inspect
import os
import re
import subprocess
import sys

import pytest
from chromium import Chromium
from site_reading import (
    NOTES,
    ROOT,
    Page,
    command_lines,
    faults_of,
    is_elsewhere,
    landing,
    linked_files,
    python_blocks,
)

from factorlab.cli import main

LARGEST = 200_000  # bytes of a picture
SERVED = "404.html"  # shown by servers only, with addresses from their top
PHONE = {"width": 390, "height": 800, "deviceScaleFactor": 2, "mobile": True}


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The site, built once for all workers."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "site"
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "index.html").exists():
            build(folder)
    return folder


def build(folder):
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, re.sub(r"^INFO.*\n?", "", done.stdout + done.stderr, flags=re.MULTILINE)


@pytest.fixture(scope="session")
def pages(site):
    """Every page of the site, read."""
    return {path.resolve(): Page(path) for path in sorted(site.rglob("*.html"))}


def test_every_package_and_command_has_its_page(site):
    packages = {
        ".".join(path.parent.relative_to(ROOT).parts)
        for root in ("sequential", "vision3d", "factorlab")
        for path in (ROOT / root).rglob("__init__.py")
    }
    shown = {path.name.removesuffix(".html") for path in (site / "api").glob("*.html")}
    left_out = {name for name in packages - shown if not re.search(r"\.(cli|kernels)\b", name)}
    assert not left_out
    assert set(main.commands) <= {path.stem for path in (site / "commands").glob("*.html")}


def test_every_public_name_is_in_the_reference(pages):
    anchors = {anchor for page in pages.values() if page.path.parent.name == "api" for anchor in page.anchors}
    shown = {anchor.rsplit(".", 1)[-1] for anchor in anchors}
    rooms = [path.stem for path in (page.path for page in pages.values()) if path.parent.name == "api"]
    left_out = set()
    for room in set(rooms) - {"index"}:
        module = importlib.import_module(room)
        things = {name: getattr(module, name) for name in getattr(module, "__all__", ())}
        public = {
            name for name, thing in things.items() if inspect.isclass(thing) or inspect.isroutine(thing)
        }
        left_out |= {f"{room}.{name}" for name in public - shown}
    assert not left_out


def test_nothing_is_loaded_from_elsewhere(site, pages):
    outside = {
        f"{page.path.relative_to(site)}: {address}"
        for page in pages.values()
        for address in page.loads
        if is_elsewhere(address)
    }
    sheets = {
        f"{path.relative_to(site)}: {address}"
        for path in site.rglob("*.css")
        for address in re.findall(r"(?:url\(|@import )[\"']?([^\"')]+)", path.read_text(encoding="utf-8"))
        if is_elsewhere(address)
    }
    assert not outside | sheets


def test_what_pages_load_is_there(pages):
    missing = {
        f"{page.path.name}: {address}"
        for page in pages.values()
        for address in page.loads
        if not is_elsewhere(address) and not address.startswith("data:")
        if page.path.name != SERVED and not landing(page, address)[0].exists()
    }
    assert not missing


def test_every_link_inside_lands(pages):
    lost = set()
    for page in pages.values():
        for link in page.links:
            if is_elsewhere(link) or link.startswith(("mailto:", "data:")) or page.path.name == SERVED:
                continue
            target, anchor = landing(page, link)
            there = pages.get(target)
            if not target.exists() or (anchor and there is not None and anchor not in there.anchors):
                lost.add(f"{page.path.name}: {link}")
    assert not lost


def test_lists_and_tables_are_read_as_such(pages):
    """A list or a table that touches the paragraph before it stays text."""
    text = {
        f"{page.path.name}: {paragraph[:80]!r}"
        for page in pages.values()
        for paragraph in page.paragraphs
        if re.search(r"\n(- |\d+\. |\|)|^\|.*\|$", paragraph)
    }
    assert not text


every_note = pytest.mark.parametrize(
    "note", [pytest.param(path, id=str(path.relative_to(ROOT))) for path in NOTES]
)


@every_note
def test_commands_shown_exist(note):
    lines = command_lines(note.read_text(encoding="utf-8"))
    assert not {line: faults for line in lines if (faults := faults_of(line, main))}


def test_a_command_that_does_not_exist_is_noticed():
    assert faults_of("factorlab compare kitti --no-such", main) == ["compare has no --no-such"]
    assert faults_of("factorlab calibrate gyro|nose LOG", main) == ["gyro|nose is no command"]
    assert faults_of("factorlab calibrate gyro|accel LOG [--verify LOG2] [-o DIR]", main) == []
    assert command_lines("Text\n\n    factorlab info a.csv   # --not\n\nand `factorlab info b`.") == [
        "factorlab info b",
        "factorlab info a.csv",
    ]


@every_note
def test_files_that_are_linked_exist(note):
    missing = [target for target in linked_files(note) if not target.exists()]
    made = [ROOT / "docs" / "api", ROOT / "docs" / "commands"]  # while the site is built, which checks them
    assert not [target for target in missing if target.parent not in made]


def test_pictures_are_shown_and_small():
    shown = {target.name for note in NOTES for target in linked_files(note)}
    pictures = sorted((ROOT / "docs" / "pictures").iterdir())
    assert not [path.name for path in pictures if path.name not in shown]
    assert not {path.name: path.stat().st_size for path in pictures if path.stat().st_size > LARGEST}


@every_note
def test_python_shown_is_python(note):
    for code in python_blocks(note.read_text(encoding="utf-8")):
        ast.parse(code)


def test_the_tour_tells_what_the_comparison_finds():
    from factorlab.compare import compare
    from factorlab.datasets import load

    (kitti,) = load("kitti", use_every=5)
    tour = (ROOT / "docs" / "tour.md").read_text(encoding="utf-8")
    ekf, smoother = compare(kitti, ("ekf", "ekf_rts"), lags=()).rows
    assert f"EKF {ekf.rmse:.2f} m, EKF + RTS {smoother.rmse:.2f} m" in tour
    assert f"mean NIS of gps  {ekf.nis.mean:.1f}" in tour


@pytest.fixture
def window(browser, tmp_path):
    """A browser window."""
    with Chromium(browser, tmp_path / "profile") as opened:
        yield opened


def test_opens_from_the_disk_and_finds(window, site):
    window.call("Emulation.setFocusEmulationEnabled", enabled=True)
    window.visit((site / "index.html").as_uri())
    window.run("document.querySelector('[data-md-component=search-query]').focus()")
    assert window.until("document.querySelector('.md-search-result__meta').innerText.startsWith('Type')")
    window.call("Input.insertText", text="gyro bia")
    for kind in ("keyDown", "keyUp"):
        window.call("Input.dispatchKeyEvent", type=kind, key="s", text="s" if kind == "keyDown" else "")
    assert window.until("document.querySelectorAll('.md-search-result__item').length > 3")
    assert not [line for line in window.console if "error" in line.lower()]
    assert not [address for address in window.asked if is_elsewhere(address)]


def test_formulas_are_drawn(window, site):
    """A fraction is higher than the line that it stands in: nothing had to be fetched to draw it."""
    window.visit((site / "derivations.html").as_uri())
    heights = window.run("[...document.querySelectorAll('mfrac')].map(f => f.getBoundingClientRect().height)")
    line = window.run("document.querySelector('article p').getClientRects()[0].height / 3")
    assert len(heights) > 10
    assert min(heights) > 0
    assert max(heights) > line
    assert "$" not in window.run("document.querySelector('article').innerText")
    assert not [address for address in window.asked if is_elsewhere(address)]


@pytest.mark.parametrize(
    "name", ["index.html", "tour.html", "filter_or_smoother.html", "api/sequential.html"]
)
def test_fits_a_phone(window, site, name):
    window.call("Emulation.setDeviceMetricsOverride", **PHONE)
    window.visit((site / f"{name}.html").as_uri())
    assert window.run("document.documentElement.scrollWidth") <= PHONE["width"]
    assert not window.console
