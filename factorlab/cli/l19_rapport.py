"""`factorlab l19 rapport`: every example of the course run, and RESULTATS.md written from what they claim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import CHECK_FAILED, in_one_sentence
from factorlab.cli.settings import Command, as_json, print_json, with_options

if TYPE_CHECKING:
    from factorlab.l19.results import Outcome, Work

__all__ = ["rapport"]

FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
UNSEEN = {"force", "as_json", "compare", "jobs"}  # options that change nothing in the page
OWN = {  # option -> the example that reads it, and how it is told so
    "imu": ("TP1", "41_tp1_"),
    "positions": ("TP2", "42_tp2_"),
    "secousses": ("TP3", "43_tp3_"),
    "damier": ("TP4a", "45_tp4a_"),
    "bureau": ("TP4d", "48_tp4d_"),
}
OPTIONS = (
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Dossier où écrire RESULTATS.md et figures/ ; ou un fichier .md."),
    click.option("--images", type=click.Path(file_okay=False, path_type=Path), metavar="DIR",
                 help="Dossier des figures, si ce n'est pas figures/ à côté de la page."),
    click.option("--cours", type=click.Path(file_okay=False, path_type=Path), default=Path("examples/l19"),
                 show_default=True, metavar="DIR", help="Dossier des exemples du cours."),
    click.option("--only", metavar="TP1,TP2", help="Seulement ces points du cours."),
    click.option("--jobs", type=click.IntRange(1, 64), default=2, show_default=True, metavar="N",
                 help="Exemples lancés en même temps."),
    click.option("--nom", default="", metavar="NOM", help="Votre nom, en tête de la page."),
    click.option("--imu", type=FILE, metavar="FICHIER", help="TP1 : votre IMU, immobile puis en mouvement."),
    click.option("--positions", type=FILE, metavar="FICHIER", help="TP2 : votre IMU tenue en six positions."),
    click.option("--secousses", type=FILE, metavar="FICHIER",
                 help="TP3 : votre IMU, au repos puis à la main, avec des chocs."),
    click.option("--damier", metavar="'IMAGES'",
                 help="TP4a : vos photos du damier, 'damier/*.jpg' ou un dossier."),
    click.option("--bureau", type=(FILE, FILE), metavar="A B", help="TP4d : vos deux photos du bureau."),
    click.option("--compare", type=FILE, metavar="RESULTATS.md",
                 help="Sortir avec 3 si une grandeur quitte sa tolérance, manque ou s'ajoute."),
    click.option("--readme", type=FILE, metavar="README.md", help="Y refaire aussi le tableau du cours."),
    click.option("--force", is_flag=True, help="Remplacer une page écrite auparavant."),
    as_json,
)  # fmt: skip


def rapport_options(command: Command) -> Command:
    """Options of the command."""
    return with_options(command, OPTIONS)


@click.command(short_help="Lancer tout le cours et écrire RESULTATS.md.")
@rapport_options
@in_one_sentence
def rapport(**options: Any) -> int:
    """Lance les exemples du cours et écrit RESULTATS.md : tableaux, tolérances, figures.

    Avec vos propres enregistrements (--imu, --positions, --secousses, --damier, --bureau), les TP se font sur
    eux : c'est le compte rendu à rendre.  Sans eux, sur ceux de FACTORLAB_DATA, sinon sur des simulés.  Un
    exemple qui échoue est une ligne qui le dit, et le code de sortie est 3.
    """
    import tempfile

    from factorlab.l19.results import differences, read_results
    from factorlab.l19.results.writing import require_page

    if options["out"] is None and options["compare"] is None:
        raise click.UsageError("dites où écrire avec -o DIR, ou avec quoi comparer avec --compare")
    if options["readme"] is not None and options["out"] is None:
        raise click.UsageError("--readme reprend la page que -o écrit : donnez -o aussi")
    if options["readme"] is not None and options["only"]:
        raise click.UsageError("--readme veut le cours entier : sans --only")
    if options["out"] is not None:
        require_page(options["out"], force=options["force"])
    if options["readme"] is not None:
        from factorlab.l19.results.readme import table_in

        table_in(options["readme"].read_text(encoding="utf-8"))  # before the work, not after it
    stated = None if options["compare"] is None else read_results(options["compare"])
    with tempfile.TemporaryDirectory(prefix="factorlab-l19-") as folder:
        work = _work(options, Path(folder))
        if options["out"] is not None:
            _write(work, options)
    apart = [] if stated is None else differences(work.outcomes, stated, whole=work.whole)
    if options["as_json"]:
        print_json(_document(work, apart))
    _tell(work, apart, err=options["as_json"])
    return CHECK_FAILED if work.failed or apart else 0


def _work(options: Mapping[str, Any], folder: Path) -> Work:
    """Run what was asked for."""
    from factorlab.l19.results import Work, run_scripts, scripts_of

    only = (options["only"] or "").split(",")
    scripts = scripts_of(options["cours"], only)
    arguments, recordings = _own(options, scripts)
    outcomes = run_scripts(scripts, folder, arguments=arguments, jobs=options["jobs"], progress=_progress)
    return Work(
        outcomes,
        name=options["nom"],
        recordings=recordings,
        whole=not any(only),
        command=_command(options),
    )


def _command(options: Mapping[str, Any]) -> str:
    """The command with the options that shape the page, as it can be typed again."""
    import shlex

    words = ["factorlab", "l19", "rapport"]
    for parameter in rapport.params:
        name = parameter.name or ""
        value = options.get(name)
        if value in (None, "", False) or value == parameter.default or name in UNSEEN:
            continue
        words.append("-o" if name == "out" else f"--{name}")
        words += [str(one) for one in (value if isinstance(value, tuple) else (value,))]
    return shlex.join(words)


def _own(
    options: Mapping[str, Any], scripts: Sequence[Path]
) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Arguments of each script that reads the student's own files, and those files by item."""
    arguments: dict[str, list[str]] = {}
    recordings: dict[str, list[str]] = {}
    for option, (item, beginning) in OWN.items():
        given = options[option]
        if not given:
            continue
        script = next((path for path in scripts if path.name.startswith(beginning)), None)
        if script is None:
            raise click.UsageError(f"--{option} est pour {item}, qui n'est pas parmi les exemples demandés")
        paths = _files(given)
        arguments[script.name] = [str(path.resolve()) for path in paths]
        recordings[item] = [str(path) for path in paths]
    return arguments, recordings


