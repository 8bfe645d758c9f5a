"""What `factorlab l19 rapport` writes, prints and returns, on a little course of its own."""

import json

import pytest
from click.testing import CliRunner
from course_examples import example

from factorlab.cli import main


def run(*arguments):
    return CliRunner().invoke(main, ["l19", "rapport", *map(str, arguments)])


@pytest.fixture
def course(tmp_path):
    folder = tmp_path / "cours"
    folder.mkdir()
    example(folder, "05_k1_bon.py", 'claim("K1", "NIS moyen", 1.0, low=0.9, high=1.1)')
    own = 'name = sys.argv[1] if len(sys.argv) == 4 else "simulé"'
    example(folder, "41_tp1_own.py", own, 'claim("TP1", "σ", 0.03, "m/s²", low=0.02, source=Path(name).name)')
    return folder


def test_a_report_of_two_items(course, tmp_path):
    done = run("-o", tmp_path / "rendu", "--cours", course, "--only", "K1,TP1", "--nom", "Ada")
    assert done.exit_code == 0, done.output
    text = (tmp_path / "rendu" / "RESULTATS.md").read_text(encoding="utf-8")
    assert text.startswith("# Résultats du module L19, « Perception » : Ada\n")
    assert "| NIS moyen | 1 | 0,9 à 1,1 | simulé | bon |" in text
    typed = f"factorlab l19 rapport -o {tmp_path / 'rendu'} --cours {course} --only K1,TP1 --nom Ada"
    assert f"Page écrite par `{typed}`" in text
    assert "[ 2/2]" in done.stderr
    assert "2 grandeurs sur 2" in done.stdout


def test_the_same_course_gives_the_same_page(course, tmp_path):
    pages = []
    for _ in range(2):
        assert run("-o", tmp_path / "r", "--cours", course, "--only", "K1,TP1", "--force").exit_code == 0
        pages.append((tmp_path / "r" / "RESULTATS.md").read_text(encoding="utf-8"))
    assert pages[0] == pages[1]


def test_an_own_recording(course, tmp_path):
    (tmp_path / "mon imu.csv").write_text("t\n", encoding="utf-8")
    done = run("-o", tmp_path / "r", "--cours", course, "--only", "TP1", "--imu", tmp_path / "mon imu.csv")
    assert done.exit_code == 0, done.output
    text = (tmp_path / "r" / "RESULTATS.md").read_text(encoding="utf-8")
    assert "| σ | 0,03 m/s² | ≥ 0,02 | mon imu.csv | bon |" in text
    assert f"- TP1 : `{tmp_path / 'mon imu.csv'}`" in text


def test_a_failing_example_is_a_line_and_3(course, tmp_path):
    example(course, "06_k2_faux.py", 'claim("K2", "RMS", 2.0, "m", high=1.0)')
    done = run("-o", tmp_path / "r", "--cours", course, "--only", "K1,K2")
    assert done.exit_code == 3
    assert "06_k2_faux.py : échec : RMS" in done.stdout
    assert "| RMS | 2 m | ≤ 1 | simulé | HORS TOLÉRANCE |" in (tmp_path / "r" / "RESULTATS.md").read_text(
        encoding="utf-8"
    )


def test_ids_without_a_file(course, tmp_path):
    done = run("-o", tmp_path / "r", "--cours", course)
    assert done.exit_code == 3
    assert "sans fichier : F1, F2" in done.stdout


def test_comparing(course, tmp_path):
    page = tmp_path / "r" / "RESULTATS.md"
    assert run("-o", tmp_path / "r", "--cours", course, "--only", "K1,TP1").exit_code == 0
    assert run("--compare", page, "--cours", course, "--only", "K1,TP1").exit_code == 0
    page.write_text(page.read_text(encoding="utf-8").replace("0,9 à 1,1", "0,2 à 0,5"), encoding="utf-8")
    done = run("--compare", page, "--cours", course, "--only", "K1")
    assert done.exit_code == 3
    assert "écart : 05_k1_bon.py : NIS moyen = 1, hors de la tolérance 0,2 à 0,5" in done.stdout


def test_json_is_one_document(course, tmp_path):
    done = run("-o", tmp_path / "r", "--cours", course, "--only", "K1", "--json")
    document = json.loads(done.stdout)
    assert document["good"]
    assert document["examples"][0]["claims"][0]["value"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((), 2, "-o"),
        (("-o", "r", "--only", "Z9"), 1, "ne connaît que"),
        (("-o", "r", "--cours", "nulle/part"), 1, "--cours"),
        (("-o", "r", "--only", "K1", "--imu", "un.csv"), 2, "TP1"),
        (("-o", "r", "--only", "K1", "--readme", "un.csv"), 2, "cours entier"),
        (("-o", "r", "--readme", "un.csv"), 1, "marques"),
        (("--compare", "un.csv"), 1, "RESULTATS|rapport"),
        (("-o", "un.csv/r", "--only", "K1"), 1, "dossier"),
    ],
)
def test_what_cannot_be_is_told_before_the_work(course, tmp_path, monkeypatch, arguments, code, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "un.csv").write_text("t\n", encoding="utf-8")
    given = arguments if "--cours" in arguments else (*arguments, "--cours", "cours")
    done = run(*given)
    assert done.exit_code == code, done.output
    assert any(word in done.stderr for word in words.split("|")), done.stderr
    assert "[ 1/" not in done.stderr


def test_an_earlier_page_stays_without_force(course, tmp_path):
    (tmp_path / "RESULTATS.md").write_text("le mien", encoding="utf-8")
    done = run("-o", tmp_path, "--cours", course, "--only", "K1")
    assert done.exit_code == 1
    assert (tmp_path / "RESULTATS.md").read_text(encoding="utf-8") == "le mien"


def test_the_readme_s_table_is_made_from_the_page(course, tmp_path, monkeypatch):
    from factorlab.l19.results import course as items

    monkeypatch.setattr(
        "factorlab.l19.results.page.COURSE", [i for i in items.COURSE if i.id in {"K1", "TP1"}]
    )
    readme = tmp_path / "README.md"
    readme.write_text("# Cours\n<!-- tableau -->\n<!-- fin du tableau -->\nfin\n", encoding="utf-8")
    done = run("-o", tmp_path / "R.md", "--cours", course, "--readme", readme)
    assert done.exit_code == 0, done.output
    text = readme.read_text(encoding="utf-8")
    assert "| NIS moyen : 1 (tolérance 0,9 à 1,1) |" in text
    assert text.endswith("fin\n")
