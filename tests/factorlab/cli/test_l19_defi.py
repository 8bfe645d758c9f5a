"""`factorlab l19 defi`: files of students, right ones and wrong ones, each told what it is."""

import json

import pytest
from click.testing import CliRunner

from factorlab.cli.l19 import l19
from factorlab.l19.challenge import hidden_trials, public_trial
from factorlab.l19.challenge.files import starting_files
from factorlab.l19.challenge.trials import HIDDEN_SEED

HEAD = "import numpy as np\n"
SMOOTHED = """
def filtrer(t, z):
    y, out = z[0], []
    for m in z:
        y += 0.2 * (m - y)
        out.append(y)
    return out
"""
KALMAN = """
def filtrer(t, z, q=3e-4, R=0.24, gate=10.8):
    F, Q = np.array([[1.0, 1.0], [0.0, 1.0]]), q * np.array([[1 / 3, 0.5], [0.5, 1.0]])
    x, P, out = np.array([z[0], 0.0]), np.diag([1.0, 0.25]), []
    for k, m in enumerate(z):
        if k:
            x, P = F @ x, F @ P @ F.T + Q
        S, nu = P[0, 0] + R, m - x[0]
        if nu * nu / S < gate:
            K = P[:, 0] / S
            x, P = x + K * nu, P - np.outer(K, K) * S
        out.append((x[0], P[0, 0] ** 0.5))
    return np.array(out)
"""
WRONG = {
    "sees_ahead": ("def filtrer(t, z):\n    return np.convolve(np.pad(z, 4), np.ones(9) / 9, 'valid')",
                   "l'estimation à t = 56 s change déjà"),
    "whole_mean": ("def filtrer(t, z):\n    return 0.5 * z + 0.5 * z.mean()", "l'estimation à t = 0 s"),
    "length": ("def filtrer(t, z):\n    return z + 1e-3 * len(z)", "n'est plus la même"),
    "random": ("def filtrer(t, z):\n    return z + np.random.rand(len(z))", "deux fois"),
    "memory": ("last = [0.0]\ndef filtrer(t, z):\n    last[0] += 1\n    return z + last[0]", "globale"),
    "no_return": ("def filtrer(t, z):\n    z.mean()", "un return oublié"),
    "short": ("def filtrer(t, z):\n    return z[1:]", "reçu : (239,)"),
    "nan": ("def filtrer(t, z):\n    z = z.copy(); z[7] = np.nan\n    return z", "n° 7 n'est pas un nombre"),
    "sigma": ("def filtrer(t, z):\n    return np.column_stack([z, 0 * z])", "σ doit être positif"),
    "text": ("def filtrer(t, z):\n    return 'chaud'", "reçu : str"),
    "argument": ("def filtrer(t, z):\n    z -= 1.0\n    return z", "change le tableau"),
    "name": ("def filtre(t, z):\n    return z", "filtre en est-il un autre nom ?"),
    "nothing": ("x = 3", "ne définit pas filtrer"),
    "signature": ("def filtrer(z):\n    return z", "TypeError"),
    "complex": ("def filtrer(t, z):\n    return z * 1j", "nombres complexes"),
    "generator": ("def filtrer(t, z):\n    return (x for x in z)", "reçu : generator"),
    "killed": ("import os\ndef filtrer(t, z):\n    os._exit(0)", "arrêté net"),
    "no_function": ("filtrer = 3", "ne définit pas filtrer"),
    "raises": ("def filtrer(t, z):\n    return z / [1, 2]", "filtrer s'est arrêté"),
    "syntax": ("def filtrer(t, z)\n    return z", "avant la fin"),
    "exits": ("import sys\nsys.exit(2)", "avant la fin"),
    "endless": ("def filtrer(t, z):\n    while True: pass", "boucle sans fin"),
    "now_and_then": ("def filtrer(t, z):\n    return np.column_stack([z, z * 0 + 1]) if z[40] > 36 else z",
                     "tantôt"),
}  # fmt: skip


def judged(tmp_path, text, *options):
    path = tmp_path / "mon_filtre.py"
    path.write_text(HEAD + text, encoding="utf-8")
    return CliRunner().invoke(l19, ["defi", str(path), *options])


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_told_why(tmp_path, name):
    text, told = WRONG[name]
    limit = ("--duree", "3") if name == "endless" else ()
    done = judged(tmp_path, text, "--json", *limit)
    assert done.exit_code == 3, done.output
    document = json.loads(done.stdout)
    assert told in document["fault"]
    assert document["score"] is None
    (verdict,) = document["verdicts"]
    assert verdict["verdict"] == "FAIL"
    assert verdict["action"]


def test_the_line_of_a_fault_is_the_student_s(tmp_path):
    done = judged(tmp_path, "def filtrer(t, z):\n    w = z\n    return w / [1, 2]", "--json")
    (verdict,) = json.loads(done.stdout)["verdicts"]
    assert "ligne 4 : « return w / [1, 2] »" in verdict["action"]


