"""`factorlab l19` in French: headings, shared options, and every way to get a command line wrong."""

import click
import pytest
from click.testing import CliRunner

from factorlab.cli import main
from factorlab.cli.faults import in_one_sentence
from factorlab.cli.french import FrenchGroup
from sequential.errors import DataError

COMMANDS = ("check", "defi", "rapport", "suiveur")
ENGLISH = ("Usage: ", "Options:\n", "Show this", "default: ", "Error:", "Try '", "Invalid", "No such")


@click.group(cls=FrenchGroup)
def group():
    """Un groupe."""


@group.command(name="essai")
@click.argument("fichier", type=click.Path(exists=True, dir_okay=False))
@click.option("--nombre", type=float)
@click.option("--port", type=click.IntRange(0, 9), default=3, show_default=True)
@click.option("--choix", type=click.Choice(["un", "deux"]))
@click.option("--oui", is_flag=True)
@click.option("--faute", is_flag=True)
@in_one_sentence
def essai(fichier, nombre, port, choix, oui, faute):
    """Un essai : oui ?"""
    if faute:
        raise DataError("le fichier est vide")
    if oui:
        raise ZeroDivisionError("par zéro")
    return 0


def run(*words):
    return CliRunner().invoke(group, list(map(str, words)), prog_name="cours")


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help_is_in_french(name):
    done = CliRunner().invoke(main, ["l19", *name.split(), "--help"])
    assert done.exit_code == 0
    assert done.stdout.startswith("Usage : ")
    assert "Afficher cette aide." in done.stdout
    assert not [words for words in ENGLISH if words in done.stdout]


def test_the_other_commands_speak_english():
    done = CliRunner().invoke(main, ["line", "--help"])
    assert done.stdout.startswith("Usage: ")
    done = CliRunner().invoke(main, ["line", "nothing.png"])
    assert done.stderr.startswith("error: ")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("esai", "x"), "il n'y a pas de commande « esai » ; vouliez-vous dire essai ?"),
        (("essai",), "il manque : FICHIER"),
        (("essai", "nulle-part"), "FICHIER : il n'y a pas de fichier nulle-part"),
        (("essai", "."), "FICHIER : . est un dossier ; un fichier est attendu"),
        (("essai", __file__, "b"), "argument en trop : b"),
        (("essai", __file__, "--chox", "un"), "il n'y a pas d'option --chox ; vouliez-vous dire --choix ?"),
        (("essai", __file__, "--zzz"), "il n'y a pas d'option --zzz"),
        (("essai", __file__, "--nombre", "0,5"), "--nombre : « 0,5 » n'est pas un nombre (un point : 0.5)"),
        (("essai", __file__, "--nombre"), "l'option --nombre attend une valeur"),
        (("essai", __file__, "--port", "x"), "--port : « x » n'est pas un nombre entier"),
        (("essai", __file__, "--port", "12"), "--port : 12 n'est pas dans l'intervalle 0<=x<=9"),
        (("essai", __file__, "--choix", "dix"), "--choix : « dix » n'en fait pas partie : un, deux"),
        (("essai", __file__, "--oui=3"), "l'option --oui n'a pas de valeur"),
    ],
)
def test_a_wrong_command_line_is_told_in_french(words, told):
    done = run(*words)
    assert done.exit_code == 2
    assert done.stderr.splitlines()[-1].casefold() == f"erreur : {told}".casefold()
    assert not [english for english in ENGLISH if english in done.stderr]


def test_faults_are_told_in_french():
    done = run("essai", __file__, "--faute")
    assert (done.exit_code, done.stderr) == (1, "erreur : le fichier est vide\n")
    done = run("essai", __file__, "--oui")
    assert done.exit_code == 1
    assert done.stderr == "erreur : imprévue, ZeroDivisionError : par zéro ; --debug montre où\n"


def test_no_line_of_help_begins_with_a_colon():
    for name in COMMANDS:
        lines = CliRunner().invoke(main, ["l19", name, "--help"], terminal_width=60).stdout.splitlines()
        assert not [line for line in lines if line.lstrip().startswith((":", ";", "?", "!", "»"))]
