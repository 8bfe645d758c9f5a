"""A student's file, run apart, measured on recordings it has not seen, and scored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.challenge.causal import causal_pairs, why_not_causal
from factorlab.l19.challenge.job import ASKED
from factorlab.l19.challenge.measures import Measures, measure, measured_filter
from factorlab.l19.challenge.rivals import OURS, RIVALS, TunedNoise, rivals, tuned_noise
from factorlab.l19.challenge.scoring import Part, parts_of, score_of
from factorlab.l19.challenge.trials import HIDDEN_SEED, hidden_trials, public_trial
from factorlab.l19.exercises import run_student
from factorlab.l19.exercises.fault import Fault
from sequential.errors import DataError

__all__ = ["LIMIT_S", "Judged", "Row", "judge_file", "judge_rivals"]

Array = NDArray[np.float64]
LIMIT_S = 60.0
JOB = "factorlab.l19.challenge.job:filter_all"


@dataclass(frozen=True, slots=True)
class Row:
    """One filter of the table."""

    name: str
    measures: Measures
    parts: tuple[Part, ...]

    @property
    def score(self) -> float:
        """Out of twenty."""
        return score_of(self.parts)


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A student's file beside our filters; `fault` says in one sentence why there is no score.

    `public` is what the file makes of the public recording, (N,) or (N, 2).
    """

    rivals: tuple[Row, ...]
    tuned: TunedNoise
    row: Row | None = None
    public: Array | None = None
    fault: str = ""
    action: str = ""


def judge_rivals(seed: int = HIDDEN_SEED) -> Judged:
    """Our filters alone, on the recordings of the score."""
    trials, tuned = hidden_trials(seed), tuned_noise(public_trial())
    found = {name: measured_filter(smooth, trials) for name, smooth in rivals(tuned).items()}
    return Judged(tuple(Row(name, one, _parts(one, found)) for name, one in found.items()), tuned)


def judge_file(path: Path, seed: int = HIDDEN_SEED, limit_s: float = LIMIT_S) -> Judged:
    """Run `filtrer` of a file in a process of its own and score it.

    Parameters
    ----------
    seed : of the hidden recordings
    limit_s : what all of it may take, s

    Raises
    ------
    DataError
        where there is no such file.
    """
    if not path.is_file():
        raise DataError(f"il n'y a pas de fichier {path} ; donnez celui qui définit {ASKED}(t, z)")
    table = judge_rivals(seed)
    run = run_student(path, JOB, {"seed": seed}, limit_s=limit_s, loading_s=limit_s / 2)
    fault, action = _fault(run.events, run.stopped, run.fault)
    if fault:
        return Judged(table.rivals, table.tuned, fault=fault, action=action)
    outputs = [np.array(event["values"]) for event in run.events]
    if len({one.ndim for one in outputs}) > 1:
        fault = f"{ASKED} renvoie tantôt les estimations seules, tantôt avec σ"
        return Judged(table.rivals, table.tuned, fault=fault, action="renvoyez toujours la même forme")
    count = len(causal_pairs(public_trial()))
    if fault := why_not_causal(outputs[-count:]):
        action = "à l'instant t[k], n'utilisez que z[0] … z[k] ; ni moyenne centrée, ni aller-retour"
        return Judged(table.rivals, table.tuned, public=outputs[0], fault=fault, action=action)
    found = measure(hidden_trials(seed), outputs[1:-count])
    others = {row.name: row.measures for row in table.rivals}
    row = Row("votre filtre", found, _parts(found, others))
    return Judged(table.rivals, table.tuned, row, outputs[0])


def _parts(found: Measures, others: Mapping[str, Measures]) -> tuple[Part, ...]:
    return parts_of(found, others[RIVALS[0]], others[OURS])


def _fault(events: tuple[Any, ...], stopped: Fault | None, ended: Fault | None) -> tuple[str, str]:
    """Why there is no score, and what to do; the first thing that went wrong."""
    last = events[-1] if events else {}
    if stopped is not None and ("missing" in last or not events):
        return f"votre fichier s'arrête avant la fin : {stopped.said}", _at(stopped)
    if "missing" in last:
        near = last["missing"]
        hint = f" ; {near[0]} en est-il un autre nom ?" if near else ""
        return f"votre fichier ne définit pas {ASKED}{hint}", f"écrivez def {ASKED}(t, z): …"
    if "fault" in last:
        fault = Fault(**last["fault"])
        called = f"{ASKED} est appelé avec deux tableaux : def {ASKED}(t, z)"
        return f"{ASKED} s'est arrêté : {fault.said}", fault.where or called
    if "wrong" in last:
        return last["wrong"], "« factorlab l19 defi -o DOSSIER » écrit un exemple : mon_filtre.py"
    if ended is not None:
        return f"votre programme s'est arrêté : {ended.said}", _at(ended)
    return "", ""


def _at(fault: Fault) -> str:
    return fault.where or "relisez le fichier ; les lignes d'essai vont sous if __name__ == '__main__'"
