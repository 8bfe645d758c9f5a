"""A verdict as a student reads it: what is right, the first thing to mend, what else, and remarks."""

from __future__ import annotations

from collections.abc import Iterator

from factorlab.l19.exercises.checking import ExerciseVerdict, FileVerdict
from factorlab.l19.exercises.finding import FAIL, PASS, WARN, Finding

__all__ = ["verdict_lines"]

TITLES = {
    "E1": "filtre de Kalman",
    "E2": "médiane glissante et sauts",
    "E3": "capteur infrarouge",
    "E4": "composantes connexes",
    "K3": "angles repliés (facultatif)",
    "D3": "points sigma (facultatif)",
}
WORDS = {PASS: "juste", WARN: "juste, avec des remarques", FAIL: "à corriger"}
COLOURS = {PASS: "green", WARN: "green", FAIL: "red"}
Line = tuple[str, str | None]


def verdict_lines(verdict: FileVerdict, *, most: int | None = 3) -> Iterator[Line]:
    """Lines of text, each with its colour or None.

    Parameters
    ----------
    verdict : FileVerdict
    most : int, optional
        How many things to mend are shown an exercise; all where None.
    """
    yield str(verdict.path), None
    if verdict.syntax is not None:
        yield "  à corriger : le fichier n'est pas encore du Python", "red"
        yield f"    {verdict.syntax.where or verdict.syntax.said}", None
        yield f"    {verdict.syntax.said}", None
    if verdict.stopped is not None:
        yield f"  Le fichier s'arrête avant sa fin, {verdict.stopped.where or 'sans dire où'}", "yellow"
        yield f"    {verdict.stopped.said}", None
        yield "    Ce qui est défini avant est vérifié quand même.", None
    for one in verdict.exercises:
        yield from _exercise(one, most)
    yield "", None


def _exercise(one: ExerciseVerdict, most: int | None) -> Iterator[Line]:
    word = one.verdict
    yield f"  {one.exercise}, {TITLES[one.exercise]} : {WORDS[word]}", COLOURS[word]
    for finding in one.of(PASS):
        yield f"    ✓ {finding.title}{f' — {finding.said}' if finding.said else ''}", None
    wrong = one.of(FAIL)
    for number, finding in enumerate(wrong[:most]):
        yield f"    ✗ {'à corriger d’abord : ' if number == 0 else ''}{finding.title}", "red"
        yield from ((f"      {text}", None) for text in _mending(finding, whole=number == 0))
    if most is not None and len(wrong) > most:
        left = len(wrong) - most
        others = "une autre" if left == 1 else f"{left} autres"
        yield f"    … et {others}, peut-être par la même cause (--tout montre tout)", None
    for finding in one.of(WARN):
        yield f"    • remarque, {finding.title} : {finding.said}", "yellow"


def _mending(finding: Finding, *, whole: bool) -> Iterator[str]:
    """What is wrong, its likely cause, and, for the first one, the example to type again."""
    if finding.said:
        yield finding.said
    if finding.line is not None:
        yield f"ligne {finding.line} : {finding.code}"
    if finding.expected or finding.got:
        yield f"attendu : {finding.expected}"
        yield f"obtenu  : {finding.got}"
    if finding.cause:
        yield f"cause probable : {finding.cause} ; {finding.mend}"
    elif finding.mend:
        yield f"piste : {finding.mend}"
    if finding.example and whole:
        yield "à retaper :"
        yield from (f"  {row}" for row in finding.example.splitlines())
