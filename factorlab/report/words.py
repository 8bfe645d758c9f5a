"""The words of a page that are the same for every report, in English and in French, and its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from factorlab.compare.text import figure

__all__ = ["WORDS", "Language", "PageWords", "interval", "number"]

Language = Literal["en", "fr"]


@dataclass(frozen=True, slots=True)
class PageWords:
    """Headings and badges."""

    verdict: str
    metric: str
    value: str
    band: str
    meaning: str
    action: str
    nothing: str
    same_numbers: str
    between: tuple[str, str]  # two ends of an interval, and the same where one is negative
    badges: dict[str, str]


WORDS: dict[Language, PageWords] = {
    "en": PageWords(
        verdict="Verdict",
        metric="metric",
        value="value",
        band="95 % band",
        meaning="what it means",
        action="what to do",
        nothing="Nothing to judge.",
        same_numbers="The same numbers are in",
        between=(" – ", " to "),
        badges={"PASS": "PASS", "WARN": "WARN", "FAIL": "FAIL", "INFO": "INFO"},
    ),
    "fr": PageWords(
        verdict="Verdict",
        metric="grandeur",
        value="valeur",
        band="intervalle à 95 %",
        meaning="ce que cela veut dire",
        action="que faire",
        nothing="Rien à juger.",
        same_numbers="Les mêmes nombres sont dans",
        between=(" – ", " à "),
        badges={"PASS": "BON", "WARN": "ATTENTION", "FAIL": "MAUVAIS", "INFO": "INFO"},
    ),
}


def number(
    value: int | float | str | None,  # noqa: PYI041 - a count is written whole
    lang: Language = "en",
    digits: int = 3,
) -> str:
    """A number as a table writes it (`–` where there is none), with a decimal comma in French."""
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return f"{value}".replace("-", "−")
    text = figure(value, digits)
    return text.replace(".", ",") if lang == "fr" else text


def interval(limits: tuple[float, float] | None, lang: Language = "en") -> str:
    """Both ends of an interval, `–` where there is none, with digits enough to tell them apart."""
    if limits is None:
        return number(None)
    between = WORDS[lang].between[min(limits) < 0]
    written = [number(float(end), lang) for end in limits]
    for digits in range(4, 7):
        if written[0] == written[1]:
            written = [number(float(end), lang, digits) for end in limits]
    return between.join(written)
