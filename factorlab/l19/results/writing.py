"""The page and its pictures on disk: whole, the page last, or not at all."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from factorlab.l19.results.course import PICTURED, part_of
from factorlab.l19.results.page import Work, results_page
from factorlab.l19.results.pictures import small_png
from factorlab.l19.results.running import Outcome
from factorlab.report.folder import OutputExistsError
from sequential.readers.files import replacing

__all__ = ["page_path", "require_page", "write_results"]

_LINK = re.compile(r"!\[[^\]]*\]\(([^)]+\.png)\)")


def page_path(out: Path) -> Path:
    """The page itself: `out` where that names a Markdown file, else RESULTATS.md in the folder `out`."""
    return out if out.suffix == ".md" else out / "RESULTATS.md"


def require_page(out: Path, *, force: bool) -> None:
    """Raise unless the page may be written; called before the work is done.

    Raises
    ------
    OutputExistsError
        where it is there and `force` is False, or where a file stands in the way.
    """
    page = page_path(out)
    if page.exists() and not force:
        raise OutputExistsError(
            f"{page} existe déjà ; choisissez un autre dossier avec -o, ou remplacez-le avec --force"
        )
    standing = next(parent for parent in page.absolute().parents if parent.exists())
    if not standing.is_dir() or page.is_dir():
        raise OutputExistsError(f"{page} ne peut pas être écrit : {standing} n'est pas un dossier")


def write_results(work: Work, out: Path, images: Path | None = None) -> Path:
    """Write page and pictures; pictures that an earlier page linked to and this one does not are taken away.

    Parameters
    ----------
    out : the folder, or a Markdown file
    images : the folder of the pictures; `figures` beside the page unless given
    """
    page = page_path(out)
    folder = images or page.parent / "figures"
    before = {path for path in _linked(page) if path.parent == folder.resolve()}
    chosen = {f"{path.stem}.png": path for one in work.outcomes for path in _shown(one)}
    links = {
        one.script.stem: [_link(folder / path.name, page) for path in _shown(one)] for one in work.outcomes
    }
    beside = [one.script for one in work.outcomes if _below(one.script, page)]
    sources = {script.name: _link(script, page) for script in beside}
    text = results_page(replace(work, pictures=links, sources=sources))
    folder.parent.mkdir(parents=True, exist_ok=True)
    page.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".resultats-", dir=folder.parent) as temporary:
        for name, path in chosen.items():
            (Path(temporary) / name).write_bytes(small_png(path))
        folder.mkdir(exist_ok=True)
        for name in chosen:
            (Path(temporary) / name).replace(folder / name)
    with replacing(page) as file:
        file.write(text)
    for path in before - {(folder / name).resolve() for name in chosen}:
        path.unlink(missing_ok=True)
    return page


def _shown(outcome: Outcome) -> Sequence[Path]:
    return outcome.pictures if part_of(outcome.item) in PICTURED else ()


def _link(path: Path, page: Path) -> str:
    return Path(os.path.relpath(path.absolute(), page.absolute().parent)).as_posix()


def _below(script: Path, page: Path) -> bool:
    """Whether the page's folder holds the script, so that whoever has the one has the other."""
    return script.resolve().is_relative_to(page.resolve().parent)


def _linked(page: Path) -> set[Path]:
    """Pictures that an earlier page links to."""
    if not page.is_file():
        return set()
    links = _LINK.findall(page.read_text(encoding="utf-8"))
    return {(page.resolve().parent / link).resolve() for link in links}
