"""`factorlab characterize` beyond one IMU file: columns of any table, steps, phones, and the page in French."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main


def run(*arguments):
    return CliRunner().invoke(main, ["characterize", *map(str, arguments)])


def whole(*arguments):
    done = run(*arguments, "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def table(tmp_path, rng):
    """A thermometer with a semicolon and a decimal comma, and what it says."""
    t = np.arange(1500) * 0.5
    heat = np.round((21.0 + 0.2 * rng.standard_normal(1500)) / 0.0625) * 0.0625
    lines = [
        "temps (s);temperature;boite",
        *(f"{a:.2f};{b:.4f};{20 + a / 300:.3f}" for a, b in zip(t, heat, strict=True)),
    ]
    (tmp_path / "heat.csv").write_text("\n".join(lines).replace(".", ","), encoding="utf-8")
    return tmp_path / "heat.csv"


def test_a_step(tmp_path, rng):
    t = np.arange(600) * 0.01
    x = 20 + 30 * -np.expm1(-np.maximum(t - 2.035, 0.0) / 0.12) + 0.2 * rng.standard_normal(600)
    np.savetxt(tmp_path / "step.csv", np.column_stack([t, x]), delimiter=",", header="t,range", comments="")
    found = whole(tmp_path / "step.csv", "--column", "range=cm", "--step", "--step-at", 2)["steps"]["range"]
    assert found["latency"]["low"] < 0.035 < found["latency"]["high"]
    assert found["time_constant"]["low"] < 0.12 < found["time_constant"]["high"]
    done = run(tmp_path / "step.csv", "--column", "range=cm", "--step", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "out/report.html").read_text(encoding="utf-8").count("<svg") == 1
