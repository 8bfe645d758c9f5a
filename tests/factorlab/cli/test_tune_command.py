"""What `factorlab tune` prints, writes and returns, for files as a user has them."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

import sequential as sq
from factorlab.cli import main
from factorlab.cli.tune import METHODS
from factorlab.tuning import METHODS as KNOWN
from sequential.readers import write_log

EXTRA = """
KNOBS = {"sigma": 0.3, "acceleration": 0.01}

def from_values(values):
    return model(values["acceleration"], values["sigma"])

def with_more(acceleration=0.04, sigma=0.2, spread=0.5, name="walker", axes=2):
    return sq.StateSpace(
        manifold=sq.Vector(2 * axes),
        prior=sq.Gaussian([0.0, 0.0, 1.0, 0.0], [spread**2] * 4),
        process=sq.ConstantVelocity(acceleration, axes=axes),
        sensors={"gps": sq.Position(sigma**2, axes=axes)},
    )

def nothing_else(scale=2.0):
    return sq.StateSpace(
        sq.Vector(4), sq.Gaussian([0.0] * 4, [1.0] * 4), sq.ConstantVelocity(0.04, axes=2),
        {"gps": sq.LinearSensor([[scale, 0, 0, 0], [0, scale, 0, 0]], [0.04, 0.04])},
    )
