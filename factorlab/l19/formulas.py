r"""Displayed formulas of a page by name, and what checks each: neither without the other.

A page names a formula by an anchor on the line before it:

    <a id="gain"></a>

    $$
    K = P H^\top S^{-1}
    $$
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

from sequential.errors import DataError

__all__ = ["Checks", "read_formulas"]

BLOCK = re.compile(
    r'(?:<a id="(?P<name>[\w-]+)"></a>\s*)?^\$\$\n(?P<latex>.*?)\n\$\$$', re.MULTILINE | re.DOTALL
)


def read_formulas(page: Path) -> dict[str, str]:
    """LaTeX of every displayed formula of a Markdown page, by name, in order.

    Raises
    ------
    DataError
        where a formula has no name, or two share one.
    """
    found: dict[str, str] = {}
    for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
        name, latex = block["name"], " ".join(block["latex"].split())
        if name is None:
            raise DataError(f"{page.name}: the formula {latex!r} has no <a id=…> before it")
        if name in found:
            raise DataError(f"{page.name}: two formulas are called {name!r}")
        found[name] = latex
    return found


class Checks:
    """Functions that check formulas, by the names of the formulas."""

    def __init__(self) -> None:
        self.by_name: dict[str, Callable[[], str]] = {}

    def __call__(self, *names: str) -> Callable[[Callable[[], str]], Callable[[], str]]:
        """Decorator: the function asserts these formulas, and returns how ("SymPy").

        Raises
        ------
        ValueError
            where a name has a check already.
        """

        def register(function: Callable[[], str]) -> Callable[[], str]:
            for name in names:
                if name in self.by_name:
                    raise ValueError(f"the formula {name!r} has a check already")
                self.by_name[name] = function
            return function

        return register

    def run(self) -> dict[str, str]:
        """Run each check once; how each formula was checked, by its name.

        Raises
        ------
        AssertionError
            where a formula does not hold; the first line names it.
        """
        how: dict[Callable[[], str], str] = {}
        for name, function in self.by_name.items():
            if function not in how:
                try:
                    how[function] = function()
                except AssertionError as error:
                    raise AssertionError(f"{name}: {error}") from error
        return {name: how[function] for name, function in self.by_name.items()}

    def missing(self, names: Iterable[str]) -> list[str]:
        """Those of these names that have no check."""
        return [name for name in names if name not in self.by_name]
