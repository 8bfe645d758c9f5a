"""Which exercises a file answers: by the names that it defines, read without running it."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field
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
# judged where a file defines one of these with so many arguments; none of them is asked for
OPTIONAL: dict[str, dict[str, int]] = {
    "K3": {
        **dict.fromkeys(
            ("replier", "replier_angle", "normaliser_angle", "wrap", "wrap_angle", "wrap_to_pi"), 1
        ),
        **dict.fromkeys(("innovation", "innovation_angle", "difference_angle", "ecart_angle"), 2),
        **dict.fromkeys(("KalmanAngle", "EKF", "KalmanEtendu"), 7),
    },
    "D3": {"points_sigma": 3},
}
# names that many programs have say nothing by themselves
COMMON = {"distance"}


@dataclass(frozen=True)
class Survey:
    """What a file holds: its names, those of each exercise, or the line where it is no Python."""

    path: Path
    names: tuple[str, ...] = ()
    offers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fault: Fault | None = None

    @property
    def exercises(self) -> tuple[str, ...]:
        """The exercises that the file answers."""
        return tuple(self.offers)

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
    own = _names(tree, imported=False)
    names = _names(tree, imported=True) if imported else own
    offers = {
        exercise: tuple(name for name in wanted if name in names)
        for exercise, wanted in EXERCISES.items()
        if (set(wanted) - COMMON) & set(own)
    }
    for exercise, counts in OPTIONAL.items():
        if found := tuple(name for node in tree.body if (name := _fitting(node, counts))):
            offers[exercise] = found
    return Survey(path, names, offers)


def _names(tree: ast.Module, *, imported: bool) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for node in tree.body for name in _defined(node, imported=imported)))


def _fitting(node: ast.stmt, counts: Mapping[str, int]) -> str:
    """The name of a definition that can be called with its number of arguments, or nothing."""
    function: ast.stmt | None = node
    if isinstance(node, ast.ClassDef):
        function = next((f for f in node.body if getattr(f, "name", "") == "__init__"), None)
        if function is None and node.bases and node.name in counts:
            return node.name  # the arguments of the class that it extends
    if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name not in counts:
        return ""
    if not isinstance(function, ast.FunctionDef):
        return ""
    given = function.args
    most = len(given.posonlyargs) + len(given.args) - isinstance(node, ast.ClassDef)
    least = most - len(given.defaults)
    fits = least <= counts[node.name] and (given.vararg is not None or counts[node.name] <= most)
    return node.name if fits else ""


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