"""


def run(*arguments):
    return CliRunner().invoke(main, ["tune", *map(str, arguments)])


@pytest.fixture
def own(files):
    """Tune the walk of the fixture `files` with one of its models."""
    with (files / "walker.py").open("a", encoding="utf-8") as file:
        file.write(EXTRA)

    def tune(*options, model="MODEL"):
        return run(files / "walk.csv", "--model", f"{files / 'walker.py'}:{model}", *options)

    return tune


@pytest.fixture
def still(tmp_path, rng):
    """A log of a gyro at rest, and of a converter that moved for a while."""
    t = np.arange(1500) * 0.01
    adc = np.round(300 + 2.0 * rng.standard_normal(1500))
    adc[700:900] += np.round(200 * np.sin(np.arange(200) * 0.05))
    gyro = rng.standard_normal((1500, 3)) * [0.01, 0.02, 0.03]
    write_log(tmp_path / "still.csv", sq.SensorLog({"gyro": sq.Stream(t, gyro), "adc": sq.Stream(t, adc)}))
    return tmp_path / "still.csv"


def test_the_command_knows_the_methods():
    assert METHODS == KNOWN
    done = run("--help")
    assert done.exit_code == 0
    for word in (*METHODS, "--model", "--knob", "--check", "--json", "--force"):
        assert word in done.stdout


@pytest.mark.parametrize(
    ("model", "knobs"),
    [
        ("MODEL", {"process σ", "gps σ", "tag σ"}),
        ("timid", {"process σ", "gps σ", "tag σ"}),
        ("model", {"acceleration", "sigma"}),
        ("from_values", {"sigma", "acceleration"}),
        ("with_more", {"acceleration", "sigma"}),
    ],
)
def test_a_file_shows_its_knobs(own, model, knobs):
    """A model alone: factors.  A function: its arguments that are noise and nothing else.  KNOBS: those."""
    done = own("--json", model=model)
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert set(whole["knobs"]) == knobs
    for knob in whole["knobs"].values():
        low, high = knob["interval95"]
        assert low < knob["after"] < high
        assert knob["identified"]
        assert knob["factor"] == pytest.approx(knob["after"] / knob["before"])
    assert whole["after"]["consistent"]
    assert whole["log_likelihood_after"] >= whole["log_likelihood_before"] - 1.0
    sigma = {"MODEL": 0.2, "timid": 0.02}.get(model, 1.0) * whole["knobs"].get("gps σ", {}).get("after", 0.0)
    sigma = sigma or whole["knobs"]["sigma"]["after"]
    assert sigma == pytest.approx(0.2, rel=0.25)


def test_a_function_whose_numbers_are_no_noise_gets_factors(own):
    whole = json.loads(own("--json", model="nothing_else").stdout)
    assert set(whole["knobs"]) == {"process σ", "gps σ"}


@pytest.mark.parametrize("method", ["ml", "nis", "em"])
def test_a_timid_model_becomes_honest(own, method):
    """σ of the gps is declared ten times too small; the NIS can only turn the process noise."""
    options = ("--method", method, "--json", "--check")
    done = own(*options, model="timid")
    whole = json.loads(done.stdout)
    assert whole["method"] == method
    assert not whole["before"]["consistent"]
    assert whole["before"]["sensors"]["gps"]["verdict"] == "overconfident"
    if method == "nis":
        assert set(whole["knobs"]) == {"process σ", "gps σ", "tag σ"}
        assert whole["knobs"]["gps σ"]["factor"] == 1.0
        assert whole["knobs"]["process σ"]["factor"] > 3.0
        assert any("held" in note for note in whole["notes"])
        return
    assert done.exit_code == 0, done.stderr
    assert whole["after"]["consistent"]
    assert any(line.startswith("sensors['gps']: noise_cov = ") for line in whole["write"])
    if method == "em":
        assert whole["knobs"]["gps x0 σ"]["after"] == pytest.approx(0.2, rel=0.25)
        assert np.array(whole["matrices"]["noise_cov of gps"]).shape == (2, 2)


def test_the_terminal_shows_table_verdict_and_what_to_write(own):
    done = own(model="timid")
    assert done.exit_code == 0
    assert re.search(r"^knob +before +after +factor +95 % interval +unit$", done.stdout, re.MULTILINE)
    assert re.search(r"^gps σ +1\.00 +\d+\.\d+ +×\d", done.stdout, re.MULTILINE)
    assert "before: mean NIS of gps" in done.stdout
    assert "PASS  mean NIS of gps" in done.stdout
    assert "write into the model:\n  process: ConstantVelocity(acceleration_density=" in done.stdout
    named = own(model="with_more").stdout
    assert re.search(r"write into the model:\n  acceleration = 0\.\d+\n  sigma = 0\.\d+", named)


def test_what_is_written_is_what_was_fitted(own, files):
    """The lines, put into the file, give the model that was tuned: tuning again changes next to nothing."""
    whole = json.loads(own("--json", "--method", "em", model="timid").stdout)
    code = {line.partition(":")[0]: line.partition(": ")[2] for line in whole["write"]}
    made = files / "made.py"
    gps, tag = (code[f"sensors['{n}']"].partition(" = ")[2] for n in ("gps", "tag"))
    made.write_text(
        "import sequential as sq\nfrom walker import MODEL\nfrom dataclasses import replace\n"
        f"MODEL = replace(MODEL, process=replace(MODEL.process, **dict({code['process'][17:-1]})),"
        f"sensors={{'gps': sq.Position({gps}, axes=2), 'tag': sq.Position({tag}, axes=2)}})\n",
        encoding="utf-8",
    )
    again = json.loads(run(files / "walk.csv", "--model", f"{made}:MODEL", "--method", "em", "--json").stdout)
    assert again["log_likelihood_before"] == pytest.approx(whole["log_likelihood_after"], abs=0.1)


def test_one_knob_may_be_turned_from_another_start(own):
    whole = json.loads(own("--json", "--knob", "sigma=0.5", model="model").stdout)
    assert set(whole["knobs"]) == {"sigma"}
    assert whole["knobs"]["sigma"]["before"] == 0.5
    assert "held as they were: acceleration" in whole["notes"]


def test_profile_gives_limits(own):
    whole = json.loads(own("--json", "--profile", model="model").stdout)
    low, high = whole["knobs"]["sigma"]["interval95"]
    assert low < whole["knobs"]["sigma"]["after"] < high


def test_the_page_shows_before_and_after(own, files):
    done = own("-o", files / "out", "--json", model="timid")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    html = (files / "out" / "report.html").read_text(encoding="utf-8")
    assert "noise as shipped" in html
    assert "gps σ" in html
    kept = json.loads((files / "out" / "report.json").read_text(encoding="utf-8"))
    assert kept["knobs"] == whole["knobs"]
    assert "report.html" in done.stderr
    again = own("-o", files / "out", model="timid")
    assert again.exit_code == 1
    assert "--force" in again.stderr
    assert own("-o", files / "out", "--force", model="timid").exit_code == 0


def test_a_sensor_at_rest(still):
    done = run(still, "--method", "still", "--json")
    assert done.exit_code == 0, done.stderr
    runs = json.loads(done.stdout)["runs"]
    assert set(runs) == {"gyro", "adc"}
    sigmas = [knob["after"] for knob in runs["gyro"]["knobs"].values()]
    np.testing.assert_allclose(sigmas, [0.01, 0.02, 0.03], rtol=0.08)
    assert runs["gyro"]["findings"][0]["status"] == "PASS"
    assert runs["adc"]["findings"][0]["status"] == "FAIL"
    assert "t = 7." in runs["adc"]["message"]
    assert run(still, "--method", "still", "--check").exit_code == 3
    assert run(still, "--method", "still", "--check", "--stream", "gyro").exit_code == 0


def test_a_sensor_at_rest_beside_its_declaration(still):
    declared = still.parent / "model.py"
    declared.write_text(
        "import sequential as sq\nimport numpy as np\n"
        "MODEL = sq.StateSpace(sq.Vector(3), sq.Gaussian([0.0] * 3, 1.0), sq.RandomWalk(0.1),"
        "{'gyro': sq.LinearSensor(np.eye(3), 1e-6)})\n",
        encoding="utf-8",
    )
    done = run(
        still, "--method", "still", "--model", f"{declared}:MODEL", "-o", still.parent / "out", "--json"
    )
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert whole["dataset"] == "gyro"
    assert whole["knobs"]["gyro v1 σ"]["before"] == pytest.approx(1e-3)
    assert whole["before"]["sensors"]["gyro"]["verdict"] == "overconfident"
    assert whole["write"][0].startswith("gyro: noise_cov = [")
    assert json.loads((still.parent / "out" / "report.json").read_text(encoding="utf-8"))["knobs"]


def test_options_may_come_from_a_file(own, files):
    (files / "run.toml").write_text('method = "nis"\nknob = ["acceleration"]\n', encoding="utf-8")
    whole = json.loads(own("--json", "--config", files / "run.toml", model="model").stdout)
    assert whole["method"] == "nis"
    assert whole["knobs"]["sigma"]["factor"] == 1.0


def test_several_robots_become_several_runs(data_dir):
    done = run("mrclam", "--robot", "1", "--method", "nis", "--json")
    assert done.exit_code == 0, done.stderr
    whole = json.loads(done.stdout)
    assert whole["converged"]
    assert whole["after"]["sensors"]["sighting"]["mean_nis"] == pytest.approx(2.0, abs=0.01)
    assert whole["after"]["sensors"]["sighting"]["bounded_by"] == "loss"


def test_autocovariances_are_for_linear_models(own):
    done = own("--method", "als")
    assert done.exit_code == 1
    assert "takes linear models only: sensor 'gps'" in done.stderr
    whole = json.loads(own("--method", "als", "--json", model="nothing_else").stdout)
    assert whole["method"] == "als"
    assert set(whole["knobs"]) == {"process σ", "gps x0 σ", "gps x1 σ"}
