"""`factorlab l19 check`: a student's own file against the exercises of the course."""

from __future__ import annotations

from pathlib import Path

import click

from factorlab.cli.faults import CHECK_FAILED, in_one_sentence
from factorlab.cli.settings import as_json, print_json

__all__ = ["check"]


@click.command(short_help="Vérifier ses exercices E1 à E4.")
@click.argument("fichiers", nargs=-1, required=True, metavar="FICHIER.py|DOSSIER …",
                type=click.Path(path_type=Path))  # fmt: skip
@click.option("--tout", is_flag=True, help="Montrer toutes les erreurs, et non les trois premières.")
@click.option("--duree", "limit_s", type=click.FloatRange(min=1.0), default=120.0, show_default=True,
              metavar="S", help="Durée accordée à chaque fichier, en secondes.")  # fmt: skip
@as_json
@in_one_sentence
def check(fichiers: tuple[Path, ...], *, tout: bool, limit_s: float, as_json: bool) -> int:
    """Vérifier les exercices E1 à E4 dans vos propres fichiers.

    Les exercices sont reconnus aux noms que le fichier définit (Kalman, median_glissant, ajuster,
    composantes …). Le fichier tourne à part, depuis son dossier, sans ce qui est sous
    `if __name__ == "__main__"`. Code de retour : 0 si tout va (remarques comprises), 3 s'il reste quelque
    chose à corriger, 1 si le fichier ne peut pas être lu.
    """
    from factorlab.l19.exercises.checking import check_path
    from factorlab.l19.exercises.told import verdict_lines

    verdicts = [one for path in fichiers for one in check_path(path, limit_s=limit_s)]
    failed = any(one.failed for one in verdicts)
    if as_json:
        print_json({"verdict": "FAIL" if failed else "PASS", "files": [one.to_json() for one in verdicts]})
    else:
        for verdict in verdicts:
            for line, colour in verdict_lines(verdict, most=None if tout else 3):
                click.echo(click.style(line, fg=colour, bold=True) if colour else line)
    return CHECK_FAILED if failed else 0
