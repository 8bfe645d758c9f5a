"""The catalogue: both languages, the same numbers in both, and every sentence is used."""

import re
import string
from pathlib import Path

import pytest

import factorlab.characterize
from factorlab.characterize.words import catalogue, group_name, say

CODE = "\n".join(
    path.read_text(encoding="utf-8")
    for folder in (
        Path(factorlab.characterize.__file__).parent,
        Path(factorlab.characterize.__file__).parents[1] / "report",
    )
    for path in folder.glob("*.py")
)


def fields(text):
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


@pytest.mark.parametrize("key", catalogue())
def test_both_languages_say_the_same_numbers(key):
    entry = catalogue()[key]
    assert set(entry) == {"en", "fr"}
    assert fields(entry["en"]) == fields(entry["fr"])
    assert "." not in re.sub(r"[a-z]\.|\)\.|\. [A-Z]|\}\.|…|\.$", "", entry["fr"]), "a decimal comma"


@pytest.mark.parametrize("key", catalogue())
def test_every_sentence_is_used(key):
    stem = re.sub(r"^(h|section|sensor|allan|h_term)_", "", key)
    stem = re.sub(r"^(b|k)_(seen|unseen)$|_text$|^term_.*$", "", stem)
    assert re.search(rf'["_{{}}]{re.escape(stem)}["_{{}}]|"{re.escape(key)}"', CODE), key


def test_numbers_take_the_language_s_decimal_sign():
    assert say("en", "h_gain", factor=2.5).endswith("×2.50")
    assert say("fr", "h_gain", factor=2.5).endswith("×2,50")
    assert group_name("gyro", "fr") == "gyromètre"
    assert group_name("pression", "fr") == "pression"
