"""One call for every model: `search` for the one that most rows agree with, `finish` it by all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError, NotFiniteError, ShapeError, UnderConstrainedError
from vision3d.robust.backends import Outside
from vision3d.robust.curvature import covariance_by_differences
from vision3d.robust.found import Found, relative_weights, result_of
from vision3d.robust.model import RobustModel
from vision3d.robust.result import RobustFit
from vision3d.robust.settings import DEFAULT, RansacSettings

__all__ = ["Found", "assess", "fit", "refined", "relative_weights", "result_of", "search"]

Array = NDArray[np.float64]
MEDIAN = {1: 0.4549364, 2: 1.3862944, 3: 2.3659739}  # of chi squared, by degrees of freedom
WITHIN = {1: 6.25, 2: 9.0, 3: 11.0}  # of chi squared: some 99 %
PROSAC_TRIALS = 200_000.0
NO_HALF = 0.1  # of the data's standard deviation: errors that are no noise
SCATTERED = "no half of the rows agrees with one model, which LMedS needs; take method='ransac'"
REASONS = {1: "confidence reached", 2: "budget spent", 3: "all agree"}


def fit(
    model: RobustModel,
    data: Array,
    settings: RansacSettings = DEFAULT,
    *,
    sigma: Array | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit any model to rows of data; `fit_homography` and its like are this, with a covariance.

    Parameters
    ----------
    model : compiled, or `NumpyModel`
    data : (N, columns), rows best first for PROSAC's order
    settings : the threshold is in the unit of the model's error
    sigma : (N,) standard deviations of the rows' errors, where they differ; the threshold is then that of a
        row of median sigma
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        its model is (parameters,); its cov, of these, is by differences of the squared errors where the model
        has a fit and as many degrees of freedom as parameters, and else all NaN

    Raises
    ------
    DataError
        for data of another shape, not finite, or of fewer rows than a sample takes.
    UnderConstrainedError
        where no sample determines a model: all of them are degenerate.
    """
    weights = relative_weights(sigma, len(data))
    found = search(model, data, settings, weights, rng)
    cov = np.full((model.parameters, model.parameters), np.nan)
    with model.functions() as f:
        fitted = f.fit != 0
    if fitted and model.freedom == model.parameters:
        rows = checked_rows(model, data)
        cov = covariance_by_differences(
            lambda near: errors_under(model, rows, np.ones(len(rows)), near),
            found.weights,
            found.model,
            found.variance(sigma),
        )
    return result_of(found, found.model, cov)


def errors_under(model: RobustModel, rows: Array, weights: Array, given: Array) -> Array:
    """Squared errors (N,) of rows under a model (parameters,), times the weights."""
    from vision3d.kernels.robust_scoring import errors_of

    errors = np.empty(len(rows))
    with model.functions() as f:
        errors_of(f.residuals, rows, weights, np.array(given, dtype=np.float64), errors)
    return errors


def search(
    model: RobustModel,
    data: Array,
    settings: RansacSettings,
    weights: Array,
    rng: np.random.Generator | None = None,
) -> Found:
    """Look for the model that most rows agree with, by the project's own loop."""
    from vision3d.kernels.robust_loop import NONE_FOUND, robust_loop

    rows = checked_rows(model, data)
    n, threshold2 = len(rows), settings.threshold**2
    best, errors, share, told = np.zeros(model.parameters), np.empty(n), np.empty(n), np.zeros(4)
    seed = np.uint64(0 if rng is None else rng.integers(1 << 63))
    with model.functions() as f:
        addresses = np.array([f.solve, f.residuals, f.fit], np.int64)
        code = robust_loop(
            rows,
            weights,
            addresses,
            _sizes(model, settings),
            _options(settings, f.fit),
            seed,
            best,
            errors,
            told,
        )
        if code == NONE_FOUND:
            raise UnderConstrainedError(
                f"none of {int(told[0])} samples of {model.sample_size} rows determines a {model.name}: "
                "they are degenerate (all equal, or on one line); give rows that differ"
            )
    found = Found(best, errors, share, np.nan, threshold2, int(told[0]), REASONS[code])
    if settings.method == "lmeds":
        wide = replace(found, threshold2=median_threshold2(model, errors))
        found = refined(model, rows, settings, weights, wide)
        if found.sigma2 > 0.0:  # the median is over outliers too: those that agree know better
            found = replace(found, threshold2=WITHIN[model.error_dof] * found.sigma2)
        if found.threshold2 > (NO_HALF * rows.std(axis=0).max()) ** 2:
            found = replace(found, note=SCATTERED)
    return refined(model, rows, settings, weights, found)


