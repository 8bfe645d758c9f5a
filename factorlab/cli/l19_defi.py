"""`factorlab l19 defi`: challenge D1, a student's filter scored on recordings it has not seen."""

from __future__ import annotations

from pathlib import Path

import click

from factorlab.cli.faults import CHECK_FAILED, in_one_sentence
from factorlab.cli.settings import as_json, command_line

__all__ = ["defi"]


@click.command(short_help="Défi D1 : votre filtre, noté sur 20.")
@click.argument("file", metavar="[FICHIER.py]", required=False, type=click.Path(path_type=Path))
@click.option(
    "--au-moins",
    type=click.FloatRange(0, 20),
    metavar="NOTE",
    help="Sortir avec le code 3 si la note est plus basse.",
)
@click.option(
    "--seed",
    "--graine",
    "seed",
    type=click.IntRange(min=0),
    metavar="N",
    help="D'autres enregistrements cachés (pour l'enseignant).  [défaut : ceux du cours]",
)
@click.option(
    "--duree",
    "limit_s",
    type=click.FloatRange(1, 600),
    default=60.0,
    show_default=True,
    metavar="S",
    help="Durée accordée au fichier, en secondes.",
)
@as_json
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DOSSIER",
    help="Y écrire le compte rendu, l'enregistrement public, un modèle et un filtre de départ.",
)
@click.option("--force", is_flag=True, help="Remplacer un compte rendu qui s'y trouve déjà.")
@in_one_sentence
def defi(
    file: Path | None,
    *,
    au_moins: float | None,
    seed: int | None,
    limit_s: float,
    as_json: bool,
    out: Path | None,
    force: bool,
) -> int:
    """Régler un filtre pour un thermomètre : rampe, palier, bruit et une mesure aberrante.

    FICHIER.py définit filtrer(t, z) : N estimations, ou (N, 2) avec leurs σ, sans regarder l'avenir.  Il est
    exécuté à part, sur des enregistrements cachés, et noté sur 20 à côté d'un passe-bas, d'une médiane et de
    nos Kalman.  Sans fichier : l'énoncé et le tableau de nos filtres.

    Codes de sortie : 0 noté, 1 pas de fichier, 3 pas de note, ou note sous --au-moins.
    """
    from factorlab.cli.delivery import deliver, require_output

    if au_moins is not None and file is None:
        raise click.UsageError("--au-moins va avec le fichier à noter")
    require_output(out, None, force=force)
    from factorlab.l19.challenge.document import challenge_document
    from factorlab.l19.challenge.files import starting_files
    from factorlab.l19.challenge.judge import judge_file, judge_rivals
    from factorlab.l19.challenge.trials import HIDDEN_SEED, public_trial

    seed = HIDDEN_SEED if seed is None else seed
    judged = judge_rivals(seed) if file is None else judge_file(file, seed, limit_s)
    deliver(
        challenge_document(judged, command_line()),
        as_json=as_json,
        out=out,
        force=force,
        files=starting_files(public_trial()) if out is not None else None,
    )
    short = judged.row is not None and au_moins is not None and judged.row.score < au_moins
    return CHECK_FAILED if judged.fault or short else 0
