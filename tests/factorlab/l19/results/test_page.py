"""The page says what was claimed, is read back as it was written, and differences are named."""

from dataclasses import replace
from pathlib import Path

import pytest

from factorlab.l19.results import (
    COURSE,
    Claim,
    Outcome,
    Work,
    differences,
    item_of,
    read_claims,
    read_results,
    readme_table,
    results_page,
    with_table,
)
from factorlab.l19.results.readme import table_in
from factorlab.report.document import Table
from sequential.errors import FileFormatError

CLAIMS = (
    Claim("K1", "RMS | écart", 0.0123, "m", 0.01, 0.02, "MPU-6050"),
    Claim("K1", "NIS moyen", 1.02, "", 0.9, 1.1),
    Claim("K1", "durée", 3.2, "s"),
    Claim("K1", "biais de l'élève", 0.4, "°/s"),
)
K1 = Outcome(Path("05_k1_kalman_1d.py"), CLAIMS)
TP = Outcome(
    Path("46_tp4b_marqueurs.py"),
    (Claim("TP4b", "normale", 1.4, "°", high=3.0),),
    (Table(("axe", ("σ", "m/s²"), "N"), (("ax", 0.03, None),), caption="Par axe"),),
)


def page(tmp_path, *outcomes, **rest):
    path = tmp_path / "RESULTATS.md"
    path.write_text(results_page(Work(outcomes, whole=False, **rest)), encoding="utf-8")
    return path


def test_every_claim_is_read_back(tmp_path):
    rows = read_results(page(tmp_path, K1, TP))
    judged = [claim for one in (K1, TP) for claim in one.claims if not claim.is_time]
    assert [row.claim for row in rows] == judged
    assert rows[-1].written == "1,4°"
    assert [row.script for row in rows] == [K1.script.name] * 3 + [TP.script.name]


def test_times_stand_apart(tmp_path):
    text = page(tmp_path, K1).read_text(encoding="utf-8")
    assert "durée" not in text.split("## Temps et vitesses")[0]
    assert "| durée | 3,2 s |" in text.split("## Temps et vitesses")[1]


def test_tables_and_pictures_of_the_practical_work(tmp_path):
    text = page(tmp_path, TP, pictures={TP.script.stem: ["figures/a.png"]}).read_text(encoding="utf-8")
    assert "## TP4b. Marqueurs ArUco et pose" in text
    assert "| axe | σ (m/s²) | N |\n|---|--:|--:|\n| ax | 0,03 | – |" in text
    assert "![Figure de 46_tp4b_marqueurs](figures/a.png)" in text


def test_what_a_student_measured_leads(tmp_path):
    mine = Claim("K1", "résidu", 0.3, "px", source="12 photos")
    one = replace(K1, claims=(CLAIMS[1], mine))
    files = [f"damier/{k}.jpg" for k in range(12)]
    text = page(tmp_path, one, recordings={"K1": files}).read_text(encoding="utf-8")
    assert "| **K1** | dit | `05_k1_kalman_1d.py` | résidu | 0,3 px | – | 12 photos |" in text
    assert "- K1 : 12 fichiers, de `damier/0.jpg` à `damier/11.jpg`" in text


def test_a_failing_example_is_a_line_that_says_so(tmp_path):
    broken = Outcome(Path("06_k2_regler.py"), CLAIMS[:1], fault="R : 3, au plus 2 attendu")
    text = page(tmp_path, K1, broken).read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith("| **K2**")]
    assert line.startswith("| **K2** | ÉCHEC | ")
    assert "**ÉCHEC** : R : 3, au plus 2 attendu" in text
    assert Work((K1, broken), whole=False).failed
    assert not Work((K1, TP), whole=False).failed


def test_an_id_without_a_file_is_a_line_too():
    text = results_page(Work((K1,)))
    missing = [line for line in text.splitlines() if "| PAS DE FICHIER |" in line]
    assert len(missing) == len(COURSE) - 1
    assert Work((K1,)).failed


