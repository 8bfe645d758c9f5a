"""`factorlab demo`: the main job on real data."""

from __future__ import annotations

from pathlib import Path

import click

from factorlab.cli.compare import Settings, compare_and_show
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.settings import as_json

__all__ = ["demo"]

FOLDER = Path("factorlab-demo")


@click.command(short_help="Filters, smoothers and graphs on a real drive; ends with the report's path.")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), default=FOLDER, show_default=True, metavar="DIR"
)
@click.option("--force", is_flag=True, help="Write over an earlier report in DIR.")
@as_json
@in_one_sentence
def demo(out: Path, force: bool, as_json: bool) -> int:
    """Compare every estimator on eight minutes of GPS and IMU (KITTI), before and after tuning the noise.

    The same as `compare kitti --tune -o factorlab-demo`; an earlier demo there is replaced.
    """
    own = out == FOLDER and (out / "report.json").is_file()
    return compare_and_show(Settings("kitti", tune=True, out=out, force=force or own, as_json=as_json))
