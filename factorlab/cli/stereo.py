"""`factorlab stereo`: a group whose commands are imported when they are asked for."""

from __future__ import annotations

import click

from factorlab.cli.late import LateGroup

__all__ = ["stereo"]

COMMANDS = {
    "rectify": (
        "factorlab.cli.stereo_rectify",
        "rectify",
        "Pairs of pictures as parallel cameras would have taken them.",
    ),
    "depth": (
        "factorlab.cli.stereo_depth",
        "depth",
        "Disparity, depth and a cloud of points from two pictures.",
    ),
}


@click.command(cls=LateGroup, table=COMMANDS, short_help="Two cameras: rectified pairs, depth.")
def stereo() -> None:
    """Pictures of two cameras whose rig is known, see `factorlab calibrate stereo`."""
