"""The verdict on a run as a diagnosis: which sensor, by how much, when, and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sequential.evaluate.blame import Blame
from sequential.evaluate.consistency import Consistency, nis_summary, whole_nis
from sequential.evaluate.moments import Tail, pauses, tail, worst_span
from sequential.evaluate.whiteness import whiteness
from sequential.history import Innovations, Run
from sequential.model import SensorModel, StateSpace

__all__ = ["Finding", "diagnose"]

Array = NDArray[np.float64]
Level = Literal["PASS", "WARN", "FAIL"]
ORDER = {"FAIL": 0, "WARN": 1, "PASS": 2}

TOLERABLE = 1.25  # a factor on σ within this is a warning, beyond it a failure
ENOUGH = 30  # readings: with fewer, correlation and bias are not judged
SURE = 0.001  # p-value below which correlation or bias is reported: a verdict makes many tests
LEANS = 0.2  # σ: a smaller bias is not worth a sentence
TOO_MANY = 0.2  # share of gated readings that makes a failure


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of a verdict; `str(finding)` is a sentence.

    `sensor` is empty where the finding is about the whole run, `band` the 95 % one, None where there is none.
    """

    level: Level
    sensor: str
    metric: str
    value: float
    band: tuple[float, float] | None
    meaning: str
    advice: str

    def __str__(self) -> str:
        return f"{self.meaning}; {self.advice}" if self.advice else self.meaning


