"""`factorlab match`: what two pictures share, and the geometry of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import as_json, check_option, command_line, config_option

__all__ = ["match"]

# as in vision3d.features.KINDS and factorlab.match, which are not imported for the sake of --help
FEATURES = ("sift", "orb", "fast", "harris", "fast-patch", "harris-patch")
MODELS = ("auto", "homography", "fundamental", "essential")
METHODS = (
    "ransac", "prosac", "lmeds", "opencv", "rho", "usac", "usac_fast", "usac_accurate", "usac_prosac",
    "usac_magsac", "poselib",
)  # fmt: skip
CAMERA = click.Path(dir_okay=False, path_type=Path)


@click.command(short_help="Match two pictures: homography, fundamental or essential matrix.")
@click.argument("a", metavar="A")
@click.argument("b", metavar="B")
@click.option(
    "--features", type=click.Choice(FEATURES), default="sift", show_default=True, help="What is matched."
)
@click.option(
    "--model", type=click.Choice(MODELS), default="auto", show_default=True,
    help="homography: a plane, or a turn; fundamental: depth; essential: depth, with --camera.",
)  # fmt: skip
@click.option(
    "--camera", type=CAMERA, metavar="FILE", help="The camera that took A (and B), for --model essential."
)
@click.option("--camera-b", type=CAMERA, metavar="FILE", help="The camera that took B, where it is another.")
@click.option(
    "--method", type=click.Choice(METHODS), default="ransac", show_default=True,
    help="The robust search: ours (ransac, prosac, lmeds), OpenCV's, or PoseLib's.",
)  # fmt: skip
@click.option(
    "--threshold", type=click.FloatRange(min=0, min_open=True), default=3.0, show_default=True, metavar="PX",
    help="Largest error of a match that agrees.",
)  # fmt: skip
@click.option(
    "--ratio", type=click.FloatRange(0, 1, min_open=True), default=0.8, show_default=True,
    help="Lowe's test: nearest descriptor against the second nearest.",
)  # fmt: skip
@click.option(
    "--count", type=click.IntRange(min=8), default=4000, show_default=True, help="Features a picture at most."
)
@click.option(
    "--max-size", type=click.IntRange(min=64), default=2000, show_default=True, metavar="PX",
    help="Seek features in pictures of this longer side at most.",
)  # fmt: skip
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the search.")
@as_json
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Write the report, matches.csv, matches.png and geometry.json here.",
)  # fmt: skip
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@check_option
@config_option
@in_one_sentence
def match(a: str, b: str, **options: Any) -> int:
    """Match the pictures A and B, and say what geometry they share and how sure it is.

    Features are matched, a geometry is sought that most matches agree on, and under it they are matched
    again and aligned to a fraction of a pixel. Too little overlap, repeated texture and scenes without
    parallax are said.
    """
    from factorlab.cli.delivery import deliver, require_output
    from factorlab.match import match_document, match_pictures
    from factorlab.match.export import match_files

    settings = _settings(options)
    require_output(options["out"], None, force=options["force"])
    done = match_pictures(a, b, settings, say=lambda text: click.echo(text, err=True))
    return deliver(
        match_document(done, command_line()),
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=match_files(done) if options["out"] is not None else None,
    )


def _settings(options: dict[str, Any]) -> Any:
    from factorlab.match import MatchSettings
    from sequential.errors import ModelError

    if options["camera_b"] is not None and options["camera"] is None:
        raise click.UsageError("--camera-b goes with --camera, which is that of A")
    try:
        return MatchSettings(
            options["features"], options["model"], options["method"], options["threshold"], options["ratio"],
            options["count"], options["max_size"], options["camera"], options["camera_b"], options["seed"],
        )  # fmt: skip
    except ModelError as error:
        raise click.UsageError(str(error)) from error
