"""Everything that a comparison leaves on disk."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from factorlab.compare import Comparison
from factorlab.compare.accuracy import has_position
from factorlab.report.folder import MANIFEST, whole_folder
from factorlab.report.tum import write_tum

__all__ = ["write_report"]


def write_report(
    comparisons: tuple[Comparison, ...], document: dict[str, Any], target: Path, *, force: bool = False
) -> Path:
    """Write page, JSON and trajectories, all or nothing; returns the path of the page.

    Raises
    ------
    OutputExistsError
        where `target` holds files and `force` is False.
    """
    from factorlab.report.page import render  # matplotlib is loaded here, and not to check a folder

    with whole_folder(target, force=force) as folder:
        (folder / "report.html").write_text(render(comparisons, document), encoding="utf-8")
        for comparison in comparisons:
            _trajectories(comparison, folder / "trajectories", several=len(comparisons) > 1)
        files = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
        text = json.dumps(
            document | {"files": [*files, MANIFEST]}, indent=1, ensure_ascii=False, allow_nan=False
        )
        (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")
    return target / "report.html"


def _trajectories(comparison: Comparison, folder: Path, *, several: bool) -> None:
    if not has_position(comparison.dataset):
        return
    place = folder / comparison.name.replace(" ", "_").replace("/", "_") if several else folder
    place.mkdir(parents=True, exist_ok=True)
    for row in comparison.rows:
        if row.run is not None:
            write_tum(place / f"{row.name}.tum", comparison.dataset, row.run)
