"""Bad input: one sentence on stderr, the right exit code, nothing half-written, no traceback."""

import re

import numpy as np
import pytest
from click.testing import CliRunner

import sequential as sq
from factorlab.cli import main
from sequential.readers import read_log

STATE = """
import numpy as np
import sequential as sq
def build(**changes):
    given = dict(
        manifold=sq.Vector(4),
        prior=sq.Gaussian([0.0] * 4, [1.0] * 4),
        process=sq.ConstantVelocity(0.04, axes=2),
        sensors={"gps": sq.Position(0.04, axes=2)},
    )
    return sq.StateSpace(**(given | changes))
"""

MODELS = {
    "indefinite": "MODEL = build(prior=sq.Gaussian([0.0] * 4, np.diag([1.0, 1.0, 1.0, -1.0])))",
    "other_stream": 'MODEL = build(sensors={"gsp": sq.Position(0.04, axes=2)})',
    "other_width": 'MODEL = build(sensors={"gps": sq.LinearSensor([[1.0, 0.0, 0.0, 0.0]], 0.04)})',
    "curved": 'MODEL = build(sensors={"gps": sq.Sensor(observe=lambda x: x[:2], noise_cov=[0.04, 0.04])})',
    "broken": 'MODEL = build(sensors={"gps": 1 / 0})',
    "misspelt": "MODEL = build(",
    "something_else": "MODEL = 3",
    "driven": 'MODEL = build(process=sq.Process(lambda x, u, dt: x, 0.1, inputs=2), input="tag")',
}


OWN = ("{files}/walk.csv", "--model", "{files}/walker.py:MODEL")


def run(*arguments):
    return CliRunner().invoke(main, ["compare", *map(str, arguments)])


def assert_one_sentence(done, code, pattern):
    __tracebackhide__ = True
    assert done.exit_code == code, (done.stdout, done.stderr)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert re.search(pattern, done.stderr), done.stderr
    if code == 1:
        assert done.stderr.startswith("error: ")
        assert len(done.stderr.strip().splitlines()) == 1


@pytest.fixture
def spoiled(files):
    """Run on the log after a change of its text, and look that nothing was written."""

    def spoil(change, *options):
        path = files / "walk.csv"
        path.write_text(
            "\n".join(change(path.read_text(encoding="utf-8").splitlines())) + "\n", encoding="utf-8"
        )
        before = {p.name for p in files.iterdir()}
        done = run(path, "--model", f"{files / 'walker.py'}:MODEL", "-o", files / "out", *options)
        assert {p.name for p in files.iterdir()} - {"__pycache__"} == before - {"__pycache__"}
        return done

    return spoil


def edited(row, old, new):
    """A change of one line, counted from the header."""

    def change(lines):
        assert re.search(old, lines[row])
        return [*lines[:row], re.sub(old, new, lines[row], count=1), *lines[row + 1 :]]

    return change


@pytest.mark.parametrize(
    ("change", "pattern"),
    [
        (edited(5, r",gps,[^,]+", ",gps,inf"), "line 6"),
        (edited(5, r",gps,[^,]+", ",gps,north"), "line 6.*not a number"),
        (edited(5, r"$", ",7,8,9"), "line 6"),
        (lambda lines: [*lines[:9], lines[4], *lines[9:]], "backwards|before|repeat|twice"),
        (lambda lines: [*lines[:5], *lines[4:]], "repeat|twice"),
        (lambda lines: lines[:1], "no reading|holds|empty|stream"),
        (lambda lines: [line for line in lines if ",gps," not in line], "gps"),
        (lambda lines: lines[1:], "header|first row"),
        (lambda lines: lines[:0], "empty"),
    ],
)
def test_a_bad_log(spoiled, change, pattern):
    assert_one_sentence(spoiled(change), 1, pattern)


def test_a_gap_in_the_input(files):
    log = read_log(files / "walk.csv")
    rows = np.flatnonzero((log["tag"].t < 5e9) | (log["tag"].t > 20e9))
    sq.readers.write_log(files / "walk.csv", log.replaced(tag=log["tag"].select(rows)))
    declared = files / "own.py"
    declared.write_text(f"{STATE}\n{MODELS['driven']}\n", encoding="utf-8")
    done = run(files / "walk.csv", "--model", f"{declared}:MODEL", "--max-gap", 2)
    assert_one_sentence(done, 1, r"pauses for 1\d\.\d+ s.*max_gap")


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        ("indefinite", "own.py, line 13 raised NotPositiveDefiniteError"),
        ("other_stream", "'gsp'.*did you mean 'gps'"),
        ("other_width", "2 columns.* 1"),
        ("broken", "own.py, line 13 raised ZeroDivisionError"),
        ("misspelt", "own.py, line 13 raised SyntaxError"),
        ("something_else", "MODEL is a int; a StateSpace"),
    ],
)
def test_a_bad_model(files, name, pattern):
    declared = files / "own.py"
    declared.write_text(f"{STATE}\n{MODELS[name]}\n", encoding="utf-8")
    assert_one_sentence(run(files / "walk.csv", "--model", f"{declared}:MODEL"), 1, pattern)


