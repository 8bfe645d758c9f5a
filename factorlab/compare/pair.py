"""Which filter and which smoother stand for their kind where a figure has room for two."""

from __future__ import annotations

from typing import TYPE_CHECKING

from factorlab.compare.estimators import KINDS

if TYPE_CHECKING:
    from factorlab.compare.table import Row

__all__ = ["filter_of", "smoother_of"]

SMOOTHERS = ("batch", "ieks", "isam2_final", "ekf_rts", "kf_rts")


def filter_of(rows: tuple[Row, ...]) -> Row | None:
    """The first online estimator that was solved."""
    return next((row for row in rows if not row.failed and KINDS[row.name].online), None)


def smoother_of(rows: tuple[Row, ...]) -> Row | None:
    """The batch graph, or else the best stand-in for it that was solved."""
    solved = {row.name: row for row in rows if not row.failed}
    return next((solved[name] for name in SMOOTHERS if name in solved), None)
