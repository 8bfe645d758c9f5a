"""A tuning on disk: the page of a comparison before and after, and the document beside it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from factorlab.compare import compare
from factorlab.compare.fitting import tuned_of
from factorlab.report.folder import MANIFEST, whole_folder
from factorlab.tuning.engine import Fitted

__all__ = ["write_document", "write_page"]

ESTIMATORS = ("ekf", "ekf_rts")  # one that sees the past and one that sees all: enough to see what noise does


def write_page(
    done: tuple[Fitted, ...],
    document: dict[str, Any],
    target: Path,
    *,
    force: bool = False,
    max_gap: float | None = None,
) -> Path:
    """Estimate with the noise as declared and as tuned, and write page, document and trajectories."""
    from factorlab.report import write_report

    comparisons = tuple(
        compare(one.dataset, ESTIMATORS, max_gap=max_gap, fitted=(tuned_of(one.tuning), one.tuning.model))
        for one in done
        if one.dataset is not None and one.tuning.model is not None
    )
    return write_report(comparisons, document, target, force=force)


def write_document(
    done: tuple[Fitted, ...],
    document: dict[str, Any],
    target: Path,
    *,
    force: bool = False,
    max_gap: float | None = None,
) -> Path:
    """Write `report.json` alone."""
    with whole_folder(target, force=force) as folder:
        text = json.dumps(document | {"files": [MANIFEST]}, indent=1, ensure_ascii=False, allow_nan=False)
        (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")
    return target / MANIFEST
