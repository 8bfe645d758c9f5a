"""`factorlab calibrate mag|range|ferraris` as a user runs them."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from sequential.sensors import ImuCalibration


def run(*arguments):
    return CliRunner().invoke(main, ["calibrate", *map(str, arguments)])


@pytest.fixture
def turns(tmp_path, rng):
    """A magnetometer turned in every direction, as a CSV file in µT."""
    t = np.arange(4000) * 0.02
    z = np.sin(0.11 * t + 0.3 * np.sin(0.02 * t))
    r = np.sqrt(1 - z**2)
    field = 45.0 * np.stack([r * np.cos(1.7 * t), r * np.sin(1.7 * t), z], axis=1)
    raw = field * [1.1, 0.9, 1.0] + [12.0, -20.0, 5.0] + 0.4 * rng.standard_normal(field.shape)
    return written(tmp_path / "turns.csv", t, raw)


def written(path, t, mag):
    lines = [f"{a:.4f},{x:.3f},{y:.3f},{z:.3f}" for a, (x, y, z) in zip(t, mag, strict=True)]
    path.write_text("\n".join(["t,mx,my,mz", *lines]) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def table(tmp_path, rng):
    d = np.repeat([3.0, 5, 7, 8, 10, 12, 15, 18, 20, 25, 30, 40, 50, 60, 80], 2)
    v = np.where(d >= 7, 28.0 / (d + 0.5) + 0.1, 0.55 * d) + 0.01 * rng.standard_normal(len(d))
    path = tmp_path / "ir.csv"
    rows = "\n".join(f"{a},{b:.4f}" for a, b in zip(d, v, strict=True))
    path.write_text(f"distance_cm,voltage_V\n{rows}\n", encoding="utf-8")
    return path


def test_mag_writes_constants_that_can_be_used(turns, tmp_path):
    out = tmp_path / "out"
    done = run("mag", turns, "--units", "mag=uT", "--field", "45", "--verify", turns, "-o", out)
    assert done.exit_code == 0, done.output
    assert "PASS" in done.output
    assert {path.name for path in out.iterdir()} == {
        "report.html", "report.json", "calibration.json", "calibration.h"
    }  # fmt: skip
    found = ImuCalibration.load(out / "calibration.json").mag
    np.testing.assert_allclose(found.offset, [12, -20, 5], atol=0.3)
    np.testing.assert_allclose(np.diag(found.matrix), [1 / 1.1, 1 / 0.9, 1.0], rtol=0.01)
    assert "mag" in (out / "calibration.h").read_text()
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") >= 3
    numbers = json.loads((out / "report.json").read_text())
    assert numbers["before_after"]["spread"] < 0.01 < numbers["before_after"]["spread_raw"]
    assert numbers["verification"]["spread"] == numbers["before_after"]["spread"]


def test_json_is_one_document(turns, table):
    for command, key in ((("mag", turns, "--units", "mag=uT"), "radii"), (("range", table), "useful_range")):
        done = run(*command, "--json")
        assert done.exit_code == 0, done.output
        assert key in json.loads(done.stdout)


def test_range_finds_curve_fold_and_useful_range(table, tmp_path):
    out = tmp_path / "out"
    apart = tmp_path / "range.h"
    done = run("range", table, "--limit", "0.5", "--verify", table, "-o", out, "--json", "--c-header", apart)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    constants = found["constants"]
    np.testing.assert_allclose([constants["a"], constants["b"], constants["c"]], [28, 0.5, 0.1], atol=0.5)
    assert (constants["distance_unit"], constants["reading_unit"]) == ("cm", "V")
    assert found["folded_below"] == 7
    assert 30 < found["useful_range"][1] < 50
    assert found["verification"]["rms"] < 2 * found["verification"]["expected"]
    header = (out / "calibration.h").read_text()
    assert "static const float range_a" in header
    assert apart.read_text() == header
    assert json.loads((out / "calibration.json").read_text())["model"] == "v = a / (d + b) + c"


MAG = "t,mx,my,mz\n"


@pytest.mark.parametrize(
    ("name", "text", "arguments", "sentence"),
    [
        ("const.csv", MAG + "".join(f"{k / 50},10,20,30\n" for k in range(500)), ("mag",), "constant"),
        ("short.csv", MAG + "".join(f"{k},{k},{k * k},3{k}\n" for k in range(9)), ("mag",), "50 at"),
        ("text.csv", "t,mx,my,mz\n0,1,2,3\n1,one,2,3\n2,1,2,3\n", ("mag",), "'one' is not a number"),
        ("range.csv", "distance,voltage\n10,2\n20,low\n", ("range",), "'low' is not a number"),
        ("few.csv", "distance,voltage\n10,2\n20,1\n", ("range",), "5 different distances"),
        ("still.csv", "t,ax,ay,az,gx,gy,gz\n" + "".join(f"{k / 50},0.01,{k % 3 / 99},9.8,0,0.0{k % 7},0\n"
                                                        for k in range(500)), ("ferraris",), "still part"),
    ],
)  # fmt: skip
def test_bad_files_end_in_one_sentence(tmp_path, name, text, arguments, sentence):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    done = run(*arguments, path)
    assert done.exit_code == 1
    errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert sentence in errors[0]


def test_usage_is_told(turns, table):
    assert run("mag", turns, "--field", "-3").exit_code == 2
    assert run("ferraris", turns, "--turn", "0").exit_code == 2
    assert run("range", table, "--rate", "9").exit_code == 2


def test_an_earlier_report_is_kept(table, tmp_path):
    out = tmp_path / "out"
    assert run("range", table, "-o", out).exit_code == 0
    assert run("range", table, "-o", out).exit_code == 1
    assert run("range", table, "-o", out, "--force").exit_code == 0


def test_check_fails_where_no_distance_is_good_enough(table):
    assert run("range", table, "--limit", "1e-9", "--check").exit_code == 3
    assert run("range", table, "--limit", "0.5", "--check").exit_code == 0


def test_ferraris_on_the_labelled_session(data_dir, tmp_path):
    folder = data_dir / "imu" / "imucal"
    out = tmp_path / "out"
    done = run(
        "ferraris", folder / "annotated_session.csv", "--rate", "204.8",
        "--units", "accel=counts,gyro=counts", "--gravity", "9.81", "-o", out, "--json",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    expected = json.loads((folder / "example_cal.json").read_text())
    found = json.loads(done.stdout)["imucal"]
    for name in ("K_a", "R_a", "b_a", "K_g", "R_g", "K_ga", "b_g"):
        np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=1e-6)
    saved = ImuCalibration.load(out / "calibration.json")
    np.testing.assert_allclose(saved.g_sensitivity, expected["K_ga"], atol=1e-6)
    assert "opposite sign" in json.dumps(json.loads(done.stdout)["verdicts"])


def test_ferraris_takes_sections_from_a_file(data_dir):
    folder = data_dir / "imu" / "imucal"
    session = (
        folder / "example_ferraris_session.csv",
        "--rate",
        "102.4",
        "--units",
        "accel=m/s^2,gyro=deg/s",
    )
    given = run(
        "ferraris", *session, "--sections", folder / "example_ferraris_session_list.json",
        "--verify", session[0], "--json",
    )  # fmt: skip
    assert given.exit_code == 0, given.output
    numbers = json.loads(given.stdout)
    assert numbers["sections"]["x_rot"] == [6770, 7093]
    assert numbers["verification"]["rms"] < 0.1
