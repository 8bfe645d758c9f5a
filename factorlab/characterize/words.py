"""Sentences in English and in French, from the catalogue `words.toml`, with their numbers."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources

from factorlab.report.words import Language, number

__all__ = ["group_name", "largest_of", "say"]


@cache
def catalogue() -> dict[str, dict[str, str]]:
    """Sentences by name and language."""
    text = resources.files("factorlab.characterize").joinpath("words.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def say(lang: Language, key: str, **values: float | str) -> str:
    """A sentence with its numbers, three digits each."""
    return catalogue()[key][lang].format(**{name: number(value, lang) for name, value in values.items()})


def group_name(group: str, lang: Language) -> str:
    """A sensor as people call it; the name of a column as it is."""
    known = catalogue().get(f"sensor_{group}")
    return known[lang] if known else group


def largest_of(group: str, axis: str, lang: Language) -> str:
    """`, the largest of the gyro`; nothing for a column that stands alone."""
    return "" if group == axis else say(lang, "largest_of", group=group_name(group, lang))
