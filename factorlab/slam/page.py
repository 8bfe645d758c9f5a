"""SLAM comparisons as one report: verdicts, tables, maps, errors beside what was stated."""

from __future__ import annotations

from factorlab.compare.verdict import Finding
from factorlab.report.document import Document, Section, Table, Verdict
from factorlab.slam.engine import SlamComparison
from factorlab.slam.text import cells, headings, size_line

__all__ = ["slam_document"]

LAG_WORDS = (
    "A fixed-lag smoother holds the poses of its last steps and all landmarks; this is its estimate of the "
    "newest pose. A longer window relinearises more of the past."
)


def slam_document(comparisons: tuple[SlamComparison, ...], command: str) -> Document:
    """One page for one problem, or for the same problem of several vehicles."""
    several = len(comparisons) > 1
    verdicts = tuple(
        _verdict(finding, comparison.name if several else "")
        for comparison in comparisons
        for finding in comparison.findings
    )
    sections = tuple(
        section
        for comparison in comparisons
        for section in _sections(comparison, f"{comparison.name}: " if several else "")
    )
    first = comparisons[0]
    lead = (
        "Each estimator solved the same declaration of the same measurements."
        if several
        else f"{size_line(first)}. Each estimator solved the same declaration of the same measurements."
    )
    title = first.dataset.title if not several else ", ".join(one.dataset.title for one in comparisons)
    return Document(title, lead, verdicts, sections, {}, command=command, conclusion=_conclusion(comparisons))


def _verdict(finding: Finding, of: str) -> Verdict:
    metric = f"{of}, {finding.metric}" if of else finding.metric
    return Verdict(metric, finding.value, finding.band95, finding.status, finding.meaning, finding.action)


def _conclusion(comparisons: tuple[SlamComparison, ...]) -> str:
    told = [
        finding.meaning
        for comparison in comparisons
        for finding in comparison.findings
        if finding.metric == "what smoothing bought"
    ]
    return ". ".join(told)


def _sections(comparison: SlamComparison, prefix: str) -> list[Section]:
    """Table, map, errors and honesty of one problem."""
    from factorlab.report import slam_figures as draw

    dataset = comparison.dataset
    body = tuple(cells(row) for row in comparison.rows if not row.failed)
    sections = [
        Section(
            f"{prefix}Estimators",
            size_line(comparison) if prefix else "",
            Table(headings(comparison), body),
            caption="A row that waits for nothing is an estimate made while driving.",
        ),
        Section(
            f"{prefix}Map",
            figure=lambda: draw.slam_map(comparison),
            caption="Same scale on both axes; ellipses are 95 % by the best estimate's word."
            if dataset.axes == 2
            else "Positions from above and from the side, same scale.",
        ),
        Section(
            f"{prefix}Error over time",
            figure=lambda: draw.slam_errors(comparison),
            caption="Length of the position error at every pose.",
        ),
        Section(
            f"{prefix}Error and stated ±3σ",
            figure=lambda: draw.slam_envelopes(comparison),
            caption="In the body frame. A consistent estimate leaves the band three times in a thousand.",
        ),
        Section(
            f"{prefix}Normalised error",
            figure=lambda: draw.slam_consistency(comparison),
            caption="Squared error of the pose in units of its covariance, per degree of freedom: "
            "an honest estimate stays around 1.",
        ),
    ]
    if comparison.lags:
        sections.append(Section(f"{prefix}What waiting is worth", LAG_WORDS, _lag_table(comparison)))
    if dataset.notes:
        sections.append(Section(f"{prefix}How to read this", "\n\n".join(dataset.notes)))
    return [section for section in sections if not _empty(section)]


def _lag_table(comparison: SlamComparison) -> Table:
    """RMSE, honesty and cost at each lag."""
    body = tuple(
        (f"{point.lag:g}", point.rmse, point.anees_per_dof, point.us_per_measurement)
        for point in comparison.lags
        if not point.message
    )
    return Table((("lag", "steps"), ("RMSE", "m"), ("ANEES/dof", "1 exp."), ("per reading", "µs")), body)


def _empty(section: Section) -> bool:
    """Whether a section's figure has nothing to draw."""
    if section.table is not None or section.text or not callable(section.figure):
        return False
    from factorlab.report.style import styled

    with styled("probe"):
        return section.figure() is None
