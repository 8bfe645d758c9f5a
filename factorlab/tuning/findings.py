"""What may be believed of a tuning, and whether the filter is honest with it."""

from __future__ import annotations

from factorlab.compare.verdict import Finding, Status
from factorlab.datasets import Dataset
from sequential.errors import FactorlabError
from sequential.evaluate import diagnose
from sequential.filters import ExtendedKalmanFilter
from sequential.run import run
from sequential.tuning import Tuning

__all__ = ["findings_at_rest", "findings_of"]

ORDER = {"FAIL": 0, "WARN": 1, "PASS": 2}


def findings_of(dataset: Dataset, found: Tuning, max_gap: float | None = None) -> tuple[Finding, ...]:
    """The search, the knobs that the readings do not determine, and the innovations afterwards."""
    told = list(_of_search(found))
    told += [_doubt(found, name) for name in found.unidentified]
    told += _of_innovations(dataset, found, max_gap)
    return tuple(sorted(told, key=lambda one: ORDER[one.status]))


def _of_search(found: Tuning) -> list[Finding]:
    if not found.message:
        return []
    status: Status = "FAIL" if found.method == "nis" and not found.converged else "WARN"
    action = "mend what the message names, then tune again" if status == "FAIL" else ""
    return [Finding("search", None, None, status, found.message, action)]


def _doubt(found: Tuning, name: str) -> Finding:
    low, high = found.interval(name)
    action = "fix it from a data sheet or a recording at rest, or record longer and with more motion"
    return Finding(name, found.values[name], (low, high), "WARN", found.doubt(name), action)


def _of_innovations(dataset: Dataset, found: Tuning, max_gap: float | None) -> list[Finding]:
    """The diagnosis of a filter with the new noise; a level that a loss or gate explains is a warning."""
    if found.model is None:
        return []
    try:
        after = run(ExtendedKalmanFilter(), found.model, dataset.log, max_gap=max_gap)
    except FactorlabError as error:
        return [Finding("filter", None, None, "FAIL", " ".join(str(error).split()), "see the message")]
    told = []
    for one in diagnose(after, found.model):
        honest = found.after is not None and one.sensor in found.after.nis
        explained = honest and found.after.nis[one.sensor].inside_band  # type: ignore[union-attr]
        status: Status = (
            "WARN" if one.level == "FAIL" and one.metric == "mean NIS" and explained else one.level
        )
        metric = one.metric if one.sensor in one.metric or not one.sensor else f"{one.metric} of {one.sensor}"
        told.append(Finding(metric, one.value, one.band, status, one.meaning, one.advice, "ekf", one.sensor))
    return told


def findings_at_rest(name: str, found: Tuning) -> tuple[Finding, ...]:
    """Whether the recording was at rest and its noise white."""
    if found.message:
        status: Status = "WARN" if found.converged else "FAIL"
        action = "take R from a part that was still" if status == "FAIL" else ""
        return (Finding(f"rest of {name}", None, None, status, found.message, action, "", name),)
    widest = max(found.values, key=lambda one: found.interval(one)[1] / found.interval(one)[0])
    low, high = found.interval(widest)
    meaning = f"{name} was still and its noise is white; σ is known within a factor {(high / low) ** 0.5:.3g}"
    return (Finding(f"rest of {name}", None, None, "PASS", meaning, "", "", name),)
