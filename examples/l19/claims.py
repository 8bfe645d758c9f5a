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
    path = out_folder() / f"{script_name()}.jsonl"
    with path.open("a" if path in _begun else "w", encoding="utf-8") as file:
        file.write(json.dumps(row | {"source": source}, ensure_ascii=False) + "\n")
    _begun.add(path)
    say(f"{item} : {quantity} = {value:.4g}{' ' if unit else ''}{unit}{_said(low, high)}")
    assert low is None or value >= low, french(f"{quantity} : {value:.4g} {unit}, au moins {low:g} attendu")
    assert high is None or value <= high, french(f"{quantity} : {value:.4g} {unit}, au plus {high:g} attendu")


def _said(low, high):
    if low is None and high is None:
        return ""
    if low is None:
        return f" (au plus {high:g})"
    return f" (au moins {low:g})" if high is None else f" (de {low:g} à {high:g})"
