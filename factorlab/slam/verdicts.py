"""What a table of SLAM estimators reveals: failures, overconfidence, and what smoothing bought."""

from __future__ import annotations

from factorlab.compare.honesty import NormalisedError
from factorlab.compare.text import figure
from factorlab.compare.verdict import ORDER, OVERCONFIDENT, PESSIMISTIC, Finding, Status
from factorlab.datasets.slam import SlamDataset
from factorlab.slam.engine import SlamRow
from factorlab.slam.estimators import KINDS
from factorlab.slam.loops import loop_finding
from sequential.errors import FactorlabError

__all__ = ["bought", "findings_of"]

LOOKS = 200  # about how often the claim of a filter is looked at
HONEST_CLAIM = 1.05
SAME_CHI2 = 1e-4  # relative: two solvers stand in the same minimum


def findings_of(dataset: SlamDataset, rows: tuple[SlamRow, ...]) -> tuple[Finding, ...]:
    """Failed solves, final costs beside the reference, honesty, and what smoothing bought; worst first."""
    found = [_failed(row) for row in rows if row.failed]
    found += [_unsettled(row) for row in rows if not row.failed and not row.converged]
    found += _costs(dataset, rows)
    found += [_honesty(row, row.scores.honesty) for row in rows if row.scores and row.scores.honesty]
    closed = [row for row in rows if row.loops is not None and row.name in {"batch", "isam2_final"}]
    for row in closed[-1:]:
        told_loops = row.loops and loop_finding(dataset, row.title, row.name, row.loops)
        found += [told_loops] if told_loops else []
    found += _claim(dataset, rows)
    if told := bought(rows):
        found.append(told)
    return tuple(sorted(found, key=lambda finding: ORDER[finding.status]))


def _failed(row: SlamRow) -> Finding:
    return Finding(
        f"{row.title}: solve", None, None, "FAIL", row.message, "leave it out, or mend the cause", row.name
    )


def _unsettled(row: SlamRow) -> Finding:
    meaning = row.message or "the iteration stopped before it settled"
    return Finding(f"{row.title}: solve", None, None, "WARN", meaning, "do not quote its figures", row.name)


def _costs(dataset: SlamDataset, rows: tuple[SlamRow, ...]) -> list[Finding]:
    """The best final χ² beside what others reached on the same file."""
    reference = dataset.reference.get("chi2")
    reached = [row for row in rows if row.chi2 is not None and row.name in {"batch", "isam2_final"}]
    if reference is None or not reached:
        return []
    best = min(reached, key=lambda row: row.chi2 or 0.0)
    assert best.chi2 is not None  # noqa: S101 - chosen by it
    gap = best.chi2 / reference - 1.0
    what = f"{best.title} ends at χ² = {best.chi2:.6g}; the best known to this project is {reference:.6g}"
    if gap <= SAME_CHI2:
        meaning = f"{what}: {'the same minimum' if gap > -SAME_CHI2 else 'a lower one'}"
        return [Finding("final χ²", best.chi2, None, "PASS", meaning, "", best.name)]
    action = "begin from another start: initial='lago', 'chordal' or 'steps'"
    return [Finding("final χ²", best.chi2, None, "WARN", f"{what}: a local minimum", action, best.name)]


def _honesty(row: SlamRow, honest: NormalisedError) -> Finding:
    factor = (honest.mean / honest.expected) ** 0.5
    low, high = honest.bootstrap_band95 or honest.band95
    fits = honest.inside or low <= honest.expected <= high
    status: Status = "FAIL" if factor > OVERCONFIDENT or factor < 1 / PESSIMISTIC else "WARN"
    per_freedom = f"ANEES {honest.mean / honest.expected:.2g} per degree of freedom, 1 expected"
    metric = f"{row.title}: normalised error of the pose"
    if fits:
        meaning, action, status = f"errors are as large as stated ({per_freedom})", "", "PASS"
    elif factor > 1:
        meaning = f"errors are {factor:.2g}x larger than stated ({per_freedom}): overconfident"
        action = _remedy(row)
    else:
        meaning = f"errors are {1 / factor:.2g}x smaller than stated ({per_freedom}): pessimistic"
        action = "the covariance is on the safe side; lower the noise if it matters"
    return Finding(metric, honest.mean, honest.band95, status, meaning, action, row.name)


def _remedy(row: SlamRow) -> str:
    if KINDS[row.name].solves == "ekf_slam":
        return (
            "it linearises each landmark anew at every pose and so believes that readings tell the heading "
            "of the whole map, which they do not (Huang, Mourikis, Roumeliotis 2010); smooth, or use "
            "first-estimates Jacobians"
        )
    return (
        "do not trust the covariance: noise that is correlated or too small, wrong matches, or a wrong model"
    )


def _claim(dataset: SlamDataset, rows: tuple[SlamRow, ...]) -> list[Finding]:
    """Why a filter is too sure: by how much it claims to see a turn of its whole world."""
    row = next((row for row in rows if row.name == "ekf_slam" and row.scores and row.scores.honesty), None)
    problem = dataset.problem
    if row is None or dataset.axes != 2 or "l" not in problem.kinds:
        return []
    from sequential.slam.observability import claimed_heading

    steps = len(problem.indices(problem.moving[0]))
    try:
        claim = claimed_heading(problem, every=max(1, steps // LOOKS))
    except FactorlabError:
        return []  # something measures the heading of this world: no claim can be too bold
    honest = claim.lost < HONEST_CLAIM
    action = "" if honest else "smooth, or EkfSlam(linearisation='first_estimates' or 'invariant')"
    status: Status = "PASS" if honest else "WARN"
    name = f"{row.title}: claim about the heading of the world"
    return [Finding(name, claim.lost, None, status, str(claim), action, row.name)]


def bought(rows: tuple[SlamRow, ...]) -> Finding | None:
    """What the later readings bought: first online estimate against the best one at the end."""
    scored = [row for row in rows if row.scores is not None and row.scores.against == "truth"]
    online = [row for row in scored if KINDS[row.name].part == "online"]
    final = [row for row in scored if KINDS[row.name].part == "final"]
    if not online or not final:
        return None
    first, best = online[0], min(final, key=lambda row: row.scores.rmse if row.scores else 0.0)
    assert first.scores is not None and best.scores is not None  # noqa: S101, PT018 - chosen by them
    ratio = first.scores.rmse / best.scores.rmse
    cost = ""
    if first.us_per_measurement and best.us_per_measurement:
        cost = (
            f"; {figure(first.us_per_measurement)} against {figure(best.us_per_measurement)} µs a measurement"
        )
    meaning = (
        f"{first.title} {figure(first.scores.rmse)} m while driving, "
        f"{best.title} {figure(best.scores.rmse)} m afterwards, "
        f"{_factor(ratio)}{_honesties(first, best)}{cost}"
    )
    return Finding("what smoothing bought", ratio, None, "PASS", meaning, "", best.name)


def _factor(ratio: float) -> str:
    if ratio >= 1.0:
        return f"a factor of {figure(ratio, 2)}"
    return (
        f"a factor of {figure(ratio, 2)}: in this run later readings moved poses away from the truth, "
        "which an honest covariance allows"
    )


def _honesties(first: SlamRow, best: SlamRow) -> str:
    one, other = (row.scores.honesty if row.scores else None for row in (first, best))
    if one is None or other is None:
        return ""
    return f"; ANEES per freedom {one.mean / one.expected:.2g} against {other.mean / other.expected:.2g}"
