"""How the course's examples speak: decimal commas, and claims that are kept, printed and asserted."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

COURSE = Path(__file__).resolve().parents[2] / "examples" / "l19"
DRAWS = """
import sys
sys.path.insert(0, {course!r})
import figures
from claims import claim
figure, (a, b) = figures.panels(1, 2, title="pente 0.5")
a.plot([0.0, 0.25, 1.0], [0.1, 0.2, 0.35], label="σ = 2.50 m")
a.legend()
b.barh(["un", "deux"], [0.5, 1.5])
figures.save(figure)
a.figure.canvas.draw()
print([t.get_text() for t in a.get_xticklabels() + b.get_xticklabels()])
words = a.get_legend().texts[0].get_text(), figure.get_suptitle()
print([t.get_text() for t in b.get_yticklabels()], *words)
claim("F1", "longueur", {value}, "m", low=1.0, high=2.0, source="simulé")
claim("F1", "durée", 3.25, "s")
"""


def run(folder, value):
    script = folder / "01_essai.py"
    script.write_text(DRAWS.format(course=str(COURSE), value=value), encoding="utf-8")
    return subprocess.run(
        [sys.executable, script, "-o", folder / "out"], capture_output=True, text=True, check=False
    )


def test_numbers_are_french_in_figures_and_sentences(tmp_path):
    done = run(tmp_path, 1.5)
    assert done.returncode == 0, done.stderr
    _, ticks, words, *claims = done.stdout.splitlines()
    assert "0,2" in ticks
    assert "." not in ticks
    assert words == "['un', 'deux'] σ = 2,50 m pente 0,5"
    assert claims == ["F1 : longueur = 1,5 m (de 1 à 2)", "F1 : durée = 3,25 s"]
    assert (tmp_path / "out" / "01_essai.png").is_file()


def test_claims_are_kept_a_line_each(tmp_path):
    run(tmp_path, 1.5)
    kept = [json.loads(line) for line in (tmp_path / "out" / "01_essai.jsonl").read_text().splitlines()]
    assert kept == [
        {"item": "F1", "quantity": "longueur", "value": 1.5, "unit": "m", "low": 1.0, "high": 2.0,
         "source": "simulé"},
        {"item": "F1", "quantity": "durée", "value": 3.25, "unit": "s", "low": None, "high": None,
         "source": "simulé"},
    ]  # fmt: skip
    run(tmp_path, 1.25)  # a second run begins anew
    assert len((tmp_path / "out" / "01_essai.jsonl").read_text().splitlines()) == 2


@pytest.mark.parametrize(("value", "words"), [(0.5, "au moins 1 attendu"), (2.5, "au plus 2 attendu")])
def test_a_claim_out_of_its_band_says_so_and_is_kept(tmp_path, value, words):
    done = run(tmp_path, value)
    assert done.returncode == 1
    assert words in done.stderr
    (kept,) = (tmp_path / "out" / "01_essai.jsonl").read_text().splitlines()
    assert json.loads(kept)["value"] == value
