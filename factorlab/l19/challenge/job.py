"""What runs beside a student's file, in its process: `filtrer` on every recording, nothing judged yet."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.challenge.causal import causal_pairs
from factorlab.l19.challenge.measures import Pair, readings_for
from factorlab.l19.challenge.trials import hidden_trials, public_trial
from factorlab.l19.exercises.calling import Caller
from factorlab.l19.exercises.fault import Stumble

__all__ = ["ASKED", "filter_all", "readings_asked"]

Array = NDArray[np.float64]
ASKED = "filtrer"
CALL_S = 10.0  # for one recording


def readings_asked(seed: int) -> list[Pair]:
    """Every (t, z) that the file is given: the public one, those behind the score, those about causality."""
    return [_pair_of_public(), *readings_for(hidden_trials(seed)), *causal_pairs(public_trial())]


def filter_all(names: Mapping[str, Any], arguments: Mapping[str, Any], emit: Callable[[Any], None]) -> None:
    """Call `filtrer` on each recording and emit {"values": rows}, or what kept it from that, and stop."""
    smooth = names.get(ASKED)
    if not callable(smooth):
        own = [name for name, value in names.items() if callable(value) and not name.startswith("_")]
        emit({"missing": get_close_matches(ASKED, own, n=1, cutoff=0.5)})
        return
    call = Caller(names["__file__"], CALL_S)
    for t, z in readings_asked(arguments["seed"]):
        given = t.copy(), z.copy()
        try:
            values, wrong = _as_rows(call(smooth, *given), len(z))
        except Stumble as stumble:
            emit({"fault": stumble.fault.to_json()})
            return
        if not np.array_equal(given[1], z) or not np.array_equal(given[0], t):
            wrong = f"{ASKED} change le tableau qu'on lui donne ; commencez par z = np.array(z)"
        if wrong:
            emit({"wrong": wrong})
            return
        emit({"values": values.tolist()})


def _pair_of_public() -> Pair:
    trial = public_trial()
    return trial.t, trial.z


def _as_rows(given: Any, count: int) -> tuple[Array, str]:
    """Estimates (N,) or (N, 2), and what is wrong with them in one sentence."""
    values: Array = np.zeros(0)
    if given is None:
        return values, f"{ASKED} n'a rien renvoyé : un return oublié ?"
    if np.iscomplexobj(given):
        return values, f"{ASKED} doit renvoyer des nombres réels ; reçu : des nombres complexes"
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        kind = type(given).__name__
        return values, f"{ASKED} doit renvoyer un tableau de {count} nombres ; reçu : {kind}"
    if isinstance(given, tuple) and values.shape == (2, count):
        values = values.T  # estimates and their σ, as a pair
    if values.ndim == 2 and values.shape[1] == 1:
        values = values[:, 0]
    return values, _wrong_with(values, count)


def _wrong_with(values: Array, count: int) -> str:
    """What keeps numbers from being estimates for N readings; nothing, as a rule."""
    if values.shape not in {(count,), (count, 2)}:
        return (
            f"pour {count} mesures, {ASKED} doit renvoyer ({count},) estimations, ou ({count}, 2) avec leurs "
            f"σ ; reçu : {values.shape}"
        )
    bad = np.flatnonzero(~np.isfinite(values.reshape(count, -1)).all(axis=1))
    if len(bad):
        return f"l'estimation n° {bad[0]} n'est pas un nombre fini ({len(bad)} sur {count} en tout)"
    if values.ndim == 2 and (values[:, 1] <= 0.0).any():
        row = int(np.flatnonzero(values[:, 1] <= 0.0)[0])
        return f"σ doit être positif ; à l'instant n° {row} il vaut {values[row, 1]:g}"
    return ""
