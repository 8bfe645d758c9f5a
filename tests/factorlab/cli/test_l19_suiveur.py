"""`factorlab l19 suiveur` as it is typed: how it drives, how it ends, and what it leaves."""

import csv
import json
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request

import pytest
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.cli.l19_suiveur import CURVES, DETECTORS, FIELDS, SCALES, suiveur
from factorlab.l19.follower import CURVES as ALL_CURVES
from factorlab.l19.follower import DETECTORS as ALL_DETECTORS
from factorlab.live.follower.controls import CONTROLS

QUIET = ("--no-browser", "--port", "0")


def run(*options):
    return CliRunner().invoke(main, ["l19", "suiveur", *map(str, options)])


def test_five_hundred_steps_and_a_summary():
    done = run(*QUIET, "--courbe", "sinus", "--steps", 500, "--vite", "--json")
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["journey"]["steps"] == 500
    assert told["journey"]["lost_s"] is None
    assert told["journey"]["rms_m"] < 0.02
    assert [one["verdict"] for one in told["verdicts"]] == ["PASS", "PASS", "PASS"]
    assert "suiveur : http://127.0.0.1:" in done.stderr


def test_without_json_it_says_so_in_french():
    done = run(*QUIET, "--duree", "2", "--vite")
    assert done.exit_code == 0
    assert "40 pas de 50 ms" in done.stdout
    assert "La ligne a été suivie jusqu'au bout" in done.stdout


def test_the_report_and_the_table(tmp_path):
    done = run(
        *QUIET, "--steps", 80, "--vite", "--bruit", 25, "--flou", 20, "--seed", 3, "-o", tmp_path / "out"
    )
    assert done.exit_code == 0, done.stderr
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "report.html",
        "report.json",
        "trajectoire.csv",
    ]
    with (tmp_path / "out" / "trajectoire.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 80
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert "écart latéral RMS" in page
    settings = json.loads((tmp_path / "out" / "report.json").read_text())["settings"]
    assert (settings["noise"], settings["blur_s"], settings["seed"]) == (25.0, 0.02, 3)
    again = run(*QUIET, "--steps", 5, "--vite", "-o", tmp_path / "out")
    assert (again.exit_code, "--force" in again.stderr) == (1, True)


def test_a_lost_line_is_a_finding_and_with_check_an_exit_code():
    lost = (*QUIET, "--steps", 120, "--vite", "--bruit", 200)
    done = run(*lost)
    assert done.exit_code == 0
    assert "La ligne a été perdue à " in done.stdout
    assert run(*lost, "--check").exit_code == 3


def test_a_port_in_use_is_a_sentence():
    with socket.create_server(("127.0.0.1", 0)) as busy:
        port = busy.getsockname()[1]
        done = run("--no-browser", "--port", port)
    assert done.exit_code == 1
    assert f"le port {port} de 127.0.0.1 est déjà pris" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_properly(tmp_path, number):
    with subprocess.Popen(
        [sys.executable, "-m", "factorlab", "l19", "suiveur", *QUIET, "--json", "-o", tmp_path / "out"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        found = None
        while found is None:
            found = re.search(r"http://\S+", process.stderr.readline())
        for _ in range(200):
            with urllib.request.urlopen(found[0] + "state.json", timeout=10) as answer:  # noqa: S310 - ours
                if json.load(answer)["journey"]["steps"] > 5:
                    break
            time.sleep(0.02)
        process.send_signal(number)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 0, err
    assert json.loads(out)["journey"]["steps"] > 5
    assert (tmp_path / "out" / "trajectoire.csv").is_file()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--bruit", "300"), "Bruit de l'image : attendu entre 0 et 200 niveaux de gris, reçu 300"),
        (("--flou", "-5"), "Flou de bougé : attendu entre 0 et 1000 ms, reçu -5"),
        (("--kp", "nan"), "Kp : attendu entre 0 et 150"),
        (("--seed", "-1"), "la graine doit être un entier positif ou nul"),
        (("--vite",), "--vite demande une fin"),
        (("--steps", "5", "--duree", "2"), "disent la même chose"),
        (("--courbe", "huit"), "« huit » n'en fait pas partie : circuit, sinus"),
        (("--port", "99999"), "99999"),
    ],
)
def test_options_that_make_no_sense_are_told(options, words):
    done = run(*QUIET, *options)
    assert done.exit_code == 2
    assert words in " ".join(done.stderr.split())


def test_the_options_are_the_sliders():
    options = {name for one in suiveur.params for name in one.opts}
    assert {f"--{one.option}" for one in CONTROLS} <= options
    assert {FIELDS[one.option.replace("-", "_")] for one in CONTROLS} == {one.name for one in CONTROLS}
    scales = {one.option.replace("-", "_"): 1 / one.scale for one in CONTROLS if one.scale != 1}
    assert scales == pytest.approx(SCALES)
    assert sorted(CURVES) == sorted(ALL_CURVES)
    assert tuple(DETECTORS) == ALL_DETECTORS


def test_a_detector_of_ones_own(tmp_path):
    path = tmp_path / "mien.py"
    path.write_text("def detecter(image):\n    print('vu')\n    return None\n", encoding="utf-8")
    own = (*QUIET, "--steps", 60, "--vite", "--mon-detecteur", path)
    done = run(*own, "--json")
    assert json.loads(done.stdout)["journey"]["lost_s"] is not None
    assert "vu" in done.stderr
    path.write_text("def detecter(image):\n    return image[99]\n", encoding="utf-8")
    done = run(*own)
    assert done.exit_code == 1
    assert (
        "erreur : detecter s'est arrêté (mien.py, ligne 2 « return image[99] ») : IndexError" in done.stderr
    )
    done = run(*QUIET, "--mon-detecteur", tmp_path / "nulle_part.py")
    assert (done.exit_code, done.stderr.startswith("erreur : il n'y a pas de fichier")) == (1, True)
