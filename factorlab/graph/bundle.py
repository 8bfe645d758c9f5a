"""Bundle adjustment of a reconstruction: GTSAM's own factors where it has them, compiled Jacobians elsewhere.

    result = bundle_adjust(model, loss="soft_l1")
    result.reconstruction, result.cost            # COLMAP's cost: ½ Σ ρ(|r|²), px²
    result.centre_covs, result.point_covs         # in the gauge that was asked for

Both routes find the same minimum; which one was taken stands in the result.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.bundle_native import (
    ESTIMATORS,
    native_bundle,
    optimise_bundle,
    optimise_reweighted,
)
from sequential.errors import DataError, ModelError, SolverError
from vision3d.sfm.adjustment import Adjusted, adjust, cost_of
from vision3d.sfm.bundle_covariance import bundle_covariances, noise_px
from vision3d.sfm.bundle_problem import BundleProblem, BundleState, bundle_problem, resettled
from vision3d.sfm.gauge import check_gauge, restore
from vision3d.sfm.losses import check_loss
from vision3d.sfm.rank import check_seen, decrement_of
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["BundleResult", "bundle_adjust"]

Array = NDArray[np.float64]

ROUTES = ("auto", "native", "compiled")
FEW = 20_000
"""Observations up to which GTSAM's factors are weighed anew, round by round, for a loss that it lacks."""
SETTLED = 1e-6
"""Share of the cost that one more step may still promise."""


@dataclass(frozen=True, eq=False)
class BundleResult:
    """An adjusted reconstruction, and how far it can be trusted; arrays are read-only.

    Parameters
    ----------
    reconstruction : the same images, points and observations where they now are
    initial_cost, cost : ½ Σ ρ(|r|²) in px², before and after
    iterations : of the optimiser
    decrement : what one more Gauss-Newton step promises to take off the cost, px²
    message : what is wrong, or nothing
    seconds : of the solve, without the covariances
    route : `"native"`, GTSAM's factors, or `"compiled"`
    loss : name of the robust loss
    gauge : in which the covariances are stated
    sigma_px : standard deviation of a pixel coordinate that scales them
    free : names of what moved in every camera
    pose_covs : (V, 6, 6) of `cameras_T_world` in the right chart, rotation then translation; None where not
        asked
    centre_covs : (V, 6, 6) of the inverse poses: attitude, then the camera's centre, along the camera's axes
    point_covs : (P, 3, 3) in the world
    intrinsics_covs : for every camera the covariance of its `free` parameters
    """

    reconstruction: Reconstruction
    initial_cost: float
    cost: float
    iterations: int
    decrement: float
    message: str
    seconds: float
    route: str
    loss: str
    gauge: str
    sigma_px: float
    free: tuple[tuple[str, ...], ...]
    pose_covs: Array | None = None
    centre_covs: Array | None = None
    point_covs: Array | None = None
    intrinsics_covs: tuple[Array, ...] | None = None

    def __post_init__(self) -> None:
        arrays = (self.pose_covs, self.centre_covs, self.point_covs, *(self.intrinsics_covs or ()))
        for array in arrays:
            if array is not None:
                array.flags.writeable = False

    @property
    def converged(self) -> bool:
        """Whether one more step promises next to nothing."""
        return not self.message


