"""`factorlab l19 check` as a student types it."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from kalman_copies import PLAIN, WRONG

from factorlab.cli import main

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "l19"


@pytest.fixture
def check(tmp_path):
    def run(*arguments, text=None, name="kalman.py"):
        path = tmp_path / name
        if text is not None:
            path.write_text(text, encoding="utf-8")
        return CliRunner().invoke(main, ["l19", "check", str(path), *map(str, arguments)])

    return run


def test_right_ends_with_0(check):
    done = check(text=PLAIN)
    assert done.exit_code == 0, done.output
    assert "E1, filtre de Kalman : juste" in done.output


def test_wrong_ends_with_3_and_says_the_first_thing_first(check):
    done = check(text=PLAIN.replace("z - H @ self.x", "H @ self.x - z"))
    assert done.exit_code == 3
    assert "à corriger d’abord : corriger : l'état" in done.output
    assert "cause probable : signe de l'innovation" in done.output
    assert done.output.index("✓") < done.output.index("✗")


def test_at_most_three_are_shown_unless_asked(check):
    text = PLAIN
    for cause in ("B ignorée", "Q pas ajoutée", "signe de l'innovation", "P pas corrigée"):
        for before, after in WRONG[cause]:
            text = text.replace(before, after)
    short, whole = check(text=text), check("--tout", text=text)
    assert short.output.count("✗") == 3
    assert "--tout" in short.output
    assert whole.output.count("✗") > 3


def test_json_is_one_document(check):
    done = check("--json", text=PLAIN.replace("z - H @ self.x", "H @ self.x - z"))
    assert done.exit_code == 3
    told = json.loads(done.stdout)
    (file,) = told["files"]
    assert (told["verdict"], file["exercises"][0]["exercise"]) == ("FAIL", "E1")
    causes = [f["cause"] for f in file["exercises"][0]["findings"] if f["status"] == "FAIL"]
    assert causes == ["signe de l'innovation"]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (None, "n'existe pas"),
        ("x = 1\n", "ne définit aucun nom"),
        ("def nis_moyenne(kf):\n    return 1\n", "est-ce `nis_moyen`"),
    ],
)
def test_what_cannot_be_checked_ends_with_1(check, text, word):
    done = check(text=text)
    assert done.exit_code == 1
    assert word in done.stderr
    assert done.stdout == ""


def test_a_syntax_error_shows_its_line(check):
    done = check(text=PLAIN.replace("def predire(self, u=None):", "def predire(self, u=None)"))
    assert done.exit_code == 3
    assert "def predire(self, u=None)" in done.output
    assert "n'est pas encore du Python" in done.output


def test_a_folder_is_checked_file_by_file(check, tmp_path):
    (tmp_path / "autre.py").write_text("x = 1\n", encoding="utf-8")
    (tmp_path / "tp.py").write_text(PLAIN, encoding="utf-8")
    done = CliRunner().invoke(main, ["l19", "check", str(tmp_path)])
    assert done.exit_code == 0
    assert "tp.py" in done.output
    assert "autre.py" not in done.output


@pytest.mark.parametrize(
    ("example", "exercise"),
    [
        ("31_e1_kalman", "E1"),
        ("32_e2_median_et_sauts", "E2"),
        ("33_e3_capteur_ir", "E3"),
        ("34_e4_composantes", "E4"),
    ],
)
def test_our_own_solutions_pass_without_a_remark(example, exercise):
    done = CliRunner().invoke(main, ["l19", "check", str(EXAMPLES / f"{example}.py"), "--json"])
    assert done.exit_code == 0, done.output
    (verdict,) = json.loads(done.stdout)["files"][0]["exercises"]
    assert (verdict["exercise"], verdict["verdict"]) == (exercise, "PASS"), verdict


def test_the_command_is_told_how_to_be_used(check):
    assert CliRunner().invoke(main, ["l19", "check"]).exit_code == 2
