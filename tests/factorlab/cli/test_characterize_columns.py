"""`factorlab characterize` beyond one IMU file: any column, steps, phones; the page in French."""

import json
import re

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


def test_french_has_no_english_in_it(table, tmp_path):
    done = run(
        table, "--column", "temperature=°C", "--temperature", "boite", "--sigma", "0.05", "--lang", "fr",
        "-o", tmp_path / "out",
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    assert re.search(r"votre R est 1[67] fois trop petit", done.stdout)
    assert re.search(r"R = σ² = 0,0\d+, soit σ = 0,\d+ °C", done.stdout)
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert '<html lang="fr">' in page
    body = re.sub(
        r"<svg.*?</svg>|<[^>]*>", " ", page[: page.index("<footer>")].split("</style>")[1], flags=re.DOTALL
    )
    assert not re.findall(r"\b(?:the|of|and|is|are|reading|readings|noise|than|what)\b", body)
    figures = " ".join(re.findall(r"<text[^>]*>(.*?)</text>", page))
    assert not re.findall(r"\b(?:the|of|time|frequency|density|mean)\b", figures)
    assert re.search(r"\d,\d", figures)
    assert not re.search(r"\d\.\d", body)


def test_any_column_of_any_sensor(table):
    found = whole(table, "--column", "temperature=°C", "--temperature", "boite")
    axis = found["axes"]["temperature"]
    assert axis["unit"] == "°C"
    assert axis["lsb"] == pytest.approx(0.0625, rel=1e-3)
    assert axis["sigma"]["low"] < (0.2**2 + 0.0625**2 / 12) ** 0.5 < axis["sigma"]["high"]
    assert axis["per_degree"]["low"] < 0.0 < axis["per_degree"]["high"]
    assert found["timing"]["rate"] == pytest.approx(2.0)
    assert found["imu_noise"] is None


def test_a_column_without_stamps_needs_its_rate(tmp_path, rng):
    np.savetxt(tmp_path / "v.csv", rng.standard_normal((500, 1)), header="volts", comments="")
    done = run(tmp_path / "v.csv", "--column", "volts=V")
    assert done.exit_code == 1
    assert "--rate HZ" in done.stderr
    assert whole(tmp_path / "v.csv", "--column", "volts=V", "--rate", 10)["duration"] == pytest.approx(49.9)


def test_the_sensors_of_a_phone_are_read_with_their_own_samples(tmp_path, rng):
    """Brought to common stamps, the accelerometer would lose a quarter of its noise."""
    t = np.cumsum(0.01 + 1e-4 * rng.standard_normal(6000))
    level = np.array([0.1, 0.2, 9.79])
    for name, stem, unit, at, values in (
        ("Accelerometer", "Acceleration", "m/s^2", t, level + 0.01 * rng.standard_normal((6000, 3))),
        ("Gyroscope", "Gyroscope", "rad/s", t + 0.005, 0.002 * rng.standard_normal((6000, 3))),
    ):
        head = ",".join(['"Time (s)"', *(f'"{stem} {axis} ({unit})"' for axis in "xyz")])
        table = np.column_stack([at, values])
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9E")
    found = whole(tmp_path)
    for name, sigma in (("ax", 0.01), ("az", 0.01), ("gx", 0.002)):
        assert found["axes"][name]["sigma"]["value"] == pytest.approx(sigma, rel=0.04)
    assert found["imu_noise"]["accel_density"] == pytest.approx(1e-3, rel=0.05)
    assert found["axes"]["ay"]["allan"]["N"]["value"] == pytest.approx(1e-3, rel=0.05)
    assert not any("interpolated" in one["what"] for one in found["findings"])