def bundle_adjust(
    reconstruction: Reconstruction,
    *,
    refine_intrinsics: bool | Sequence[str] = True,
    fixed: Sequence[int] = (),
    loss: str | None = None,
    loss_px: float = 1.0,
    gauge: str = "first pose and scale",
    covariances: bool = True,
    sigma_px: float | None = None,
    route: str = "auto",
    max_iterations: int = 100,
) -> BundleResult:
    """Move cameras and points to where the observed pixels are most likely.

    Parameters
    ----------
    reconstruction : where to begin
    refine_intrinsics : True for focal lengths and distortion (images of one camera share them), False to hold
        them, or names of parameters: see `vision3d.sfm.intrinsics.free_names`
    fixed : images whose poses are held
    loss : None for least squares, `"huber"`, `"cauchy"` or `"soft_l1"`: Ceres' and COLMAP's
    loss_px : residual from which the loss begins to doubt
    gauge : what the covariances take as known: `"first pose and scale"`, `"centres"` or `"points"`, see
        `vision3d.sfm.gauge`.  The result itself keeps the first pose and the scale, unless poses are fixed
    covariances : also compute them
    sigma_px : standard deviation of a pixel coordinate; None to take it from the residuals
    route : `"native"`, GTSAM's C++ factors; `"compiled"`, our own Jacobians with the points eliminated, which
        knows every lens and loss; `"auto"`, native where it can be
    max_iterations : of the optimiser

    Raises
    ------
    DataError
        where there is nothing to adjust.
    ModelError
        for an unknown loss, gauge, route or parameter.
    UnderConstrainedError
        where the observations leave something free; it is named.
    """
    name, gauge = check_loss(loss, loss_px), check_gauge(gauge)
    if route not in ROUTES:
        raise ModelError(f"route is one of {', '.join(ROUTES)}, got {route!r}")
    if len(reconstruction.pixels) == 0 or len(reconstruction.names) == 0:
        raise DataError(
            "a bundle adjustment needs images, points and observations; this reconstruction has none"
        )
    problem, start = bundle_problem(reconstruction, refine=refine_intrinsics, fixed=fixed)
    check_seen(problem)
    began = time.perf_counter()
    solved, taken = _solve(problem, start, name, loss_px, route, max_iterations)
    seconds = time.perf_counter() - began
    state = solved.state if problem.held else restore(solved.state, start)
    sigma = sigma_px or _noise(problem, state, name, loss_px) or reconstruction.sigma_px
    found = None
    if covariances:
        found = bundle_covariances(problem, state, gauge=gauge, loss=name, loss_px=loss_px, sigma_px=sigma)
    return BundleResult(
        resettled(reconstruction, problem, state).replaced(sigma_px=sigma),
        solved.initial_cost,
        solved.cost,
        solved.iterations,
        solved.decrement,
        _message(solved),
        seconds,
        taken,
        name,
        gauge,
        sigma,
        problem.free,
        *((found.poses, found.centres, found.points, found.intrinsics) if found else ()),
    )


def _solve(
    problem: BundleProblem, start: BundleState, loss: str, loss_px: float, route: str, iterations: int
) -> tuple[Adjusted, str]:
    """Where the solve ended, and by which route."""
    state, steps, taken = start, 0, "compiled"
    if route != "compiled":
        try:
            found = None
            if route == "native" or loss in ("none", *ESTIMATORS) or len(problem.images) <= FEW:
                found = _natively(problem, start, loss, loss_px, iterations)
            if found is None and route == "native":
                raise ModelError(
                    "GTSAM has no factor for this lens with what is free in it; use route='auto'"
                )
            if found is not None:
                (state, steps), taken = found, "native"
        except SolverError:
            if route == "native":
                raise
    cost, decrement = decrement_of(problem, state, loss, loss_px)
    if taken == "compiled" or (route == "auto" and decrement > SETTLED * cost):
        # no factors, or GTSAM stopped short: the compiled loop takes over from there
        more = adjust(problem, state, loss=loss, loss_px=loss_px, iterations=iterations)
        state, steps = more.state, steps + more.iterations
        cost, decrement = decrement_of(problem, state, loss, loss_px)
    before = cost_of(problem.residuals(start), loss, loss_px)[0]
    return Adjusted(state, cost, before, decrement, steps, decrement <= SETTLED * cost), taken


def _natively(
    problem: BundleProblem, start: BundleState, loss: str, loss_px: float, iterations: int
) -> tuple[BundleState, int] | None:
    """Where GTSAM ends, and its iterations; None where it lacks a factor."""
    if loss not in {"none", *ESTIMATORS}:
        able = native_bundle(problem, start) is not None
        return optimise_reweighted(problem, start, loss, loss_px, iterations) if able else None
    native = native_bundle(problem, start, loss=loss, loss_px=loss_px)
    if native is None:
        return None
    values, steps = optimise_bundle(native, iterations)
    return native.state(values, start), steps


def _message(solved: Adjusted) -> str:
    """What is wrong, or nothing."""
    if solved.decrement <= max(SETTLED * solved.cost, 1e-9):
        return ""
    return (
        f"the solver stopped after {solved.iterations} iterations at cost {solved.cost:.6g} px², and one "
        f"more step would take off {solved.decrement:.3g}; raise max_iterations, or mend the start"
    )


def _noise(problem: BundleProblem, state: BundleState, loss: str, loss_px: float) -> float:
    """The noise of the pixels as the residuals tell it; 0 where they are too few to tell."""
    freedoms = {0: 7, 1: 1}.get(len(problem.held), 0)
    told = noise_px(problem, problem.residuals(state), loss, loss_px, freedoms)
    return max(0.0, told)
