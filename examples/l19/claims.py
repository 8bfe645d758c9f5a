"""What an example claims: one figure and the band it must stay in; printed, asserted, kept for RESULTATS.md.

Not an example: the scripts of this folder import it.  `SCRIPT.jsonl` beside the figures holds one claim a
line; `factorlab l19 rapport` gathers them.
"""

import json

from figures import french, out_folder, say, script_name

_begun = set()


def claim(item, quantity, value, unit="", *, low=None, high=None, source="simulé"):
    """Assert that a figure is in its band, print it, and keep it.

    Parameters
    ----------
    item : str
        Id of the course: "F1", "TP4a", "D3" …
    quantity : str
        What was measured, in French, without the value.
    value : float
        In the unit that is shown.
    unit : str
        "°", "m/s²", "px", "%" …; empty for a pure number.
    low, high : float, optional
        The band, bounds included; neither for a figure that is told but not judged (a time).
    source : str
        What it was measured on: "simulé", "MPU-6050", "photos OpenCV" …
    """
    value = float(value)
    row = {"item": item, "quantity": quantity, "value": value, "unit": unit, "low": low, "high": high}
    _keep(row | {"source": source})
    say(f"{item} : {quantity} = {value:.4g}{' ' if unit else ''}{unit}{_said(low, high)}")
    assert low is None or value >= low, french(f"{quantity} : {value:.4g} {unit}, au moins {low:g} attendu")
    assert high is None or value <= high, french(f"{quantity} : {value:.4g} {unit}, au plus {high:g} attendu")


def table(title, headings, rows):
    """Keep a table for RESULTATS.md: what is told beside the claims, and not judged.

    Parameters
    ----------
    title : str
        What it shows, in French.
    headings : sequence
        A name, or a name and a unit, for each column.
    rows : sequence of sequences
        Words, numbers, or None for a dash.
    """
    cells = [[c if c is None or isinstance(c, str) else float(c) for c in row] for row in rows]
    _keep({"title": title, "headings": list(headings), "rows": cells})


def _keep(row):
    path = out_folder() / f"{script_name()}.jsonl"
    with path.open("a" if path in _begun else "w", encoding="utf-8") as file:
        file.write(json.dumps(row, ensure_ascii=False) + "\n")
    _begun.add(path)


def _said(low, high):
    if low is None and high is None:
        return ""
    if low is None:
        return f" (au plus {high:g})"
    return f" (au moins {low:g})" if high is None else f" (de {low:g} à {high:g})"