def refined(model: RobustModel, data: Array, settings: RansacSettings, weights: Array, found: Found) -> Found:
    """The last fit again, from the model that `found` now holds; the rest of what it tells stays."""
    from vision3d.kernels.robust_polish import polish

    rows, best = checked_rows(model, data), found.model.copy()
    n, dof, blend = len(rows), model.error_dof, settings.refine == "mixture"
    errors, share, mixture = np.empty(n), np.empty(n), np.empty(5)
    with model.functions() as f:
        addresses = np.array([f.solve, f.residuals, f.fit], np.int64)
        polish(addresses, rows, weights, found.threshold2, dof, blend, best, errors, share, mixture)
    narrow2, noise2, inflation = mixture[2:]
    sigma2 = noise2 * _spare(model, errors, found.threshold2)
    inflation *= narrow2 / noise2 if noise2 > 0.0 else 1.0
    return replace(found, model=best, errors2=errors, weights=share, sigma2=sigma2, inflation=inflation)


def assess(
    model: RobustModel, data: Array, settings: RansacSettings, weights: Array, given: Array, outside: Outside
) -> Found:
    """What the loop would say of a model (parameters,) that somebody else has found, left as it is."""
    rows = checked_rows(model, data)
    errors = errors_under(model, rows, weights, given)
    robust = settings.method == "lmeds" or outside.backend.endswith("LMEDS")
    threshold2 = median_threshold2(model, errors) if robust else settings.threshold**2
    inside = errors < threshold2
    sigma2 = float(errors[inside].mean()) / model.error_dof if inside.any() else np.nan
    sigma2 *= _spare(model, errors, threshold2)
    share = np.where(inside, weights, 0.0)
    return Found(
        given, errors, share, sigma2, threshold2, outside.iterations, outside.stopped, outside.backend
    )


def median_threshold2(model: RobustModel, errors2: Array) -> float:
    """The squared threshold that LMedS takes from its median: some 99 % of Gaussian errors are below."""
    spare = max(len(errors2) - model.sample_size, 1)
    sigma2 = max(float(np.median(errors2)), 1e-30) / MEDIAN[model.error_dof]
    return WITHIN[model.error_dof] * sigma2 * (1.0 + 5.0 / spare) ** 2


def _spare(model: RobustModel, errors2: Array, threshold2: float) -> float:
    """Number of errors over number of degrees of freedom left, NaN where none is left."""
    errors = model.error_dof * int(np.count_nonzero(errors2 < threshold2))
    return errors / (errors - model.freedom) if errors > model.freedom else np.nan


def _sizes(model: RobustModel, settings: RansacSettings) -> NDArray[np.int64]:
    return np.array(
        [
            model.sample_size,
            model.max_solutions,
            model.block,
            model.inner_size,
            settings.inner_samples,
            model.solve_cost,
            model.redraws,
        ]
    )


def _options(settings: RansacSettings, fit_address: int) -> Array:
    kind = 2.0 if settings.method == "lmeds" else float(settings.score == "count")
    return np.array(
        [
            settings.threshold**2,
            settings.confidence,
            settings.max_iterations,
            kind,
            settings.order == "prosac",
            settings.local_optimisation and fit_address != 0,
            PROSAC_TRIALS,
        ],
        dtype=np.float64,
    )


def checked_rows(model: RobustModel, data: Array) -> Array:
    """The data as the loop takes it, or a sentence."""
    rows = np.ascontiguousarray(data, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != model.columns:
        raise ShapeError(f"a {model.name} is fitted to rows of {model.columns} numbers; got {rows.shape}")
    if len(rows) < model.sample_size:
        raise DataError(f"a {model.name} takes {model.sample_size} rows or more; got {len(rows)}")
    if not np.isfinite(rows).all():
        bad = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise NotFiniteError(f"row {bad} for the {model.name} is not finite: {rows[bad]}; leave it out")
    if model.max_solutions < 1:
        raise ModelError(f"{model.name}: max_solutions is at least 1; got {model.max_solutions}")
    return rows
