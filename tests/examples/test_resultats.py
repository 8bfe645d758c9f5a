"""RESULTATS.md and the table of the course's README: complete, inside their bands, and each other's."""

import re
from pathlib import Path

import click
import pytest

from factorlab.cli import main
from factorlab.l19.results import COURSE, item_of, read_results, stale_readme

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "examples" / "l19"
PAGE = ROOT / "RESULTATS.md"
COUNTS = {"F": 2, "K": 3, "I": 1, "V": 2, "C": 3, "P": 5, "S": 5, "E": 4, "D": 3}  # of the course's ids
PRACTICAL = ["TP1", "TP2", "TP3", "TP4a", "TP4b", "TP4c", "TP4d", "TP5", "TP6"]
IDS = [f"{letter}{k}" for letter, count in COUNTS.items() for k in range(1, count + 1)] + PRACTICAL
SCRIPTS = sorted(path.name for path in FOLDER.glob("*.py") if item_of(path.name))


@pytest.fixture(scope="module")
def rows():
    return read_results(PAGE)


def test_the_course_is_whole():
    assert sorted(item.id for item in COURSE) == sorted(IDS)


@pytest.mark.parametrize("item", IDS)
def test_every_id_has_a_file_and_a_judged_row(item, rows):
    assert [name for name in SCRIPTS if item_of(name) == item]
    assert [row for row in rows if row.claim.item == item and row.claim.judged]


def test_every_file_has_its_rows_and_every_row_its_file(rows):
    assert sorted({row.script for row in rows}) == SCRIPTS


def test_every_value_is_in_its_band(rows):
    assert not [f"{row.script}: {row.claim}" for row in rows if not row.claim.holds]


def test_no_figure_is_stated_twice_in_a_file(rows):
    stated = [(row.script, row.claim.quantity) for row in rows]
    assert not {one for one in stated if stated.count(one) > 1}


def test_the_page_says_that_all_is_well():
    text = PAGE.read_text(encoding="utf-8")
    for word in ("HORS TOLÉRANCE", "ÉCHEC", "MUET", "PAS DE FICHIER"):
        assert word not in text


def test_its_pictures_are_there_and_small():
    links = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", PAGE.read_text(encoding="utf-8"))
    assert len(links) > 10
    assert not [link for link in links if not (ROOT / link).is_file()]
    assert max((ROOT / link).stat().st_size for link in links) < 100_000


def test_the_readme_s_table_is_that_of_the_page():
    assert not stale_readme(FOLDER / "README.md", PAGE)


@pytest.mark.parametrize("item", [item for item in COURSE if item.command], ids=lambda item: item.id)
def test_every_command_of_the_table_exists(item):
    command, words = main, item.command.split()[1:]
    while isinstance(command, click.Group):
        command = command.commands[words.pop(0)]
    options = {name for parameter in command.params for name in parameter.opts}
    assert not [word for word in words if word.startswith("-") and word not in options]
