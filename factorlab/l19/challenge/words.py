"""What the verdicts of challenge D1 say, part by part, and what to do about each."""

from __future__ import annotations

from factorlab.l19.challenge.judge import Row
from factorlab.l19.challenge.measures import NEVER_S, Measures
from factorlab.l19.challenge.scoring import HONEST, Part
from factorlab.report.document import Status, Verdict
from factorlab.report.words import number

__all__ = ["GOOD", "HEADINGS", "METRICS", "cells_of", "points", "verdict_of"]

GOOD = 0.8  # share of the points from which there is nothing to mend
LOST_C = 2.0  # an error on the plateau that no noise makes
UNITS = {"rampe": "°C", "palier": "°C", "retard": "s", "aberrante": "°C", "σ": ""}
METRICS = {
    "rampe": "RMS sur la rampe",
    "palier": "RMS sur le palier",
    "retard": "retard à 90 %",
    "aberrante": "effet de l'aberrante",
    "σ": "(erreur / σ)² moyen",
}
HEADINGS = (
    "filtre",
    ("RMS rampe", "°C"),
    ("RMS palier", "°C"),
    ("retard 90 %", "s"),
    ("aberrante", "°C"),
    "(err./σ)²",
    "note / 20",
)


def cells_of(row: Row) -> tuple[str | float | None, ...]:
    """A row of the table, its score with one decimal."""
    found = row.measures
    late = "jamais" if found.delay_s >= NEVER_S else found.delay_s
    return row.name, found.ramp, found.plateau, late, found.outlier, found.nees, points(row.score)


def points(value: float) -> str:
    """Points with one decimal, as French writes them."""
    return f"{value:.1f}".replace(".", ",")


def verdict_of(part: Part, found: Measures, ours: Measures) -> Verdict:
    """One line: the value, what it means beside our filter, what to do where points were lost."""
    value, reference = _value(part.name, found), _value(part.name, ours)
    status: Status = "PASS" if part.share >= GOOD else "WARN"
    meaning = f"{points(part.points)} / {part.of:.0f} points ; {_beside(part, value, reference)}"
    action = "" if status == "PASS" else _action(part, found)
    return Verdict(METRICS[part.name], value, None, status, meaning, action, UNITS[part.name])


def _value(name: str, found: Measures) -> float | None:
    return {
        "rampe": found.ramp,
        "palier": found.plateau,
        "retard": found.delay_s,
        "aberrante": found.outlier,
        "σ": found.nees,
    }[name]


def _beside(part: Part, value: float | None, reference: float | None) -> str:
    if part.name == "σ":
        return (
            "pas de σ annoncé"
            if value is None
            else "1 attendu si σ est honnête, tous les points de 0,6 à 1,6"
        )
    told = number(reference, "fr")
    return f"{'mieux que' if part.beats else 'à comparer à'} {told} {UNITS[part.name]} pour le nôtre"


def _action(part: Part, found: Measures) -> str:
    if found.plateau > LOST_C:
        if part.name != "palier":
            return "reprenez d'abord le palier : un filtre qui se perd manque tout le reste"
        return (
            "le filtre se perd après le coude : son portillon refuse tout, ou q est trop petit ; augmentez "
            "q, ou rouvrez le portillon après quelques refus de suite"
        )
    if part.name == "σ":
        return _about_sigma(found.nees)
    return {
        "rampe": "un filtre sans pente traîne de pente × retard : mettez la pente dans l'état, avec un q "
        "assez petit pour moyenner",
        "palier": "il laisse passer trop de bruit : moyennez davantage (q ou a plus petit, R mesuré)",
        "retard": "il est trop lent : q plus grand, ou une fenêtre plus courte",
        "aberrante": "refusez la mesure dont ν²/S dépasse 10,8 (portillon à 99,9 %), ou prenez une médiane",
    }[part.name]


def _about_sigma(nees: float | None) -> str:
    if nees is None:
        return "renvoyez aussi σ, la racine de P[0, 0] : un tableau (N, 2)"
    if nees > HONEST[1]:
        factor = number(nees**0.5, "fr", 2)
        return f"σ est trop petit : les erreurs sont {factor} fois ce qu'il annonce ; R ou q plus grand"
    return "σ est trop grand : le filtre vaut mieux que ce qu'il annonce ; R ou q plus petit"
