"""`factorlab sfm`: cameras and points from photographs."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import DATA_ERROR, INTERRUPTED, in_one_sentence
from factorlab.cli.progress import bar
from factorlab.cli.settings import Command, as_json, check_option, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.sfm import SfmJob

__all__ = ["sfm"]

LENSES = ("auto", "pinhole", "brown1", "brown2", "brown4", "fisheye4")
OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.argument("sources", metavar="IMAGES…", nargs=-1, required=True),
    click.option("--camera", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
                 help="Known intrinsics, in any format of `factorlab camera`; they are kept."),
    click.option("--which", metavar="NAME", help="The camera in that file, where there are several."),
    click.option("--global", "whole", is_flag=True, help="Solve for all pictures at once (GLOMAP)."),
    click.option("--mapper", type=click.Choice(("incremental", "global", "own")), metavar="NAME",
                 help="COLMAP's incremental or global one, or our own.  [default: incremental]"),
    click.option("--lens", type=click.Choice(LENSES), default="auto", show_default=True,
                 help="To calibrate without --camera; auto: brown1, or brown2 where residuals ask for it."),
    click.option("--sharing", type=click.Choice(("auto", "one", "each")), default="auto", show_default=True,
                 help="Pictures of one camera: same size, device and zoom; same size; none."),
    click.option("--max-size", type=click.IntRange(64), default=1600, show_default=True, metavar="PX",
                 help="Features are sought in pictures reduced to this longer side."),
    click.option("--max-features", type=click.IntRange(100), default=8192, show_default=True, metavar="N",
                 help="Features kept of each picture."),
    click.option("--refine/--no-refine", default=True, show_default=True,
                 help="Adjust once more with our own bundle adjustment, which gives standard deviations."),
    click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of random draws."),
    click.option("--threads", type=click.IntRange(0), default=0, metavar="N",
                 help="For features and matches.  [default: one a processor]"),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Write the report and the model as COLMAP, PLY, Bundler, Kalibr and TUM files here."),
    click.option("--force", is_flag=True, help="Write over an earlier report in DIR."),
    check_option,
    config_option,
)  # fmt: skip


def sfm_options(command: Command) -> Command:
    """Argument and options of the command."""
    return with_options(command, OPTIONS)


@click.command(short_help="Cameras and points in space, from photographs of one scene.")
@sfm_options
@in_one_sentence
def sfm(sources: tuple[str, ...], **options: Any) -> int:
    """Where photographs were taken from, and a cloud of points, from the IMAGES alone.

    IMAGES are files, patterns or folders: three pictures or more of one scene, each showing most of what
    another shows, from places a step apart.  What cannot be used is named, and the rest goes on.

    With -o, features and matches are kept in DIR.work until the report is written: after a Ctrl-C the same
    command goes on from there.
    """
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.cli.stopping import stopping
    from factorlab.sfm import model_files, run_sfm, sfm_document
    from vision3d.sfm import Stopped

    out: Path | None = options["out"]
    require_output(out, None, force=options["force"])
    work = None if out is None else out.with_name(f"{out.name}.work")
    with stopping() as stop, bar("sfm", shown=sys.stderr.isatty()) as progress:
        try:
            done = run_sfm(sources, _job(options), work=work, stop=stop, progress=progress)
        except Stopped:
            kept = (
                f"; the same command goes on from {work}"
                if work is not None
                else "; nothing is kept without -o"
            )
            click.echo(f"stopped before there was a model; {kept}", err=True)
            return INTERRUPTED
    code = deliver(
        sfm_document(done, command_line()),
        as_json=options["as_json"],
        out=out,
        force=options["force"],
        check=options["check"],
        files=model_files(done) if out is not None else None,
    )
    if work is not None and not done.stopped:
        shutil.rmtree(work, ignore_errors=True)
    return DATA_ERROR if done.found is None else code


def _job(options: dict[str, Any]) -> SfmJob:
    from factorlab.sfm import SfmJob
    from vision3d.sfm import SfmSettings

    settings = SfmSettings(
        lens=options["lens"], sharing=options["sharing"],
        mapper=options["mapper"] or ("global" if options["whole"] else "incremental"),
        max_size=options["max_size"], max_features=options["max_features"], seed=options["seed"],
        threads=options["threads"],
    )  # fmt: skip
    return SfmJob(settings, options["camera"], options["which"], refine=options["refine"])
