"""`factorlab cloud`: look at a point cloud, clean it, thin it, lay it on another, find its planes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import as_json, check_option, command_line, config_option

__all__ = ["cloud"]


@click.command(short_help="A point cloud: describe, clean, thin, register, planes.")
@click.argument("source", metavar="CLOUD.ply", type=click.Path(path_type=Path))
@click.option("--clean", is_flag=True, help="Remove stragglers.")
@click.option("--voxel", metavar="LENGTH", help="Thin to one point in each cube of this side, such as 1cm.")
@click.option(
    "--onto", type=click.Path(path_type=Path), metavar="OTHER.ply", help="Lay the cloud on this one."
)
@click.option(
    "--method",
    type=click.Choice(("point-to-plane", "point-to-point")),
    default="point-to-plane",
    show_default=True,
    help="Of laying on.",
)
@click.option(
    "--max-distance", metavar="LENGTH", help="Farthest partner when laying on.  [default: as they scatter]"
)
@click.option("--planes", type=click.IntRange(0, 50), default=0, metavar="N", help="Find at most N planes.")
@click.option(
    "--plane-distance", metavar="LENGTH", help="Of a plane's points from it.  [default: 3 x spacing]"
)
@click.option("--mesh", is_flag=True, help="A surface through the points (Poisson; needs open3d).")
@click.option("--mesh-depth", type=click.IntRange(3, 12), default=8, show_default=True, help="Of its octree.")
@as_json
@click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR", help="Write report and clouds.")
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@in_one_sentence
def cloud(source: Path, **options: Any) -> int:
    """Look at a point CLOUD in a PLY file, and work on it: clean, thin, lay on another, planes, surface.

    DIR gets report.html, cloud.ply with what is left (in the frame of OTHER with --onto), and mesh.ply.
    """  # fmt: skip
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.cloud import CloudSettings, cloud_document, cloud_files, work_on_cloud

    require_output(options["out"], None, force=options["force"])
    job = work_on_cloud(
        source,
        CloudSettings(
            clean=options["clean"],
            voxel_m=_length(options["voxel"], "--voxel"),
            onto=options["onto"],
            method=options["method"],
            max_distance_m=_length(options["max_distance"], "--max-distance"),
            planes=options["planes"],
            plane_m=_length(options["plane_distance"], "--plane-distance"),
            mesh_depth=options["mesh_depth"] if options["mesh"] else None,
        ),
    )
    return deliver(
        cloud_document(job, command_line()),
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=cloud_files(job) if options["out"] is not None else None,
    )


def _length(text: str | None, option: str) -> float | None:
    """Metres of a length with a unit."""
    if text is None:
        return None
    from sequential.errors import ModelError
    from vision3d.boards.text import metres

    try:
        return metres(text)
    except ModelError as error:
        raise click.BadParameter(str(error), param_hint=option) from error
