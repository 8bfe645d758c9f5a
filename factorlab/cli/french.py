"""A group of commands that speaks French: its help, and what click says of a wrong command line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import IO, Any

import click

from factorlab.typography import bound

__all__ = ["FrenchContext", "FrenchFormatter", "FrenchGroup", "french"]

HELP = {
    "Show this message and exit.": "Afficher cette aide.",
    "Show the traceback of an error.": "Montrer où une erreur s'est produite.",
    "One JSON document on stdout, all else on stderr.": "Un document JSON sur la sortie, le reste à côté.",
    "Options from a file: use_every = 5, estimators = ['ekf', 'batch'] …; the command line wins.":
        "Options lues dans un fichier ; celles de la ligne de commande l'emportent.",
}  # fmt: skip
KINDS = ((" RANGE", ""), (" INTEGER", " ENTIER"), (" FLOAT", " NOMBRE"))
EXTRAS = (("[default: ", "[défaut : "), ("[required]", "[obligatoire]"))
# what click says, and the same in French
SENTENCES = (
    (r"No such command '(.+?)'\.?", r"il n'y a pas de commande « \1 »"),
    (r"No such option:? '?(-[^\s'.]+)'?\.?", r"il n'y a pas d'option \1"),
    (r"Missing argument '(.+?)'\.?", r"il manque : \1"),
    (r"Missing option '(.+?)'\.?", r"il manque l'option \1"),
    (r"Missing command\.?", "il manque une commande"),
    (r"Option '(.+?)' requires (?:an argument|\d+ arguments)\.?", r"l'option \1 attend une valeur"),
    (r"Option '(.+?)' does not take a value\.?", r"l'option \1 n'a pas de valeur"),
    (r"Got unexpected extra arguments? \((.+?)\)\.?", r"argument en trop : \1"),
    (r"Invalid value for '?([^':]+)'?:", r"\1 :"),
    (r"'(.*?)' is not a valid integer(?: range)?\.?", r"« \1 » n'est pas un nombre entier"),
    (
        r"'(.*?)' is not a valid float(?: range)?\.?",
        r"« \1 » n'est pas un nombre (un point : 0.5)",
    ),
    (r"'(.*?)' is not a valid (?:boolean|UUID)\.?.*", r"« \1 » ne convient pas"),
    (r"(\S+) is not in the range (.+?)\.?$", r"\1 n'est pas dans l'intervalle \2"),
    (r"'(.*?)' is not one of (.+?)\.?$", r"« \1 » n'en fait pas partie : \2"),
    (r"(?:File|Path) '(.+?)' does not exist\.?", r"il n'y a pas de fichier \1"),
    (r"Directory '(.+?)' does not exist\.?", r"il n'y a pas de dossier \1"),
    (r"File '(.+?)' is a directory\.?", r"\1 est un dossier ; un fichier est attendu"),
    (r"Directory '(.+?)' is a file\.?", r"\1 est un fichier ; un dossier est attendu"),
    (r"(?:File|Path|Directory) '(.+?)' is not readable\.?", r"\1 ne peut pas être lu"),
    (r" ?\(?Did you mean (?:one of: )?(.+?)\?\)?$", r" ; vouliez-vous dire \1 ?"),
    (r" ?\(Possible options: (.+?)\)$", r" ; vouliez-vous dire \1 ?"),
)


def french(message: str) -> str:
    """What click says, in French; what it does not know stays as it is."""
    for pattern, words in SENTENCES:
        message = re.sub(pattern, words, message)
    return re.sub(r"'(-?[\w-]+)'", r"\1", message)  # names stand without quotes


def _replaced(text: str, pairs: Iterable[tuple[str, str]]) -> str:
    for before, after in pairs:
        text = text.replace(before, after)
    return text


class FrenchFormatter(click.HelpFormatter):
    """Help with French headings, and with French words for what click and shared options say."""

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """`Usage : factorlab l19 …`."""
        args = args.replace("COMMAND [ARGS]...", "COMMANDE [ARGUMENTS]…")
        super().write_usage(prog, args, "Usage : " if prefix is None else prefix)

    def write_heading(self, heading: str) -> None:
        """Headings have a space before the colon."""
        super().write_heading({"Commands": "Commandes"}.get(heading, heading) + " ")

    def write_dl(self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2) -> None:
        """Options or commands, each with what it is for."""
        told = [
            (_replaced(name, KINDS), bound(_replaced(HELP.get(words, words), EXTRAS))) for name, words in rows
        ]
        super().write_dl(told, col_max, col_spacing)

    def write_text(self, text: str) -> None:
        """A paragraph."""
        super().write_text(bound(text))


class FrenchContext(click.Context):
    """What runs in it is told of in French: `factorlab.cli.faults` asks for the language."""

    formatter_class = FrenchFormatter

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.meta["factorlab.language"] = "fr"


class FrenchUsageError(click.UsageError):
    """A wrong command line, in French."""

    def show(self, file: IO[Any] | None = None) -> None:
        """How the command is used, where its help is, and what is wrong."""
        if self.ctx is not None:
            click.echo(self.ctx.get_usage(), file=file, err=file is None, color=self.ctx.color)
            click.echo(f"Aide : {self.ctx.command_path} --help\n", file=file, err=file is None)
        click.echo(f"erreur : {self.format_message()}", file=file, err=file is None)


class FrenchGroup(click.Group):
    """A group whose commands, written by whomever, are explained and corrected in French."""

    context_class = FrenchContext

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Take a command, which speaks French from then on."""
        cmd.context_class = FrenchContext
        super().add_command(cmd, name)

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """Read the group's own options."""
        with _in_french():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Find the command, read its options, run it."""
        with _in_french():
            return super().invoke(ctx)


@contextmanager
def _in_french() -> Iterator[None]:
    try:
        yield
    except (FrenchUsageError, click.exceptions.NoArgsIsHelpError):
        raise
    except click.UsageError as error:
        raise FrenchUsageError(french(error.format_message()), error.ctx) from error
