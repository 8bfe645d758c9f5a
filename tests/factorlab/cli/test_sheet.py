"""`factorlab sheet`: files, documents, and sentences for what cannot be printed."""

import json

import pytest
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.cli.calibrate_camera import camera


def run(*arguments):
    return CliRunner().invoke(main, ["sheet", *map(str, arguments)])


@pytest.mark.parametrize(
    ("arguments", "title"),
    [
        (("checkerboard", "--board", "8x5", "--square", "30mm"), "8x5 checkerboard, 30 mm squares"),
        (("checkerboard",), "9x6 checkerboard, 26 mm squares"),
        (("charuco", "--board", "5x7", "--square", "30mm", "--marker", "22mm"), "5x7 ChArUco board"),
        (("circles", "--board", "4x11", "--square", "20mm", "--asymmetric"), "4x11 asymmetric circle grid"),
        (("markers", "--ids", "0-3,7", "--size", "60mm"), "5 markers of 4x4_50, 60 mm wide"),
        (("markers", "--board", "3x4", "--size", "4cm"), "board of 12 markers of 4x4_50, 40 mm wide"),
        (("apriltags", "--family", "25h9"), "6 markers of apriltag_25h9"),
    ],
)
@pytest.mark.parametrize("kind", ["pdf", "svg"])
def test_sheets_are_written(tmp_path, arguments, title, kind):
    out = tmp_path / f"sheet.{kind}"
    result = run(*arguments, "-o", out, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.output)
    assert told["title"].startswith(title)
    assert told["files"] == [str(out)]
    assert out.read_bytes().startswith(b"%PDF-" if kind == "pdf" else b"<svg")


def test_the_command_on_the_sheet_is_a_command(tmp_path):
    result = run("charuco", "-o", tmp_path / "a.pdf", "--json")
    command = json.loads(result.output)["command"].split()
    wanted = ["--kind", "charuco", "--board", "--square", "--marker", "--dictionary"]
    assert all(word in command for word in wanted)
    options = {flag for one in camera.params for flag in one.opts}
    assert {word for word in command if word.startswith("--")} <= options


def test_many_markers_are_many_svgs_and_one_pdf(tmp_path):
    assert run("markers", "--ids", "0-40", "-o", tmp_path / "m.svg").exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"m-{k}.svg" for k in (1, 2, 3, 4)]
    result = run("markers", "--ids", "0-40", "-o", tmp_path / "m.pdf", "--json")
    assert json.loads(result.output)["pages"] == 4


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("checkerboard", "--square", "40mm", "-o", "z.pdf"), 2, "squares of 26 mm would fit, or take a2"),
        (("checkerboard", "--board", "9by6", "-o", "z.pdf"), 2, "such as 9x6; got '9by6'"),
        (("checkerboard", "--paper", "b5", "-o", "z.pdf"), 2, "no paper 'b5'"),
        (("checkerboard", "-o", "z.png"), 2, "neither .pdf nor .svg"),
        (("markers", "--ids", "99", "-o", "z.pdf"), 2, "has the markers 0 to 49"),
        (("markers", "--ids", "a-b", "-o", "z.pdf"), 2, "such as 0-11 or 3,7,12"),
        (("charuco", "--marker", "50mm", "--square", "30mm", "-o", "z.pdf"), 2, "does not fit into a square"),
        (("checkerboard", "-o", "nowhere/z.pdf"), 1, "there is no folder nowhere"),
    ],
)
def test_what_cannot_be_printed_is_a_sentence(arguments, code, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == code
    assert said in result.stderr


def test_an_earlier_sheet_is_kept_unless_forced(tmp_path):
    out = tmp_path / "a.pdf"
    assert run("checkerboard", "-o", out).exit_code == 0
    again = run("checkerboard", "-o", out)
    assert (again.exit_code, "--force" in again.stderr) == (1, True)
    assert run("checkerboard", "-o", out, "--force").exit_code == 0
