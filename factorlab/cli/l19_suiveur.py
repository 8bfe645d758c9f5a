"""`factorlab l19 suiveur`: the line follower of challenge D2 on a page whose sliders change it."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factorlab.cli.faults import DATA_ERROR, in_one_sentence
from factorlab.cli.settings import Command, as_json, command_line, config_option, with_options

if TYPE_CHECKING:
    from factorlab.l19.follower import FollowerSettings

__all__ = ["suiveur"]

PORT = 8019
CURVES = ("circuit", "sinus", "droite", "slalom", "hasard")
DETECTORS = ("bands", "threshold", "find_line")
# options of the robot, with the fields of FollowerSettings that they set
FIELDS = {
    "courbe": "curve", "bruit": "noise", "flou": "blur_s", "regard": "look_ahead", "kp": "kp", "ki": "ki",
    "kd": "kd", "vitesse": "speed_m_s", "bruit_roues": "wheel_noise", "bruit_gyro": "gyro_noise",
    "sans_voir": "bridging_s", "detecteur": "detector", "seed": "seed",
}  # fmt: skip
SCALES = {"flou": 1e-3}

OPTIONS = (
    click.option("--courbe", type=click.Choice(CURVES), default="circuit", show_default=True,
                 help="La ligne à suivre."),
    click.option("--bruit", type=float, metavar="σ", help="Bruit de l'image, niveaux de gris.  [défaut : 0]"),
    click.option("--flou", type=float, metavar="MS", help="Ouverture de l'obturateur, ms.  [défaut : 0]"),
    click.option("--vitesse", type=float, metavar="M/S", help="Vitesse du robot."),
    click.option("--kp", type=float, help="Gain proportionnel, rad/s par m."),
    click.option("--ki", type=float, help="Gain intégral, rad/s par m·s."),
    click.option("--kd", type=float, help="Gain dérivé, rad/s par m/s."),
    click.option("--regard", type=float, metavar="0…1", help="0 : rangée du bas ; 1 : rangée du milieu."),
    click.option("--bruit-roues", type=float, metavar="M/S", help="Bruit de l'odométrie des roues."),
    click.option("--bruit-gyro", type=float, metavar="RAD/S", help="Bruit du gyromètre."),
    click.option("--sans-voir", type=float, metavar="S", help="Durée de conduite sans voir la ligne."),
    click.option("--detecteur", type=click.Choice(DETECTORS), help="Ce qui cherche la ligne dans l'image."),
    click.option("--mon-detecteur", "own", type=click.Path(path_type=Path), metavar="FICHIER.py",
                 help="Le vôtre : un fichier qui définit detecter(image)."),
    click.option("--seed", "--graine", "seed", type=int, default=0, show_default=True, help="Du hasard."),
    click.option("--steps", "--pas", "steps", type=click.IntRange(1, 100_000), metavar="N",
                 help="Finir après N pas de 50 ms.  [défaut : à Ctrl-C]"),
    click.option("--duree", type=click.FloatRange(min=0.05), metavar="S", help="La même chose en secondes."),
    click.option("--vite", is_flag=True, help="Aussi vite que possible, avec --steps ou --duree."),
    click.option("--port", type=click.IntRange(0, 65535), default=PORT, show_default=True,
                 help="De la page ; 0 : le premier libre."),
    click.option("--no-browser", is_flag=True, help="Dire où est la page sans l'ouvrir."),
    as_json,
    click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
                 help="Écrire à la fin le rapport, sa figure et trajectoire.csv."),
    click.option("--force", is_flag=True, help="Remplacer un rapport plus ancien dans DIR."),
    click.option("--check", is_flag=True, help="Finir avec le code 3 si la ligne a été perdue."),
    config_option,
)  # fmt: skip


def _options(command: Command) -> Command:
    return with_options(command, OPTIONS)


@click.command(short_help="D2 : le suiveur de ligne, avec des curseurs.")
@_options
@in_one_sentence
def suiveur(**options: Any) -> int:
    """Montrer le robot suiveur de ligne (défi D2) sur une page de cet ordinateur.

    Le bruit de l'image, le flou de bougé, la vitesse et les gains du PID sont des curseurs : le robot roule
    pendant qu'on les déplace.  Où perd-il la ligne ?  Ctrl-C termine ; avec -o, le dernier trajet est écrit.

    Avec --mon-detecteur, c'est votre fonction detecter(image) qui cherche la ligne : l'image a 40 rangées de
    60 pixels, elle renvoie les colonnes de la ligne dans les rangées 37 et 20, ou None.  « Recommencer »
    relit le fichier.
    """
    from contextlib import ExitStack

    from factorlab.cli.delivery import deliver, require_output
    from factorlab.cli.stopping import stopping
    from factorlab.live.follower import FollowerServer, FollowerSession, OwnDetector, csv_of, document_of

    require_output(options["out"], None, force=options["force"])
    steps = _steps(options)
    settings = _settings(options)
    with stopping() as stop, ExitStack() as ending:
        ending.enter_context(redirect_stdout(sys.stderr))  # what a student's own detector prints
        with _patience():
            own = OwnDetector(options["own"]) if options["own"] is not None else None
            session = FollowerSession(settings, steps=steps, wait=not options["vite"], own=own)
        ending.callback(session.close)
        server = FollowerServer(session, options["port"])
        ending.callback(server.close)
        session.start()
        click.echo(f"suiveur : {server.address}  (Ctrl-C termine)", err=True)
        if not options["no_browser"]:
            click.launch(server.address)
        while not (stop.wait(0.05) or (steps is not None and session.ended.is_set())):
            pass
    if session.fault:
        click.echo(f"erreur : {session.fault}", err=True)
    if not session.driven:
        click.echo("le robot n'a pas roulé : rien à écrire", err=True)
        return DATA_ERROR if session.fault else 0
    document = document_of(session, command_line())
    files = {"trajectoire.csv": csv_of(session.driven[-1].rows)} if options["out"] is not None else {}
    code = deliver(
        document,
        as_json=options["as_json"],
        out=options["out"],
        force=options["force"],
        check=options["check"],
        files=files,
    )
    return DATA_ERROR if session.fault else code


@contextmanager
def _patience() -> Iterator[None]:
    """Say what is going on where it takes longer than a moment."""
    words = "préparation : la première fois, le calcul est compilé, ce qui prend une à deux minutes …"
    notice = threading.Timer(6.0, click.echo, (words,), {"err": True})
    notice.start()
    try:
        yield
    finally:
        notice.cancel()


def _settings(options: dict[str, Any]) -> FollowerSettings:
    """What the robot begins with; a value beyond its slider is the command line's fault."""
    from factorlab.l19.follower import FollowerSettings
    from factorlab.live.follower.controls import changed
    from sequential.errors import DataError

    settings = FollowerSettings()
    for option, name in FIELDS.items():
        if (value := options[option]) is None:
            continue
        try:
            settings = changed(settings, {name: value * SCALES[option] if option in SCALES else value})
        except DataError as error:
            raise click.BadParameter(str(error), param_hint=f"--{option.replace('_', '-')}") from error
    return settings


def _steps(options: dict[str, Any]) -> int | None:
    """How many steps a drive has; None for as many as there are."""
    from factorlab.l19.follower import PERIOD_S

    if options["steps"] is not None and options["duree"] is not None:
        raise click.UsageError("--steps et --duree disent la même chose : n'en donnez qu'une")
    if options["duree"] is not None:
        return max(1, round(float(options["duree"]) / PERIOD_S))
    if options["vite"] and options["steps"] is None:
        raise click.UsageError("--vite demande une fin : ajoutez --steps ou --duree")
    return None if options["steps"] is None else int(options["steps"])