def test_a_kalman_filter_refuses_a_curved_model(files):
    declared = files / "own.py"
    declared.write_text(f"{STATE}\n{MODELS['curved']}\n", encoding="utf-8")
    done = run(files / "walk.csv", "--model", f"{declared}:MODEL", "--estimators", "kf")
    assert_one_sentence(done, 1, "linear models only.*ExtendedKalmanFilter")


@pytest.mark.parametrize(
    ("arguments", "code", "pattern"),
    [
        (["kity"], 1, "did you mean 'kitti'"),
        (["nowhere.csv"], 1, "neither a dataset nor a file"),
        (["{files}/wlak.csv", "--model", "{files}/walker.py:MODEL"], 1, "did you mean '.*walk.csv'"),
        (["{files}"], 1, "is a folder"),
        (["{files}/walk.csv"], 2, "needs a model"),
        (["{files}/walk.csv", "--model", "{files}/walker.py"], 1, "FILE.py:NAME"),
        (["{files}/walk.csv", "--model", "{files}/walkr.py:MODEL"], 1, "no file.*did you mean .*walker.py"),
        (["{files}/walk.csv", "--model", "{files}/walker.py:MODL"], 1, "did you mean 'MODEL'"),
        (["{files}/walk.csv", "--model", "{files}/walker.py:ANSWER"], 1, "is a int; a StateSpace"),
        (["{files}/walk.csv", "--model", "{files}/walker.py:needs"], 1, "is a function; a StateSpace"),
        (
            ["{files}/walk.csv", "--model", "{files}/walker.py:MODEL", "--truth", "{files}/no.tum"],
            1,
            "no file",
        ),
        ([*OWN, "--truth", "{files}/walk.csv"], 1, "TUM"),
        ([*OWN, "--use-every", "999"], 1, "none to use"),
        ([*OWN, "--robot", "1"], 2, "--robot"),
        (["kitti", "--estimators", "ekf,bach"], 2, "did you mean 'batch'"),
        (["kitti", "--estimators", ","], 2, "needs an estimator"),
        (["kitti", "--use-every", "0"], 2, "--use-every"),
        (["kitti", "--model", "x.py:M"], 2, "log of your own"),
        (["kitti", "--config", "{files}/no.toml"], 2, "no.toml"),
        (["kitti", "--config", "{files}/walker.py"], 2, "not TOML"),
        (["kitti", "--colour", "red"], 2, "No such option"),
        ([], 2, "Missing argument"),
    ],
)
def test_a_bad_command_line(files, arguments, code, pattern):
    assert_one_sentence(run(*(a.format(files=files) for a in arguments)), code, pattern)


def test_a_misspelt_key_of_a_config_file(files):
    (files / "run.toml").write_text("use_evry = 5\n", encoding="utf-8")
    done = run("kitti", "--config", files / "run.toml")
    assert_one_sentence(done, 2, "unknown key 'use_evry'; did you mean 'use_every'")


def test_a_folder_that_holds_something_is_left_alone(files):
    out = files / "out"
    out.mkdir()
    (out / "precious.txt").write_text("mine", encoding="utf-8")
    arguments = (
        files / "walk.csv",
        "--model",
        f"{files / 'walker.py'}:MODEL",
        "--estimators",
        "ekf",
        "-o",
        out,
    )
    assert_one_sentence(run(*arguments), 1, "--force")
    assert [p.name for p in out.iterdir()] == ["precious.txt"]
    assert run(*arguments, "--force").exit_code == 0
    assert (out / "precious.txt").read_text(encoding="utf-8") == "mine"
    assert (out / "report.html").is_file()
    assert not [p for p in files.iterdir() if p.name.startswith(".out")]


def test_the_unexpected_is_told_in_one_line_too(files, monkeypatch):
    def fail(*_, **__):
        raise RuntimeError("the sky\nfell")

    monkeypatch.setattr("factorlab.compare.engine.prepare", fail)
    arguments = [a.format(files=files) for a in OWN]
    assert_one_sentence(run(*arguments), 1, "unexpected RuntimeError: the sky fell; --debug")
    shown = run(*arguments, "--debug")
    assert isinstance(shown.exception, RuntimeError)


def test_an_interrupt_ends_quietly(files, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("factorlab.compare.engine.prepare", interrupt)
    done = run(files / "walk.csv", "--model", f"{files / 'walker.py'}:MODEL")
    assert done.exit_code == 130
