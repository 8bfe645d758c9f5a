"""`factorlab compare`: estimators side by side on a dataset or on a log of your own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.comparing import exit_code, names_of, progress_of, say_why, show
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import (
    as_json,
    check_option,
    command_line,
    config_option,
    lags_of,
    max_gap_option,
    robot_option,
    seed_option,
)

if TYPE_CHECKING:
    from factorlab.datasets import Dataset

__all__ = ["Settings", "compare", "compare_and_show"]

FOLDER = click.Path(file_okay=True, path_type=Path)


@dataclass(frozen=True, slots=True)
class Settings:
    """What the command line asks for."""

    source: str
    estimators: str | None = None
    use_every: int | None = None
    tune: bool = False
    model: str | None = None
    truth: Path | None = None
    robot: int | None = None
    max_gap: float | None = None
    as_json: bool = False
    out: Path | None = None
    force: bool = False
    seed: int = 0
    check: bool = False
    slam: bool = False
    lags: str | None = None


@click.command(short_help="Estimators side by side on one log.")
@click.argument("source", metavar="DATASET|LOG")
@click.option("--estimators", metavar="A,B", help="Names, such as ekf,ieks,batch; by default those that fit.")
@click.option(
    "--use-every",
    type=click.IntRange(min=1),
    metavar="K",
    help="Use one reading in K, score on the others.  [default: 5 for a dataset, 1 for a log]",
)
@click.option("--tune", is_flag=True, help="Fit the noise first, on the readings in use only.")
@click.option(
    "--model",
    metavar="FILE.py:NAME",
    help="For a log of your own: a StateSpace, or a function that returns one.",
)
@click.option(
    "--truth",
    type=click.Path(path_type=Path),
    metavar="TUM_FILE",
    help="For a log of your own: where it really was.",
)
@robot_option
@click.option("--slam", is_flag=True, help="Do not use the map: estimate it (mrclam, starry_night).")
@click.option(
    "--lags",
    metavar="A,B",
    help="Try fixed lags too: s, or steps of a SLAM problem.",
)
@max_gap_option
@as_json
@click.option(
    "-o", "--out", type=FOLDER, metavar="DIR", help="Write report.html, report.json and trajectories here."
)
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@seed_option
@check_option
@config_option
@in_one_sentence
def compare(**options: Any) -> int:
    """Run several estimators on one log and put them in one table.

    DATASET is kitti, plaza1, plaza2, mrclam, rail or starry_night; LOG is a CSV or NPZ file with named
    streams, together with --model, or a pose graph in g2o or TORO format.  `factorlab info LOG` shows what a
    log holds.

    Problems with unknown landmarks or loop closures: victoria_park, sphere2500, w10000, city10000, intel,
    mit, planar_monocular, and mrclam or starry_night with --slam.
    """
    settings = Settings(**options)
    from factorlab.cli.compare_slam import compare_slam_and_show, is_slam

    return compare_slam_and_show(settings) if is_slam(settings) else compare_and_show(settings)


def compare_and_show(settings: Settings) -> int:
    """Compare, write, print; returns the exit code."""
    from factorlab.compare import compare as run_comparison
    from factorlab.compare import document
    from factorlab.compare.estimators import require_names
    from factorlab.compare.text import terminal
    from factorlab.report.folder import require_free

    names = names_of(settings.estimators, require_names)
    if settings.out is not None:
        require_free(settings.out, force=settings.force)
    datasets = _datasets(settings)
    comparisons = []
    for dataset in datasets:
        with progress_of(dataset.name) as progress:
            comparisons.append(
                run_comparison(
                    dataset,
                    names,
                    tune=settings.tune,
                    seed=settings.seed,
                    max_gap=settings.max_gap,
                    lags=lags_of(settings.lags) or None,
                    progress=progress,
                )
            )
    done = tuple(comparisons)
    if all(comparison.all_failed for comparison in done):
        return say_why(done)
    whole = document(done, command_line())
    show(done, whole, terminal, as_json=settings.as_json)
    if settings.out is not None:
        from factorlab.report import write_report

        page = write_report(done, whole, settings.out, force=settings.force)
        click.echo(f"report: {page}", err=settings.as_json)
    return exit_code(done, check=settings.check)


def _datasets(settings: Settings) -> list[Dataset]:
    """The named dataset, or the user's own log."""
    from factorlab.datasets import NAMES, SLAM_NAMES, load

    if settings.source in NAMES:
        for option, given in (("--model", settings.model), ("--truth", settings.truth)):
            if given is not None:
                raise click.UsageError(
                    f"{option} goes with a log of your own; {settings.source} brings its own"
                )
        use_every = 5 if settings.use_every is None else settings.use_every
        return load(settings.source, use_every=use_every, robot=settings.robot)
    from factorlab.compare.own import own_dataset, require_log

    path = require_log(settings.source, tuple(dict.fromkeys((*NAMES, *SLAM_NAMES))))
    if settings.robot is not None:
        raise click.UsageError("--robot goes with a dataset that has several")
    if settings.model is None:
        raise click.UsageError(
            f"a log of your own needs a model: factorlab compare {path} --model FILE.py:NAME"
        )
    return [own_dataset(path, settings.model, settings.truth, settings.use_every or 1)]
