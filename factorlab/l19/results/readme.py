"""The table id -> file -> command -> result of the course's README, made from RESULTATS.md."""

from __future__ import annotations

from collections.abc import Sequence

from factorlab.l19.results.course import COURSE
from factorlab.l19.results.numbers import band_text
from factorlab.l19.results.page import row_line, table_lines
from factorlab.l19.results.reading import Row
from sequential.errors import FileFormatError

__all__ = ["BEGIN", "END", "readme_table", "table_in", "with_table"]

BEGIN, END = "<!-- tableau -->", "<!-- fin du tableau -->"


def readme_table(rows: Sequence[Row]) -> str:
    """One line a file: the first figure it states is its result."""
    lines = table_lines(("", "ce que c'est", "fichier", "commande", "résultat"))
    for item in COURSE:
        for script in sorted({row.script for row in rows if row.claim.item == item.id}):
            command = f"`{item.command}`" if item.command else f"`python examples/l19/{script}`"
            cells = (f"**{item.id}**", item.title, f"[`{script}`]({script})", command, _result(script, rows))
            lines.append(row_line(cells))
    return "\n".join(lines)


def _result(script: str, rows: Sequence[Row]) -> str:
    mine = [row for row in rows if row.script == script]
    row = next((row for row in mine if row.claim.judged), mine[0])
    band = f" (tolérance {band_text(row.claim.low, row.claim.high)})" if row.claim.judged else ""
    return f"{row.claim.quantity} : {row.written}{band}"


def table_in(text: str) -> str:
    """What stands between the markers.

    Raises
    ------
    FileFormatError
        where a marker is missing.
    """
    _, begin, rest = text.partition(BEGIN)
    table, end, _ = rest.partition(END)
    if not begin or not end:
        raise FileFormatError(
            f"README : le tableau va entre {BEGIN} et {END} ; il manque une des deux marques"
        )
    return table.strip()


def with_table(text: str, table: str) -> str:
    """The text with the table between its markers."""
    table_in(text)
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return f"{head}{BEGIN}\n\n{table}\n\n{END}{tail}"
