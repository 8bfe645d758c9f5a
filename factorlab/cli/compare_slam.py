"""`factorlab compare` for problems with unknown landmarks, loop closures and graph files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from factorlab.cli.comparing import exit_code, names_of, progress_of, say_why, show
from factorlab.cli.settings import command_line, lags_of

if TYPE_CHECKING:
    from factorlab.cli.compare import Settings
    from factorlab.datasets import SlamDataset

__all__ = ["compare_slam_and_show", "is_slam"]

GRAPH_FILES = {".g2o", ".graph", ".toro"}
CHAIN_ONLY = ("model", "truth", "use_every", "max_gap")


def is_slam(settings: Settings) -> bool:
    """Whether a source is a SLAM problem: asked for, one by its name, or a graph file."""
    from factorlab.datasets import NAMES, SLAM_NAMES

    named = settings.source in SLAM_NAMES and settings.source not in NAMES
    return settings.slam or named or Path(settings.source).suffix in GRAPH_FILES


def compare_slam_and_show(settings: Settings) -> int:
    """Compare, write, print; returns the exit code."""
    from factorlab.compare.table import document
    from factorlab.report.folder import require_free
    from factorlab.slam import compare_slam
    from factorlab.slam.estimators import require_names
    from factorlab.slam.text import terminal

    names, lags = names_of(settings.estimators, require_names), lags_of(settings.lags)
    if settings.tune:
        raise click.UsageError("--tune fits the noise of a chain; a SLAM problem keeps the noise it states")
    for name in CHAIN_ONLY:
        if getattr(settings, name) is not None:
            option = f"--{name.replace('_', '-')}"
            raise click.UsageError(f"{option} goes with a log and a model, not with a SLAM problem")
    if settings.out is not None:
        require_free(settings.out, force=settings.force)
    done = []
    for dataset in _datasets(settings):
        with progress_of(dataset.name) as progress:
            done.append(compare_slam(dataset, names, seed=settings.seed, lags=lags, progress=progress))
    comparisons = tuple(done)
    if all(comparison.all_failed for comparison in comparisons):
        return say_why(comparisons)
    whole = document(comparisons, command_line())
    show(comparisons, whole, terminal, as_json=settings.as_json)
    if settings.out is not None:
        from factorlab.report.slam_writing import write_slam_report

        page = write_slam_report(comparisons, whole, settings.out, force=settings.force)
        click.echo(f"report: {page}", err=settings.as_json)
    return exit_code(comparisons, check=settings.check)


def _datasets(settings: Settings) -> list[SlamDataset]:
    """The named problem, or the user's own graph file."""
    from factorlab.datasets import SLAM_NAMES, load_slam

    if settings.source in SLAM_NAMES:
        return load_slam(settings.source, robot=settings.robot)
    if settings.robot is not None:
        raise click.UsageError("--robot goes with a dataset that has several")
    path = Path(settings.source)
    if path.suffix in GRAPH_FILES or path.is_file():
        from factorlab.datasets.pose_graphs import load_graph_file

        return [load_graph_file(path)]
    raise click.UsageError(
        f"{settings.source} is no SLAM problem; there are {', '.join(SLAM_NAMES)}, and graph files "
        f"of your own ({', '.join(sorted(GRAPH_FILES))})"
    )
