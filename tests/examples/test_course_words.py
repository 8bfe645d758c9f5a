"""What the course tells a student to type exists, and so does what it sends him to."""

import ast
import re

import pytest
from site_reading import ROOT, command_lines, faults_of

from factorlab.cli import main

COURSE = ROOT / "examples" / "l19"
README = (COURSE / "README.md").read_text(encoding="utf-8")
SCRIPTS = sorted(COURSE.glob("[0-9]*.py"))
QUESTIONS = {  # what the course asks to answer in the text, and where a student looks for it
    "01_f1_capteur_reel.py": "pourquoi intégrer deux fois",
    "05_k1_kalman_1d.py": "augmenter R fait quoi",
    "11_v2_geometrie.py": "Pourquoi une caméra seule ne mesure-t-elle pas la distance",
}


def docstring(script):
    return ast.get_docstring(ast.parse(script.read_text(encoding="utf-8")))


def test_the_readme_names_every_file_in_its_table():
    table = README.partition("<!-- tableau -->")[2]
    assert [path.name for path in SCRIPTS if f"]({path.name})" not in table] == []


@pytest.mark.parametrize("script", SCRIPTS, ids=[path.stem for path in SCRIPTS])
def test_commands_of_a_script_exist(script):
    lines = command_lines(docstring(script))
    assert not {line: faults for line in lines if (faults := faults_of(line, main))}


@pytest.mark.parametrize("script", SCRIPTS, ids=[path.stem for path in SCRIPTS])
def test_a_script_begins_with_its_item_and_is_a_screen_or_two(script):
    item = re.match(r"\d\d_([a-z]+\d[a-d]?)_", script.name)[1].upper()
    said = re.sub(r"[ ()]", "", docstring(script).splitlines()[0]).upper()
    assert said.startswith(item), said
    longest = 300 if item.startswith("S") else 240  # a sheet's script checks twenty statements
    assert len(script.read_text(encoding="utf-8").splitlines()) <= longest


@pytest.mark.parametrize("name", QUESTIONS)
def test_the_course_s_questions_are_answered(name):
    assert QUESTIONS[name] in " ".join(docstring(COURSE / name).split())
