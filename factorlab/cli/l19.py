"""`factorlab l19`: the course; one file a command beside this one, words in French for its students."""

import click

from factorlab.cli.french import FrenchGroup
from factorlab.cli.l19_check import check
from factorlab.cli.l19_defi import defi
from factorlab.cli.l19_rapport import rapport
from factorlab.cli.l19_suiveur import suiveur

__all__ = ["l19"]


@click.group(cls=FrenchGroup, short_help="The course L19, « Perception » (in French).")
def l19() -> None:
    """Le cours L19, « Perception » : exercices, défis, robot suiveur de ligne, compte rendu."""


l19.add_command(check)
l19.add_command(defi)
l19.add_command(rapport)
l19.add_command(suiveur)