def _files(given: Any) -> list[Path]:
    if isinstance(given, Path):
        return [given]
    if isinstance(given, tuple):
        return list(given)
    from vision3d.images import image_paths

    return image_paths(given)


def _progress(outcome: Outcome, done: int, total: int) -> None:
    seconds = f"{outcome.seconds:.1f}".replace(".", ",")
    word = "" if outcome.good else f"  {outcome.fault or 'une grandeur manque ou quitte sa tolérance'}"
    click.echo(f"[{done:2d}/{total}] {outcome.script.name:40s} {seconds:>6} s{word}", err=True)


def _write(work: Work, options: Mapping[str, Any]) -> None:
    from factorlab.l19.results import read_results, readme_table, with_table, write_results

    page = write_results(work, options["out"], options["images"])
    click.echo(f"page : {page}", err=options["as_json"])
    if options["readme"] is not None:
        from sequential.readers.files import replacing

        text = with_table(options["readme"].read_text(encoding="utf-8"), readme_table(read_results(page)))
        with replacing(options["readme"]) as file:
            file.write(text)
        click.echo(f"tableau : {options['readme']}", err=options["as_json"])


def _tell(work: Work, apart: Sequence[str], *, err: bool) -> None:
    """The verdict last, where the eye is."""
    for sentence in apart:
        click.echo(f"écart : {sentence}", err=err)
    bad = [one for one in work.outcomes if not one.good]
    for one in bad:
        click.echo(f"{one.script.name} : {_why(one)}", err=err)
    if work.missing:
        click.echo(f"sans fichier : {', '.join(work.missing)}", err=err)
    claims = [claim for one in work.outcomes for claim in one.claims if claim.judged]
    held = sum(claim.holds for claim in claims)
    click.echo(
        f"{len(work.outcomes) - len(bad)} exemples sur {len(work.outcomes)}, "
        f"{held} grandeurs sur {len(claims)} dans leur tolérance", err=err,
    )  # fmt: skip


def _why(outcome: Outcome) -> str:
    if outcome.fault:
        return f"échec : {outcome.fault}"
    if not outcome.claims:
        return "n'annonce aucune grandeur"
    return "hors tolérance : " + ", ".join(claim.quantity for claim in outcome.claims if not claim.holds)


def _document(work: Work, apart: Sequence[str]) -> dict[str, Any]:
    from dataclasses import asdict

    from factorlab.compare.table import strict

    return {
        "examples": [
            {
                "item": one.item,
                "script": one.script.name,
                "good": one.good,
                "fault": one.fault,
                "seconds": round(one.seconds, 2),
                "claims": [{k: strict(v) for k, v in asdict(claim).items()} for claim in one.claims],
            }
            for one in work.outcomes
        ],
        "missing": work.missing,
        "differences": list(apart),
        "good": not work.failed and not apart,
    }
