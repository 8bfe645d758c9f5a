"""What `factorlab compare` prints, writes and returns."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from factorlab.cli import main

ROOT = Path(__file__).resolve().parents[3]
NIS = {"mean", "median", "expected", "band95", "inside", "kind"}
HONESTY = {"mean", "median", "expected", "band95", "bootstrap_band95", "tail_share"}


def run(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def own(files, *options, model="MODEL"):
    return run("compare", files / "walk.csv", "--model", f"{files / 'walker.py'}:{model}", *options)


@pytest.mark.parametrize("command", [(), ("compare",), ("demo",), ("info",), ("doctor",)])
def test_help_says_how(command):
    done = run(*command, "--help")
    assert done.exit_code == 0
    assert "Usage: main" in done.stdout or "Usage: factorlab" in done.stdout


def test_the_document_has_the_agreed_keys(files):
    done = own(files, "--truth", files / "truth.tum", "--estimators", "ekf,ekf_rts", "--json")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert {"schema", "dataset", "estimators", "findings", "versions", "command"} <= set(whole)
    assert "untuned" not in whole
    for name, kind in (("ekf", "filter"), ("ekf_rts", "leave-one-out")):
        row = whole["estimators"][name]
        assert row["held_out_rmse_m"] is None
        assert 0.05 < row["rmse_m"] < 0.3
        assert set(row["nis"]) >= NIS
        assert row["nis"]["kind"] == kind
        assert set(row["normalised_error"]) >= HONESTY
        assert row["us_per_measurement"] == pytest.approx(1e6 * row["seconds"] / whole["readings"])
        assert set(row["nis"]["sensors"]) == {"gps", "tag"}


def test_stdout_holds_the_document_and_nothing_else(files):
    done = own(files, "--json", "-o", files / "out")
    json.loads(done.stdout)
    assert "report.html" in done.stderr


def test_tuning_shows_before_and_after(files):
    done = own(
        files, "--truth", files / "truth.tum", "--estimators", "ekf,ieks", "--tune", "--json", model="timid"
    )
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert set(whole["untuned"]) == set(whole["estimators"]) == {"ekf", "ieks"}
    assert whole["tuning"]["values"]["gps σ"] == pytest.approx(10.0, rel=0.3)
    assert whole["untuned"]["ekf"]["nis"]["mean"] > 1.5 * whole["estimators"]["ekf"]["nis"]["mean"]


def test_held_out_readings_score_where_there_is_no_truth(files):
    whole = json.loads(own(files, "--use-every", 2, "--estimators", "ekf,ieks", "--json").stdout)
    for row in whole["estimators"].values():
        assert 0.1 < row["held_out_rmse_m"] < 0.6
        assert row["normalised_error"]["against"] == "held-out"


def test_the_table_is_readable(files):
    done = own(files, "--estimators", "ekf,ieks")
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    verdict = next(k for k, line in enumerate(lines) if line.startswith(("PASS", "WARN", "FAIL")))
    table = next(k for k, line in enumerate(lines) if line.startswith("estimator"))
    assert verdict < table, "the verdict comes first"
    assert max(map(len, lines)) <= 130
    assert "\x1b" not in done.stdout


def test_check_fails_on_a_bad_verdict_only(files):
    assert own(files, "--check", "--estimators", "ekf").exit_code == 0
    assert own(files, "--estimators", "ekf", model="timid").exit_code == 0
    assert own(files, "--check", "--estimators", "ekf", model="timid").exit_code == 3


def test_one_failure_is_a_row_and_all_failures_an_error(files):
    # isam2 has no native factor for this state
    mixed = own(files, "--estimators", "ekf,isam2", "--json")
    assert mixed.exit_code == 0
    row = json.loads(mixed.stdout)["estimators"]["isam2"]
    assert row["nis"] is None
    assert row["message"]
    alone = own(files, "--estimators", "isam2")
    assert alone.exit_code == 1
    assert alone.stderr.startswith("error: ")


def test_options_come_from_a_file_and_the_command_line_wins(files):
    config = files / "run.toml"
    config.write_text('estimators = ["ekf", "ieks"]\nuse-every = 3\njson = true\n', encoding="utf-8")
    whole = json.loads(own(files, "--config", config).stdout)
    assert set(whole["estimators"]) == {"ekf", "ieks"}
    whole = json.loads(own(files, "--config", config, "--estimators", "ekf").stdout)
    assert set(whole["estimators"]) == {"ekf"}


def test_it_runs_as_a_module(files):
    command = "-m factorlab compare walk.csv --model walker.py:MODEL --estimators ekf"
    done = subprocess.run(
        [sys.executable, *command.split()],
        cwd=files,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "EKF" in done.stdout
    assert not done.stderr
