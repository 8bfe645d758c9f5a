"""The course's sheets: what is read from one, what is refused, and that all five are in order."""

from pathlib import Path

import pytest

from factorlab.l19.sheets import as_text, in_plain_text, read_sheet, verified
from sequential.errors import DataError, FileFormatError

FOLDER = Path(__file__).resolve().parents[3] / "examples" / "l19" / "fiches"
GOOD = """# S9. Essai

Deux mots.

## Bruit
Le **bruit**, `σ` ; voir [l'exemple](exemple.py#debut) et [le site](https://example.org).

## Biais
Le biais : [exemple.py](exemple.py).
"""


@pytest.fixture
def write(tmp_path):
    (tmp_path / "exemple.py").touch()

    def write(text):
        path = tmp_path / "fiche.md"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_sheet_has_a_title_an_introduction_and_entries(write):
    sheet = read_sheet(write(GOOD))
    assert (sheet.title, sheet.introduction) == ("S9. Essai", "Deux mots.")
    assert sheet.titles == ("Bruit", "Biais")
    assert [entry.links for entry in sheet.entries] == [("exemple.py#debut",), ("exemple.py",)]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("# S9. Essai", "S9. Essai"), "begins with a line '# title'"),
        (("## ", "### "), "has entries"),
        (("## Biais", "## Bruit"), "two entries are called 'Bruit'"),
        ((" : [exemple.py](exemple.py)", ""), "'Biais' links to no example"),
        (("(exemple.py)", "(absent.py)"), "'Biais' links to absent.py, and no such file"),
        (("Deux mots.", "[Deux](mots.md)."), "the introduction links to mots.md, and no such file"),
    ],
)
def test_a_sheet_that_is_out_of_order_is_refused(write, change, words):
    with pytest.raises(FileFormatError, match=words.replace("(", r"\(")):
        read_sheet(write(GOOD.replace(*change)))


def test_a_missing_sheet_is_named(tmp_path):
    with pytest.raises(FileFormatError, match=r"absent\.md: cannot be read"):
        read_sheet(tmp_path / "absent.md")


def test_every_entry_is_checked_and_every_check_has_an_entry(write):
    sheet = read_sheet(write(GOOD))
    checks = {"Biais": lambda: "3", "Bruit": lambda: "1"}
    found = verified(sheet, checks)
    assert list(found.items()) == [("Bruit", "1"), ("Biais", "3")]
    assert "Le biais : exemple.py.\n  → 3" in as_text(sheet, found)
    with pytest.raises(DataError, match="nothing checks the entry 'Biais'"):
        verified(sheet, {"Bruit": checks["Bruit"]})
    with pytest.raises(DataError, match="no entry 'Biaix' to check; did you mean 'Biais'"):
        verified(sheet, {**checks, "Biaix": checks["Biais"]})


def test_what_a_check_finds_false_is_not_hidden(write):
    def false():
        raise AssertionError("2 ≠ 3")

    with pytest.raises(AssertionError, match="2 ≠ 3"):
        verified(read_sheet(write(GOOD)), {"Bruit": false, "Biais": false})


def test_a_terminal_shows_words_without_marks():
    text = in_plain_text(
        "Le **bruit**, *fort*, `2*x*y` ; voir [F1](../01_f1.py) et [02.py](../02.py).\n\n```\ny\n```"
    )
    assert text == "Le bruit, fort, 2*x*y ; voir F1 (01_f1.py) et 02.py.\n\n    y"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.md")), ids=lambda path: path.stem)
def test_the_sheets_of_the_course_are_in_order(path):
    sheet = read_sheet(path)
    assert sheet.title.startswith(path.name[:2].upper())
    script = next(FOLDER.parent.glob(f"6?_{path.stem}.py"))
    assert script.name in sheet.introduction, "the sheet names the script that checks it"
