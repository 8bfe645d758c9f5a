"""Which exercises a file answers: by the names that it defines, read without running it."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

from factorlab.l19.exercises.fault import Fault
from factorlab.l19.exercises.signatures import misspelt

__all__ = ["EXERCISES", "OPTIONAL", "Survey", "survey"]

EXERCISES: dict[str, tuple[str, ...]] = {
    "E1": ("Kalman", "nis_moyen"),
    "E2": ("median_glissant", "detecter_sauts"),
    "E3": ("ajuster", "distance", "incertitude_distance"),
    "E4": ("composantes", "plus_gros_objet"),
}
# judged where a file offers one of these names; none of them is asked for
OPTIONAL: dict[str, tuple[str, ...]] = {
    "K3": (
        *("replier", "replier_angle", "normaliser_angle", "wrap", "wrap_angle", "wrap_to_pi"),
        *("innovation", "innovation_angle", "difference_angle", "ecart_angle"),
        *("KalmanAngle", "EKF", "KalmanEtendu"),
    ),
    "D3": ("points_sigma",),
}


@dataclass(frozen=True)
class Survey:
    """What a file holds: its names, the exercises they belong to, or the line where it is no Python."""

    path: Path
    names: tuple[str, ...] = ()
    exercises: tuple[str, ...] = ()
    fault: Fault | None = None

    def offered(self, exercise: str) -> list[str]:
        """Names of an exercise that the file defines."""
        return [name for name in {**EXERCISES, **OPTIONAL}[exercise] if name in self.names]

    def missing(self, exercise: str) -> dict[str, str]:
        """Names of an exercise that the file lacks, each with what may have been meant."""
        return {
            name: misspelt(name, (one for one in self.names if one not in EXERCISES[exercise]))
            for name in EXERCISES.get(exercise, ())
            if name not in self.names
        }

    def hints(self) -> list[str]:
        """What may have been meant in a file that has none of the names."""
        wanted = [name for names in EXERCISES.values() for name in names]
        return [f"`{name}`{hint}" for name in wanted if (hint := misspelt(name, self.names))]


def survey(path: Path, *, imported: bool = True) -> Survey:
    """Read a file's top-level names; with `imported`, those that it imports from its neighbours as well.

    Raises
    ------
    OSError
    """
    try:
        tree = ast.parse(path.read_bytes(), str(path))
    except SyntaxError as error:
        code = (error.text or "").strip()
        said = f"Python ne comprend pas cette ligne ({error.msg})"
        return Survey(path, fault=Fault("syntaxe", said, error.lineno, code))
    except ValueError as error:  # a null byte
        return Survey(path, fault=Fault("syntaxe", f"ce n'est pas un fichier Python ({error})"))
    names = tuple(dict.fromkeys(name for node in tree.body for name in _defined(node, imported=imported)))
    found = tuple(e for e, wanted in {**EXERCISES, **OPTIONAL}.items() if set(wanted) & set(names))
    return Survey(path, names, found)


def _defined(node: ast.stmt, *, imported: bool) -> list[str]:
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.Assign):
        return [target.id for target in node.targets if isinstance(target, ast.Name)]
    if isinstance(node, ast.ImportFrom) and imported:
        return [alias.asname or alias.name for alias in node.names]
    if isinstance(node, ast.If | ast.Try) and not _is_main(node):
        return [name for one in node.body for name in _defined(one, imported=imported)]
    return []


def _is_main(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and "__name__" in ast.dump(node.test)
