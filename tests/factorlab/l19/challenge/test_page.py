"""The page about challenge D1 says what the challenge does."""

import re
from pathlib import Path

import pytest

from factorlab.l19.challenge.judge import LIMIT_S, judge_rivals
from factorlab.l19.challenge.measures import STEP_DRAWS
from factorlab.l19.challenge.scoring import POINTS
from factorlab.l19.challenge.trials import SETTLED, WARM_UP

PAGE = (Path(__file__).resolve().parents[4] / "docs" / "l19_defi.md").read_text(encoding="utf-8")


def rows_below(heading):
    """Cells of the table whose first heading this is."""
    table = PAGE[PAGE.index(f"| {heading} |") :].split("\n\n")[0].splitlines()[2:]
    return {row[0]: row[1:] for row in ([c.strip() for c in line.strip("|").split("|")] for line in table)}


def number(cell):
    """The number of a cell, and half of its last digit."""
    text = re.match(r"[\d,]+", cell)[0]
    decimals = len(text.partition(",")[2])
    return float(text.replace(",", ".")), 0.51 * 10.0**-decimals


def test_our_filters_are_worth_what_the_page_says():
    told = rows_below("filtre")
    judged = {row.name.removesuffix(" (le nôtre)"): row for row in judge_rivals().rivals}
    assert list(told) == list(judged)
    for name, cells in told.items():
        found = judged[name].measures
        values = (found.ramp, found.plateau, found.delay_s, found.outlier, found.nees, judged[name].score)
        for cell, value in zip(cells, values, strict=True):
            if cell == "–":
                assert value is None
            else:
                said, half = number(cell)
                assert value == pytest.approx(said, abs=half)


def test_points_and_settings_are_the_page_s():
    assert {name: float(cells[0]) for name, cells in rows_below("partie").items()} == POINTS
    for said in (
        f"t = {WARM_UP} s",
        f"{SETTLED} s après le coude",
        f"sur {STEP_DRAWS} tirages",
        f"{LIMIT_S:g} s",
    ):
        assert said in PAGE
