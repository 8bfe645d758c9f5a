"""The same search by every backend, in one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from sequential.errors import FactorlabError, ToolMissingError
from vision3d.robust.result import RobustFit
from vision3d.robust.settings import RansacSettings

__all__ = ["BACKENDS", "BackendRow", "compare_backends", "table_of"]

BACKENDS: Mapping[str, Mapping[str, Any]] = {
    "own": {"backend": "own"},
    "own LMedS": {"backend": "own", "method": "lmeds"},
    "opencv RANSAC": {"backend": "opencv", "opencv_method": "RANSAC"},
    "opencv LMEDS": {"backend": "opencv", "opencv_method": "LMEDS"},
    "opencv RHO": {"backend": "opencv", "opencv_method": "RHO"},
    "opencv USAC_DEFAULT": {"backend": "opencv", "opencv_method": "USAC_DEFAULT"},
    "opencv USAC_ACCURATE": {"backend": "opencv", "opencv_method": "USAC_ACCURATE"},
    "opencv USAC_PROSAC": {"backend": "opencv", "opencv_method": "USAC_PROSAC"},
    "opencv USAC_MAGSAC": {"backend": "opencv", "opencv_method": "USAC_MAGSAC"},
    "poselib": {"backend": "poselib"},
}


@dataclass(frozen=True, slots=True, eq=False)
class BackendRow:
    """What one backend gave: its fit, or why there is none; and the median of the seconds it took."""

    name: str
    fit: RobustFit | None
    failure: str
    seconds: float


def compare_backends(
    work: Callable[[RansacSettings, np.random.Generator], RobustFit],
    settings: RansacSettings,
    *,
    seed: int = 0,
    runs: int = 5,
) -> list[BackendRow]:
    """Run `work(settings, rng)` with each backend in turn; PoseLib is left out where it is not installed.

    Parameters
    ----------
    work : as `lambda settings, rng: fit_homography(a, b, settings, rng=rng)`
    settings : those that all share; backend, method and OpenCV's method are set here
    seed : of every backend's first run, which is the one that is shown
    runs : of each, taken in turn, after one that does not count
    """
    rows: dict[str, BackendRow] = {}
    times: dict[str, list[float]] = {name: [] for name in BACKENDS}
    for run in range(runs + 1):
        for name, chosen in BACKENDS.items():
            if name in rows and rows[name].fit is None:
                continue
            changes: dict[str, Any] = {"method": "ransac", **chosen}
            asked = replace(settings, **changes)
            began = perf_counter()
            try:
                fit, failure = work(asked, np.random.default_rng(seed)), ""
            except ToolMissingError:
                times.pop(name, None)
                continue
            except FactorlabError as refusal:
                fit, failure = None, str(refusal)
            if run > 0 or fit is None:
                times[name].append(perf_counter() - began)
            rows[name] = BackendRow(name, fit, failure, 0.0)
    return [replace(row, seconds=float(np.median(times[name]))) for name, row in rows.items()]


def table_of(rows: list[BackendRow], error: Callable[[RobustFit], float] | None = None) -> str:
    """The rows as text; `error` measures a fit against the truth, where there is one."""
    width = max(len(row.name) for row in rows)
    lines = [f"{'backend':<{width}}  {'inliers':>7}  {'sigma':>8}  {'score':>6}  {'ms':>8}  {'error':>8}"]
    for row in rows:
        if row.fit is None:
            lines.append(f"{row.name:<{width}}  {row.failure}")
            continue
        far = "" if error is None else f"{error(row.fit):8.3g}"
        lines.append(
            f"{row.name:<{width}}  {row.fit.count:7d}  {row.fit.sigma:8.3g}  {row.fit.score:6.3f}  "
            f"{1e3 * row.seconds:8.2f}  {far:>8}".rstrip()
        )
    return "\n".join(lines)