def test_the_same_figures_differ_in_nothing(tmp_path):
    assert differences((K1, TP), read_results(page(tmp_path, K1, TP))) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: replace(c, value=0.03), "hors de la tolérance 0,01 à 0,02"),
        (lambda c: replace(c, value=float("nan")), "hors de la tolérance"),
        (lambda c: replace(c, unit="cm"), "est en cm, en m dans la page"),
        (lambda c: replace(c, high=0.5), "tolérance 0,01 à 0,5 dans l'exemple"),
        (lambda c: replace(c, quantity="autre"), "absent de la page"),
        (lambda _: None, "ne l'annonce plus"),
    ],
)
def test_each_difference_is_named(tmp_path, change, words):
    stated = read_results(page(tmp_path, K1, TP))
    first = change(CLAIMS[0])
    fresh = replace(K1, claims=(*([first] if first else []), *CLAIMS[1:]))
    said = differences((fresh, TP), stated)
    assert any(words in sentence and K1.script.name in sentence for sentence in said), said


def test_times_and_values_inside_the_band_are_no_difference(tmp_path):
    stated = read_results(page(tmp_path, K1, TP))
    fresh = replace(K1, claims=(replace(CLAIMS[0], value=0.0199), CLAIMS[1], replace(CLAIMS[2], value=9.0),
                                CLAIMS[3]))  # fmt: skip
    assert differences((fresh, TP), stated) == []


def test_scripts_that_come_and_go(tmp_path):
    stated = read_results(page(tmp_path, TP))
    (added, gone) = differences((K1,), stated)
    assert "aucune dans la page" in added
    assert "n'existe plus" in gone
    assert len(differences((K1,), stated, whole=False)) == 1
    assert "a échoué" in differences((replace(TP, claims=(), fault="raté"),), stated)[0]


def test_the_readme_s_table(tmp_path):
    table = readme_table(read_results(page(tmp_path, TP, K1)))
    first, second = table.splitlines()[2:]
    assert first.startswith("| **K1** | Kalman 1-D | [`05_k1_kalman_1d.py`](05_k1_kalman_1d.py) | ")
    assert first.endswith("| RMS \\| écart : 0,0123 m (tolérance 0,01 à 0,02) |")
    assert "factorlab live camera" in second
    text = with_table("avant\n<!-- tableau -->\nvieux\n<!-- fin du tableau -->\naprès\n", table)
    assert table_in(text) == table
    assert text.startswith("avant\n")
    assert text.endswith("\naprès\n")
    with pytest.raises(FileFormatError, match="marques"):
        with_table("sans", table)


def test_a_page_of_something_else_is_refused(tmp_path):
    path = tmp_path / "autre.md"
    path.write_text("# rien\n| a | b |\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match="rapport"):
        read_results(path)


def test_a_spoilt_row_is_named_by_its_line(tmp_path):
    path = page(tmp_path, K1)
    path.write_text(path.read_text(encoding="utf-8").replace("0,01 à 0,02", "à peu près"), encoding="utf-8")
    with pytest.raises(FileFormatError, match=r"ligne \d+"):
        read_results(path)


def test_a_claims_file_that_is_none(tmp_path):
    (tmp_path / "a.jsonl").write_text('{"item": "K1"}\n', encoding="utf-8")
    with pytest.raises(FileFormatError, match="line 1"):
        read_claims(tmp_path / "a.jsonl")
    assert read_claims(tmp_path / "b.jsonl") == ((), ())


@pytest.mark.parametrize(
    ("name", "item"),
    [
        ("46_tp4b_marqueurs.py", "TP4b"),
        ("03_c1_caracteriser.py", "C1"),
        ("claims.py", None),
        ("1_x.py", None),
    ],
)
def test_ids_in_file_names(name, item):
    assert item_of(name) == item
