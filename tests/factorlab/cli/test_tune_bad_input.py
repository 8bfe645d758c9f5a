"""Bad input to `factorlab tune`: one sentence on stderr, the right exit code, no traceback."""

import re

import pytest
from click.testing import CliRunner

from factorlab.cli import main

GUARDED = """
def guarded():
    sensor = sq.Position(0.04, axes=2, loss=sq.Loss("huber", 1.345))
    return sq.StateSpace(
        sq.Vector(4), sq.Gaussian([0.0] * 4, [1.0] * 4), sq.ConstantVelocity(0.04, axes=2), {"gps": sensor}
    )
"""


def run(*arguments):
    return CliRunner().invoke(main, ["tune", *map(str, arguments)])


OWN = ("{files}/walk.csv", "--model")


@pytest.mark.parametrize(
    ("arguments", "code", "pattern"),
    [
        (["{files}/walk.csv"], 2, "needs a model.*--method still"),
        (["kity"], 1, "did you mean 'kitti'"),
        (["kitti", "--method", "still"], 2, "kitti moves"),
        (["kitti", "--model", "x.py:M"], 2, "log of your own"),
        (["kitti", "--method", "magic"], 2, "'magic' is not one of"),
        (["kitti", "--method", "em", "--knob", "gps_sigma"], 2, "--knob goes with --method ml or nis"),
        (["kitti", "--method", "nis", "--profile"], 2, "--profile goes with --method ml"),
        (["kitti", "--stream", "gps"], 2, "--stream goes with --method still"),
        (["kitti", "--lsb", "1"], 2, "--lsb goes with --method still"),
        ([*OWN, "{files}/walker.py:MODEL", "--knob", "gps"], 2, "did you mean 'gps σ'"),
        ([*OWN, "{files}/walker.py:MODEL", "--knob", "gps σ=x"], 2, "is not NAME=VALUE"),
        ([*OWN, "{files}/walker.py:MODEL", "--knob", "gps σ=-1"], 1, "must be positive"),
        ([*OWN, "{files}/walker.py:MODEL", "--robot", "1"], 2, "--robot"),
        ([*OWN, "{files}/walker.py:needs"], 1, "is a function; a StateSpace"),
        ([*OWN, "{files}/walker.py:guarded", "--method", "em"], 1, "'gps' has a loss.*tune"),
        ([*OWN, "{files}/walker.py:MODEL", "--method", "still", "--stream", "gsp"], 1, "no stream 'gsp'"),
        (["{files}/no.csv", "--method", "still"], 1, "neither a dataset nor a file"),
        (["{files}/walk.csv", "--method", "still", "--stream", "tag", "--lsb", "0"], 2, "--lsb"),
    ],
)
def test_a_bad_command_line_is_one_sentence(files, arguments, code, pattern):
    text = (files / "walker.py").read_text(encoding="utf-8")
    (files / "walker.py").write_text(text + GUARDED, encoding="utf-8")
    done = run(*(a.format(files=files) for a in arguments))
    assert done.exit_code == code, (done.stdout, done.stderr)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert re.search(pattern, done.stderr), done.stderr
    if code == 1:
        assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("knobs", "pattern"),
    [
        ("KNOBS = 3", "KNOBS is a mapping from names to values"),
        ('KNOBS = {"sigma": "much"}', "KNOBS gives each name a positive number"),
        ('KNOBS = {"sigma": -1.0}', "must be positive"),
        ("KNOBS = []", "KNOBS is a mapping from names to values"),
    ],
)
def test_bad_knobs_are_one_sentence(files, knobs, pattern):
    (files / "own.py").write_text(
        f"from walker import model\n{knobs}\ndef build(values):\n    return model(sigma=values['sigma'])\n",
        encoding="utf-8",
    )
    done = run(files / "walk.csv", "--model", f"{files / 'own.py'}:build")
    assert done.exit_code == 1
    assert re.search(pattern, done.stderr), done.stderr
