"""Which lens?  The one that predicts views it has not seen, and of equals the simplest."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FactorlabError
from vision3d.calibrate.adjustment import Unknowns, adjust
from vision3d.calibrate.calibration import Calibration
from vision3d.calibrate.cross_validation import held_out_squares
from vision3d.calibrate.fit import calibrate
from vision3d.calibrate.look_alikes import folds_of
from vision3d.calibrate.problem import Problem
from vision3d.calibrate.result import result_of
from vision3d.calibrate.robust import Trusted, weights_of
from vision3d.lenses import LENSES
from vision3d.views import View

__all__ = ["CANDIDATES", "LensChoice", "LensScore", "choose_lens"]

Array = NDArray[np.float64]

CANDIDATES = ("pinhole", "brown1", "brown2", "brown4", "brown5", "rational8", "thin12", "fisheye4")
"""Lenses that are tried by default."""
AS_GOOD = 1.005
"""Lenses whose held-out error is within this factor of the best are as good: the simplest of them wins."""
MOST_FOLDS, FOLDS_OF_MANY, MANY = 30, 10, 60
"""With more than 30 views several are held out at a time, with more than 60 a tenth of them."""


@dataclass(frozen=True, eq=False)
class LensScore:
    """How one lens did.

    Attributes
    ----------
    lens : str
        Its name.
    coefficients : int
        Coefficients of its distortion.
    train_rms_px, held_out_rms_px : float
        Root mean square distance of corners from the fit to all views, and from fits without their view.
    view_rms : Array
        The latter for every view, (V,).
    folds_inside : bool
        Whether its distortion folds within the image: it must not be used there.
    seconds : float
        What it took.
    remark : str
        Why it was not chosen, or could not be tried; empty for the one chosen.
    calibration : Calibration | None
        With all views; None where it could not be tried.
    """

    lens: str
    coefficients: int
    train_rms_px: float
    held_out_rms_px: float
    view_rms: Array
    folds_inside: bool
    seconds: float
    remark: str
    calibration: Calibration | None


@dataclass(frozen=True, eq=False)
class LensChoice:
    """All lenses tried, the one chosen, why, and its calibration."""

    table: tuple[LensScore, ...]
    chosen: str
    why: str
    calibration: Calibration

    def score(self, lens: str) -> LensScore:
        """The row of one lens."""
        return next(row for row in self.table if row.lens == lens)


def choose_lens(
    views: Sequence[View],
    lenses: Sequence[str] = CANDIDATES,
    *,
    robust: bool = True,
    board_warp: bool = False,
    progress: Callable[[str], object] = lambda _: None,
) -> LensChoice:
    """Calibrate with every lens, leave views out, and choose by the error on them.

    Parameters
    ----------
    views : Sequence[View]
        At least four: one is left out at a time.
    lenses : Sequence[str]
        Names of lenses to try.
    robust, board_warp : bool
        As in `calibrate`.  Which corners count is decided once, by the lens that fits best: one that is
        too simple must not choose its own corners.
    progress : Callable[[str], object]
        Hears the name of every lens that is begun.

    Returns
    -------
    LensChoice
        The simplest lens whose held-out error is within 0.5 % of the best of those that do not fold within
        the image (of all, if all do).

    Raises
    ------
    DataError
        Too few views to leave one out; or what `calibrate` raises, if no lens can be tried.
    """
    views = tuple(views)
    if len(views) < 4:
        raise DataError(f"choosing a lens takes at least 4 views, to leave one out; got {len(views)}")
    fits, refused, took = _fits(views, lenses, robust=robust, board_warp=board_warp, progress=progress)
    if not fits:
        raise next(iter(refused.values()))
    best_fit = min(fits.values(), key=_typical)
    problem = Problem.of(views, best_fit.floor_px, best_fit.sigma_scale)
    weights = np.concatenate(best_fit.weights)
    rows = []
    for lens in lenses:
        began = time.perf_counter()
        if lens in refused:
            rows.append(_refusal(lens, len(views), took[lens], str(refused[lens])))
            continue
        found = _as_judged_by(best_fit, fits[lens], problem, weights)
        rows.append(_score(found, problem, weights, took[lens] - began))
    return _chosen(rows)


def _refusal(lens: str, views: int, seconds: float, why: str) -> LensScore:
    n, nothing = len(LENSES[lens].distortion), np.full(views, np.nan)
    return LensScore(
        lens, n, np.nan, np.nan, nothing, folds_inside=False, seconds=seconds, remark=why, calibration=None
    )


def _fits(
    views: tuple[View, ...],
    lenses: Sequence[str],
    *,
    robust: bool,
    board_warp: bool,
    progress: Callable[[str], object],
) -> tuple[dict[str, Calibration], dict[str, FactorlabError], dict[str, float]]:
    """Calibrations, refusals and seconds by lens; one of each family begins from nothing."""
    fits: dict[str, Calibration] = {}
    refused: dict[str, FactorlabError] = {}
    took: dict[str, float] = {}
    family: dict[bool, Calibration] = {}
    for lens in sorted(lenses, key=lambda name: abs(len(LENSES[name].distortion) - 5)):
        progress(lens)
        began, is_fisheye = time.perf_counter(), LENSES[lens].is_fisheye
        try:
            fits[lens] = calibrate(
                views, lens, robust=robust, board_warp=board_warp, start=family.get(is_fisheye)
            )
            family.setdefault(is_fisheye, fits[lens])
        except FactorlabError as error:
            refused[lens] = error
        took[lens] = time.perf_counter() - began
    return fits, refused, took


def _typical(found: Calibration) -> float:
    """Median residual: a lens that leaves corners out must not gain by it."""
    return float(np.median(np.linalg.norm(np.concatenate(found.residuals), axis=1)))


def _as_judged_by(best: Calibration, found: Calibration, problem: Problem, weights: Array) -> Calibration:
    """The same lens fitted to the corners that count for all, and as much as for all."""
    if found.floor_px == best.floor_px and np.array_equal(np.concatenate(found.weights), weights):
        return found
    free = np.ones(found.camera.count + 2, dtype=bool)
    free[-2:] = found.warp_std > 0.0
    begun = Unknowns(found.camera.lens, found.camera.parameters, found.warp, found.poses)
    solution = adjust(problem, begun, weights_of(problem, weights), free)
    trusted = Trusted(solution, weights, best.outlier_views, solution.iterations)
    return result_of(found.views, problem, trusted, free)


def _score(found: Calibration, problem: Problem, weights: Array, offset: float) -> LensScore:
    most = MOST_FOLDS if len(found.views) <= MANY else FOLDS_OF_MANY
    squares, _ = held_out_squares(problem, found, weights, folds_of(found.views, most))
    full = weights == 1.0
    own = np.sum(np.concatenate(found.residuals) ** 2, axis=1)
    return LensScore(
        found.camera.lens,
        len(found.camera.distortion),
        float(np.sqrt(np.mean(own[full]))),
        float(np.sqrt(np.mean(squares[full]))),
        np.sqrt([np.mean(one) for one in problem.split(squares)]),
        found.camera.check_monotonic().inside,
        time.perf_counter() + offset,
        "",
        found,
    )


def _chosen(rows: list[LensScore]) -> LensChoice:
    """Apply the rule, and say why."""
    tried = [row for row in rows if row.calibration is not None and np.isfinite(row.held_out_rms_px)]
    usable = [row for row in tried if not row.folds_inside] or tried
    best = min(usable, key=lambda row: row.held_out_rms_px)
    equal = [row for row in usable if row.held_out_rms_px <= AS_GOOD * best.held_out_rms_px]
    chosen = min(equal, key=lambda row: (row.coefficients, row.held_out_rms_px))
    table = tuple(_remarked(row, chosen, usable) for row in rows)
    why = f"{chosen.lens} predicts views left out to {chosen.held_out_rms_px:.3f} px"
    if chosen is best:
        why += ", best of all"
    else:
        why += f": as well as {best.lens} ({best.held_out_rms_px:.3f} px), with fewer coefficients"
    assert chosen.calibration is not None  # noqa: S101 - only such rows were considered
    return LensChoice(table, chosen.lens, why, chosen.calibration)


def _remarked(row: LensScore, chosen: LensScore, usable: list[LensScore]) -> LensScore:
    if row.calibration is None or row is chosen:
        return row
    if row not in usable:
        return replace(row, remark="its distortion folds within the image")
    times = row.held_out_rms_px / chosen.held_out_rms_px
    remark = f"{100.0 * (times - 1.0):.1f} % worse on views left out"
    if times > 2.0:
        remark = f"{times:.3g}x worse on views left out"
    elif times <= 1.0:
        remark = "no better, with more coefficients"
    return replace(row, remark=remark)
