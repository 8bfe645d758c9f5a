"""What went wrong in a student's code, in one sentence, with the line of theirs where it happened."""

from __future__ import annotations

import linecache
import re
import traceback
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

__all__ = ["Fault", "Stumble", "TooLongError", "fault_of"]

GLOSSES: tuple[tuple[type[BaseException], str, str], ...] = (
    (ZeroDivisionError, "", "une division par zéro"),
    (RecursionError, "", "trop d'appels récursifs : la pile de Python est limitée à un millier d'appels"),
    (MemoryError, "", "plus assez de mémoire : une liste grandit-elle sans fin ?"),
    (ModuleNotFoundError, "", "ce module n'est pas installé, ou n'est pas dans le dossier du fichier"),
    (NameError, "", "ce nom n'est pas défini à cet endroit (faute de frappe, ou self. oublié ?)"),
    (AttributeError, "'NoneType'", "une fonction a rendu None : un return oublié ?"),
    (AttributeError, "", "cet attribut n'existe pas (faute de frappe, ou oublié dans __init__ ?)"),
    (IndexError, "", "un indice sort du tableau"),
    (TypeError, "'NoneType'", "une valeur vaut None : un return oublié, ou une commande absente ?"),
    (TypeError, "argument", "les arguments ne sont pas ceux que la fonction attend"),
    (ValueError, "matmul", "les dimensions de ce produit ne s'accordent pas"),
    (ValueError, "broadcast", "les dimensions de ces tableaux ne s'accordent pas"),
    (ValueError, "aligned", "les dimensions de ce produit ne s'accordent pas"),
    (ValueError, "truth value", "une condition (if, and, not) porte sur un tableau entier"),
    (EOFError, "", "input() attend le clavier ; mettez cette ligne sous if __name__ == '__main__'"),
    (FileNotFoundError, "", "le fichier n'est pas dans le dossier de votre programme"),
    (SystemExit, "", "le programme s'arrête de lui-même (sys.exit, quit)"),
)  # fmt: skip


GUFUNC = re.compile(r", with gufunc signature .*?\)(?= \(size)")  # NumPy's own words for a product


class TooLongError(BaseException):
    """The time of a call is over; no Exception, so that `except Exception` of a student lets it pass."""


class Stumble(Exception):
    """A call of a student's function did not come back with a value."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(fault.said)
        self.fault = fault


@dataclass(frozen=True)
class Fault:
    """Why code of a student's stopped.

    Parameters
    ----------
    kind : str
        Name of the exception; "durée" for what took too long, "syntaxe", "mort" for a process that died.
    said : str
        One French sentence.
    line : int, optional
        Line of the student's file, from 1; None where none of theirs was on the stack.
    code : str
        That line, without its indentation.
    file : str
        The file of that line, where it is another one of the same folder.
    """

    kind: str
    said: str
    line: int | None = None
    code: str = ""
    file: str = ""

    def to_json(self) -> dict[str, Any]:
        """The fields, as a dictionary for JSON."""
        return asdict(self)

    @property
    def where(self) -> str:
        """`ligne 12 : « x = y + 1 »`, or nothing."""
        if self.line is None:
            return ""
        return f"ligne {self.line}{f' de {self.file}' if self.file else ''} : « {self.code} »"


def fault_of(error: BaseException, path: Path, limit_s: float = 0.0) -> Fault:
    """The sentence for an exception, with the deepest line of the student's own folder.

    Parameters
    ----------
    error : BaseException
        With its traceback.
    path : Path
        The student's file, absolute.
    limit_s : float
        What the call was allowed, for the sentence about a loop.
    """
    line, code, file = _line_of(error, path)
    if isinstance(error, TooLongError):
        return Fault(
            "durée", f"toujours pas fini après {limit_s:g} s : une boucle sans fin ?", line, code, file
        )
    kind, text = type(error).__name__, GUFUNC.sub("", " ".join(str(error).split()))
    gloss = next((g for t, part, g in GLOSSES if isinstance(error, t) and part in text), "")
    said = f"{kind}{f' : {text}' if text else ''}"
    return Fault(kind, f"{said} — {gloss}" if gloss else said, line, code, file)


def _line_of(error: BaseException, path: Path) -> tuple[int | None, str, str]:
    if isinstance(error, SyntaxError) and error.filename and Path(error.filename) == path:
        return error.lineno, (error.text or "").strip(), ""
    folder = path.parent
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        at = Path(frame.filename)
        if at == path or (at.parent == folder and at.suffix == ".py"):
            code = linecache.getline(frame.filename, frame.lineno or 0).strip()
            return frame.lineno, code, "" if at == path else at.name
    return None, "", ""