def test_a_low_pass_is_scored_and_told_about_the_slope(tmp_path):
    done = judged(tmp_path, SMOOTHED, "--json")
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert document["score"] == pytest.approx(document["rivals"]["passe-bas (a = 0,2)"]["score"])
    told = {one["metric"]: one for one in document["verdicts"]}
    assert told["RMS sur la rampe"]["verdict"] == "WARN"
    assert "la pente dans l'état" in told["RMS sur la rampe"]["action"]
    assert told["causalité"]["verdict"] == "PASS"


def test_a_plain_kalman_with_a_gate_does_well(tmp_path):
    document = json.loads(judged(tmp_path, KALMAN, "--json").stdout)
    assert document["score"] > 18.5
    assert document["filter"]["points"]["σ"] == 3.0


def test_a_gate_that_shuts_the_filter_out_is_named(tmp_path):
    document = json.loads(judged(tmp_path, KALMAN.replace("3e-4", "1e-6"), "--json").stdout)
    (plateau,) = (one for one in document["verdicts"] if one["metric"] == "RMS sur le palier")
    assert "portillon refuse tout" in plateau["action"]


def test_a_sigma_that_boasts_loses_its_points(tmp_path):
    boast = KALMAN.replace("P[0, 0] ** 0.5)", "0.1 * P[0, 0] ** 0.5)")
    document = json.loads(judged(tmp_path, boast, "--json").stdout)
    assert document["filter"]["points"]["σ"] == 0.0
    assert "σ est trop petit" in next(one for one in document["verdicts"] if "σ" in one["metric"])["action"]


def test_a_pair_of_rows_is_as_good_as_columns(tmp_path):
    pair = KALMAN.replace("return np.array(out)", "out = np.array(out)\n    return out[:, 0], out[:, 1]")
    scores = [json.loads(judged(tmp_path, text, "--json").stdout)["score"] for text in (KALMAN, pair)]
    assert scores[0] == scores[1]


def test_the_library_s_own_filter_may_be_used(tmp_path):
    text = """
import sequential as sq

def filtrer(t, z):
    thermometer = sq.LinearSensor([[1.0, 0.0]], 0.24, gate=0.999)
    model = sq.StateSpace(sq.Vector(2), sq.Gaussian([z[0], 0.0], [1.0, 0.25]), sq.ConstantVelocity(7.3e-4),
                          {"z": thermometer})
    run = sq.run(sq.KalmanFilter(), model, sq.SensorLog({"z": sq.Stream(t, z)}))
    return run.mean[:, 0], np.sqrt(run.cov[:, 0, 0])
"""
    assert json.loads(judged(tmp_path, text, "--json").stdout)["score"] == pytest.approx(20.0, abs=0.2)


def test_noise_and_windows_do_no_harm(tmp_path):
    noisy = "import matplotlib.pyplot as plt\nprint('bonjour' * 1000)\nplt.plot([1, 2]); plt.show()\n"
    noisy += SMOOTHED + "\nif __name__ == '__main__':\n    1 / 0\n"
    assert judged(tmp_path, noisy).exit_code == 0


def test_a_score_below_what_is_asked_is_3(tmp_path):
    assert judged(tmp_path, SMOOTHED, "--au-moins", "12").exit_code == 3
    assert judged(tmp_path, SMOOTHED, "--au-moins", "5").exit_code == 0


def test_another_seed_is_another_score(tmp_path):
    scores = {json.loads(judged(tmp_path, SMOOTHED, "--json", *s).stdout)["filter"]["ramp_rms_c"]
              for s in ((), ("--graine", "5"))}  # fmt: skip
    assert len(scores) == 2


def test_the_hidden_recordings_are_not_told(tmp_path):
    document = judged(tmp_path, KALMAN, "--json").stdout
    for trial in hidden_trials():
        assert f"{trial.sigma:.4g}" not in document
        assert f"{trial.outlier:.4g}" not in document
        assert f"{trial.z[0]:.4g}" not in document
    assert str(HIDDEN_SEED) not in document


def test_without_a_file_there_is_the_statement_and_our_table():
    done = CliRunner().invoke(l19, ["defi"])
    assert done.exit_code == 0
    for told in ("filtrer(t, z)", "Kalman réglé (le nôtre)", "20,0", "factorlab tune mesures.csv"):
        assert told in " ".join(done.output.split())


def test_o_writes_what_one_begins_with(tmp_path):
    out = tmp_path / "defi"
    assert CliRunner().invoke(l19, ["defi", "-o", str(out)]).exit_code == 0
    for name, text in starting_files(public_trial()).items():
        assert (out / name).read_text(encoding="utf-8") == text
    done = CliRunner().invoke(l19, ["defi", str(out / "mon_filtre.py"), "--json"])
    assert json.loads(done.stdout)["score"] == pytest.approx(8.0, abs=0.2)
    again = CliRunner().invoke(l19, ["defi", "-o", str(out)])
    assert again.exit_code == 1
    assert "--force" in again.output


def test_no_such_file_and_no_file_to_be_good_enough(tmp_path):
    done = CliRunner().invoke(l19, ["defi", str(tmp_path / "absent.py")])
    assert done.exit_code == 1
    assert "il n'y a pas de fichier" in done.output
    assert CliRunner().invoke(l19, ["defi", "--au-moins", "3"]).exit_code == 2
