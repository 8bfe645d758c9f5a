"""Whether a filter looks ahead: its past must not change with what comes later."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.challenge.measures import Pair
from factorlab.l19.challenge.trials import Trial

__all__ = ["causal_pairs", "why_not_causal"]

Array = NDArray[np.float64]
CUTS = (60, 125, 201)  # rows from which the readings are others, or end
CLOSE_C = 1e-6


def causal_pairs(trial: Trial) -> list[Pair]:
    """The recording twice, with another future after each cut, and cut short there."""
    pairs = [(trial.t, trial.z), (trial.t, trial.z)]
    for cut in CUTS:
        other = trial.z.copy()
        other[cut:] = other[cut:][::-1] + 5.0
        pairs += [(trial.t, other), (trial.t[:cut], trial.z[:cut])]
    return pairs


def why_not_causal(outputs: Sequence[Array]) -> str:
    """One sentence about the outputs for `causal_pairs`; empty where nothing speaks against the filter."""
    first, again = outputs[:2]
    if np.abs(again - first).max() > CLOSE_C:
        return (
            "le même enregistrement, filtré deux fois, ne donne pas deux fois la même chose : une variable "
            "globale garde-t-elle la mémoire de l'appel précédent, ou y a-t-il un tirage au hasard ?"
        )
    for k, cut in enumerate(CUTS):
        changed, short = (_first_moved(one[:cut], first[:cut]) for one in outputs[2 + 2 * k : 4 + 2 * k])
        if changed is not None:
            return f"si les mesures changent à t = {cut} s, l'estimation à t = {changed} s change déjà"
        if short is not None:
            return (
                f"sans les mesures à partir de t = {cut} s, l'estimation à t = {short} s n'est plus la même "
                "(la longueur ou la moyenne de tout l'enregistrement sert-elle ?)"
            )
    return ""


def _first_moved(values: Array, before: Array) -> int | None:
    """First row at which two outputs differ."""
    moved = np.flatnonzero(np.abs(values - before).reshape(len(before), -1).max(axis=1) > CLOSE_C)
    return int(moved[0]) if len(moved) else None