def diagnose(run: Run, model: StateSpace, balance: Blame | None = None) -> list[Finding]:
    """Say what the innovations of a run reveal, worst first.

    Parameters
    ----------
    run : of any estimator; a filter's innovations say more than a smoother's leave-one-out residuals
    balance : from `blame(problem)`, which tells process noise from sensor noise

    Returns
    -------
    list of Finding
        Times are seconds since the run's first node.
    """
    found = list(_of_solve(run))
    for name, innovations in run.innovations.items():
        seen = _Seen.of(name, model.sensors[name], innovations, run)
        found += [*_of_level(seen, balance), *_of_tail(seen), *_of_gate(seen)]
        found += [*_of_whiteness(seen), *_of_pauses(seen)]
    if balance is not None:
        found.append(_of_balance(balance))
    return sorted(found, key=lambda finding: ORDER[finding.level])


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Accepted readings of one sensor, in seconds since the run began."""

    name: str
    sensor: SensorModel
    innovations: Innovations
    t: Array
    nis: Array
    whole: float
    summary: Consistency
    few: Tail | None  # where a few readings carry the sum and the others are below what is expected

    @classmethod
    def of(cls, name: str, sensor: SensorModel, innovations: Innovations, run: Run) -> _Seen:
        t = (innovations.t - run.t[0]) * 1e-9
        accepted = innovations.accepted
        nis = whole_nis(innovations)[accepted]
        whole = float(run.t[-1] - run.t[0]) * 1e-9
        summary = nis_summary(innovations)
        few = tail(t[accepted], nis, whole) if summary.median < summary.expected_median else None
        return cls(name, sensor, innovations, t[accepted], nis, whole, summary, few)

    @property
    def title(self) -> str:
        kind = self.innovations.kind
        return f"NIS of {self.name}" if kind == "filter" else f"{kind} NIS of {self.name}"


def _of_solve(run: Run) -> Iterator[Finding]:
    report = run.report
    if not report.converged:
        meaning = f"{report.estimator} did not converge: {report.message or 'no reason given'}"
        advice = "do not quote its figures; allow more iterations or mend the start"
        yield Finding("FAIL", "", "solve", float(report.iterations), None, meaning, advice)


def _of_level(seen: _Seen, balance: Blame | None) -> Iterator[Finding]:
    """Whether the mean NIS is what it should be."""
    s = seen.summary
    if not s.count:
        meaning = f"no reading of {seen.name} was used: its gate rejected all {len(seen.innovations.t)}"
        yield Finding("FAIL", seen.name, "mean NIS", s.mean, None, meaning, _gate_advice(seen.name))
        return
    sentence = f"{seen.title} is {s.mean:.3g}, {s.expected:g} expected: {s.verdict}"
    if s.inside_band:
        yield Finding("PASS", seen.name, "mean NIS", s.mean, s.band, sentence, "")
        return
    when = worst_span(seen.t, seen.nis - s.expected, seen.whole) if s.mean > s.expected else None
    meaning = f"{sentence}; worst during {when}" if when else sentence
    level: Level = "WARN" if 1.0 / TOLERABLE <= s.factor <= TOLERABLE else "FAIL"
    yield Finding(level, seen.name, "mean NIS", s.mean, s.band, meaning, _level_advice(seen, balance))


def _level_advice(seen: _Seen, balance: Blame | None) -> str:
    s = seen.summary
    if seen.few is not None and s.mean > s.expected:
        return f"{seen.few.few} of {seen.few.count} readings make it so: see to them before scaling any noise"
    if balance is not None and balance.guilty is not None and balance.clear:
        guilty = balance.guilty
        after = guilty.nis.get(seen.name, float("nan"))
        return f"{guilty.name} {guilty.off}: with that factor the mean NIS is {after:.2g}"
    size = "small" if s.mean > s.expected else "large"
    return (
        f"either noise_cov of {seen.name} or the process noise is too {size}: a factor {s.factor:.2g} on the "
        f"standard deviations would bring the mean NIS to {s.expected:g}"
    )


def _of_tail(seen: _Seen) -> Iterator[Finding]:
    """Whether a few readings make the mean."""
    s = seen.summary
    few = seen.few
    if few is None:
        return
    what = (
        f"a burst during t = {few.burst[0]:.0f}-{few.burst[1]:.0f} s" if few.burst else "outliers or bursts"
    )
    meaning = (
        f"{few.few} of {few.count} readings of {seen.name} carry {few.share:.0%} of the NIS, whose median is "
        f"{s.median:.2g} where {s.expected_median:.3g} is expected: {what}, not a level"
    )
    yield Finding("WARN", seen.name, "tail of the NIS", few.share, None, meaning, _tail_advice(seen, few))


def _tail_advice(seen: _Seen, few: Tail) -> str:
    if few.burst:
        return "look at what happens there that the model does not know"
    if seen.sensor.loss is not None:
        kind, k = seen.sensor.loss.kind, seen.sensor.loss.k
        return f"the {kind} loss of {seen.name} (k = {k:g}) weighs them down already; a smaller k does more"
    return f"give {seen.name} a gate (0.999) or a loss (Loss('huber', 1.345)) before scaling its noise"


def _gate_advice(name: str) -> str:
    return f"widen the prior or the noise, or run once without the gate of {name} to see its residuals"


def _of_gate(seen: _Seen) -> Iterator[Finding]:
    """Whether the gate rejects more than chance would."""
    s, gate = seen.summary, seen.sensor.gate
    count = len(seen.innovations.t)
    if gate is None or not s.count:
        return
    expected = 1.0 - gate
    most = expected + 3.0 * float(np.sqrt(expected * gate / count)) + 1.0 / count
    share = s.fraction_gated
    meaning = f"the gate of {seen.name} rejects {share:.2%} of {count} readings, {expected:.2%} expected"
    if share <= most:
        yield Finding("PASS", seen.name, "gated", share, (0.0, most), meaning, "")
        return
    rejected = seen.innovations.t[~seen.innovations.accepted]
    t = (rejected - seen.innovations.t[0]) * 1e-9 + (seen.t[0] if len(seen.t) else 0.0)
    when = worst_span(t, np.ones(len(t)), seen.whole)
    where = f", most during t = {when.start:.0f}-{when.stop:.0f} s" if when and when.readings > 1 else ""
    level: Level = "FAIL" if share > TOO_MANY else "WARN"
    yield Finding(level, seen.name, "gated", share, (0.0, most), f"{meaning}{where}", _gate_advice(seen.name))


def _of_whiteness(seen: _Seen) -> Iterator[Finding]:
    """Whether one innovation predicts the next, and whether they lean to one side; a filter's only."""
    if seen.innovations.kind != "filter" or seen.summary.count < ENOUGH:
        return
    w = whiteness(seen.innovations, level=SURE)
    lag = float(w.correlation[0][np.argmax(np.abs(w.correlation[0]))])
    band = (-w.bound, w.bound)
    known = f"{lag:+.2f} from one to the next, within ±{w.bound:.2f} expected"
    if w.white:
        yield Finding("PASS", seen.name, "whiteness", lag, band, f"innovations of {seen.name} are white", "")
    elif abs(lag) <= w.bound:
        meaning = f"innovations of {seen.name} are correlated over several readings (p = {w.p_value:.1g})"
        yield Finding("WARN", seen.name, "whiteness", lag, band, meaning, "look for a period or a slow drift")
    else:
        advice = (
            "the filter follows too slowly: raise the process noise, or estimate what drifts as a state"
            if lag > 0.0
            else "the filter follows each reading too closely: lower the process noise or raise noise_cov"
        )
        meaning = f"innovations of {seen.name} are correlated ({known})"
        yield Finding("WARN", seen.name, "whiteness", lag, band, meaning, advice)
    axis = int(np.argmax(np.abs(w.mean)))
    lean = float(w.mean[axis])
    if not w.unbiased and abs(lean) > LEANS:
        label = seen.sensor.manifold.labels()[axis]
        meaning = f"residuals of {seen.name} lean by {lean:+.2f} σ along {label}, ±{w.bound:.2f} expected"
        advice = "an offset of the sensor, its mounting or its clock: measure it, or estimate it as a state"
        yield Finding("WARN", seen.name, "bias", lean, band, meaning, advice)


def _of_pauses(seen: _Seen) -> Iterator[Finding]:
    """Whether the sensor falls silent."""
    silent = pauses((seen.innovations.t - seen.innovations.t[0]) * 1e-9, seen.whole) if len(seen.t) else None
    if silent is None:
        return
    begins = silent.begins + float(seen.t[0])
    meaning = (
        f"{seen.name} is silent for {silent.longest:.3g} s from t = {begins:.0f} s on "
        f"(usual interval {silent.usual:.3g} s, {silent.count} such pause{'s' if silent.count > 1 else ''})"
    )
    advice = "until it speaks again the state rests on the process alone: read its σ there"
    yield Finding("WARN", seen.name, "longest pause", silent.longest, None, meaning, advice)


def _of_balance(balance: Blame) -> Finding:
    best = balance.candidates[0]
    if balance.guilty is None:
        return Finding("PASS", "", "noise balance", best.factor, None, balance.verdict, "")
    level: Level = "WARN" if 1.0 / TOLERABLE <= best.factor <= TOLERABLE else "FAIL"
    if not balance.clear:
        return Finding(
            "WARN", "", "noise balance", best.factor, None, balance.verdict, "fit both with --tune"
        )
    advice = f"multiply its standard deviations by {best.factor:.2g}, or fit all noises with --tune"
    return Finding(level, "", "noise balance", best.factor, None, balance.verdict, advice)
