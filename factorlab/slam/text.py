"""A SLAM comparison as lines of a terminal and cells of a page."""

from __future__ import annotations

from collections.abc import Iterable
from math import degrees
from textwrap import wrap

from factorlab.compare.text import NOTHING, WIDTH, aligned, band, figure, verdict_lines
from factorlab.slam.engine import SlamComparison, SlamRow
from factorlab.slam.estimators import KINDS

__all__ = ["cells", "headings", "size_line", "terminal"]

WORDS = {"x": "poses", "l": "landmarks", "m": "markers", "v": "velocities", "b": "biases"}


def size_line(comparison: SlamComparison) -> str:
    """`1 200 poses, 15 landmarks, 2 sets of constants, 6 789 measurements`."""
    problem = comparison.dataset.problem
    sizes = {kind: len(problem.indices(kind)) for kind in problem.kinds}
    told = [f"{_spaced(sizes[kind])} {word}" for kind, word in WORDS.items() if sizes.get(kind)]
    if constants := sum(size for kind, size in sizes.items() if kind not in WORDS):
        told.append(f"{_spaced(constants)} set{'s' if constants > 1 else ''} of constants")
    return ", ".join([*told, f"{_spaced(problem.count)} measurements"])


def _spaced(count: int) -> str:
    """A whole number with narrow spaces between thousands."""
    return f"{count:,}".replace(",", "\u202f")


def headings(comparison: SlamComparison) -> tuple[tuple[str, str], ...]:
    """Heading and unit of each column."""
    scored = next((row.scores for row in comparison.rows if row.scores is not None), None)
    against = "RMSE" if scored is None else f"RMSE to {scored.against}"
    frame = "" if comparison.dataset.aligned == "none" else ", aligned"
    return (
        ("estimator", ""),
        (against, f"m{frame}"),
        ("heading" if comparison.dataset.axes == 2 else "rotation", "°"),
        ("ANEES/dof", "1 exp."),
        ("band", "95 %"),
        ("loop error" if _by_loops(comparison) else "map RMSE", "m"),
        ("χ²", ""),
        ("per reading", "µs"),
        ("total", "s"),
        ("iter.", ""),
        ("waits for", ""),
    )


def cells(row: SlamRow) -> tuple[str, ...]:
    """One string for each of `headings`."""
    scores = row.scores
    honest = None if scores is None else scores.honesty
    turned = None if scores is None else scores.rotation_rmse
    limits = None if honest is None else honest.bootstrap_band95
    return (
        row.title,
        figure(None if scores is None else scores.rmse, 4),
        figure(None if turned is None else degrees(turned)),
        figure(None if honest is None else honest.mean / honest.expected),
        NOTHING if honest is None else _per_freedom(limits, honest.expected),
        figure(_off_map(row)),
        NOTHING if row.chi2 is None else f"{row.chi2:.6g}",
        figure(row.us_per_measurement),
        figure(row.seconds),
        NOTHING if row.iterations is None else str(row.iterations),
        KINDS[row.name].latency,
    )


def _by_loops(comparison: SlamComparison) -> bool:
    """Whether the map is judged by its revisits, for want of a truth."""
    return any(row.loops is not None for row in comparison.rows)


def _off_map(row: SlamRow) -> float | None:
    if row.loops is not None:
        return row.loops.rms
    return None if row.map_score is None else row.map_score.rmse


def _per_freedom(limits: tuple[float, float] | None, freedom: float) -> str:
    return NOTHING if limits is None else band((limits[0] / freedom, limits[1] / freedom))


def terminal(comparison: SlamComparison) -> Iterable[str]:
    """Title, size, verdict, table and notes, line by line."""
    yield comparison.dataset.title
    yield size_line(comparison)
    yield ""
    yield from verdict_lines(comparison.findings)
    lines = [
        tuple(f"{name} {unit}".strip() if unit else name for name, unit in headings(comparison)),
        *(cells(row) for row in comparison.rows if not row.failed),
    ]
    yield from aligned(lines)
    for row in comparison.rows:
        if row.failed or row.message:
            yield from wrap(f"{row.title}: {row.message}", WIDTH)
    yield ""
    for note in comparison.dataset.notes:
        yield from wrap(f"- {note}", WIDTH, subsequent_indent="  ")
