"""A bundle adjustment in GTSAM's own variables and factors, where it has them.

| cameras | factor | calibration |
|---|---|---|
| held | `GenericProjectionFactor` | `Cal3_S2`, `Cal3DS2`, `Cal3Fisheye` |
| one focal length, k1 and k2 at most, free | `GeneralSFMFactor2` | `Cal3Bundler` |
| fx, fy, and others, free | `GeneralSFMFactor2` | `Cal3_S2`, `Cal3DS2`, `Cal3Fisheye` |

Lenses with more terms than `brown4`, and one focal length tied among other free parameters, have none: such
problems go the compiled way, `vision3d.sfm.adjustment`.  The loss soft_l1 is met by weighing anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from gtsam.symbol_shorthand import K, L, X
from numpy.typing import NDArray

from factorlab.graph.solve import readable
from vision3d.rigid import inverse
from vision3d.sfm.adjustment import cost_of
from vision3d.sfm.bundle_problem import BundleProblem, BundleState
from vision3d.sfm.gauge import farthest

__all__ = ["NativeBundle", "native_bundle", "optimise_bundle", "optimise_reweighted"]

Array = NDArray[np.float64]

HELD = 1e-7
"""Standard deviation of what is held: parameters in their units, poses in rad and in sizes of the scene."""
GAUGE = 1e-2
"""The same of what only fixes the gauge: it is met exactly, whatever its weight, and a light one bends."""
LEAST_WEIGHT, STEPS_A_ROUND = 1e-12, 2
ESTIMATORS = {"huber": gtsam.noiseModel.mEstimator.Huber, "cauchy": gtsam.noiseModel.mEstimator.Cauchy}
FIXED = {
    "Cal3_S2": gtsam.GenericProjectionFactorCal3_S2,
    "Cal3DS2": gtsam.GenericProjectionFactorCal3DS2,
    "Cal3Fisheye": gtsam.GenericProjectionFactorCal3Fisheye,
}
FREE = {
    "Cal3Bundler": gtsam.GeneralSFMFactor2Cal3Bundler,
    "Cal3_S2": gtsam.GeneralSFMFactor2Cal3_S2,
    "Cal3DS2": gtsam.GeneralSFMFactor2Cal3DS2,
    "Cal3Fisheye": gtsam.GeneralSFMFactor2Cal3Fisheye,
}
PRIOR = {
    "Cal3Bundler": gtsam.PriorFactorCal3Bundler,
    "Cal3_S2": gtsam.PriorFactorCal3_S2,
    "Cal3DS2": gtsam.PriorFactorCal3DS2,
    "Cal3Fisheye": gtsam.PriorFactorCal3Fisheye,
}
ORDER = {
    "Cal3Bundler": ("f", "k1", "k2"),
    "Cal3_S2": ("fx", "fy", "skew", "cx", "cy"),
    "Cal3DS2": ("fx", "fy", "skew", "cx", "cy", "k1", "k2", "p1", "p2"),
    "Cal3Fisheye": ("fx", "fy", "skew", "cx", "cy", "k1", "k2", "k3", "k4"),
}
"""Tangents of GTSAM's calibrations."""


@dataclass(frozen=True, eq=False)
class NativeBundle:
    """A graph, its initial values, which calibration each camera became, and which poses are held."""

    graph: Any
    values: Any
    kinds: tuple[str, ...]
    free: tuple[bool, ...]
    held: tuple[int, ...]

    def state(self, values: Any, start: BundleState) -> BundleState:
        """Read the unknowns back."""
        world_T_camera = np.array([_row_of(values.atPose3(X(i))) for i in range(len(start.poses))])
        points = np.array([values.atPoint3(L(j)) for j in range(len(start.points))])
        parameters = start.parameters.copy()
        for c, kind in enumerate(self.kinds):
            if self.free[c]:
                parameters[c] = _parameters_of(kind, values, c, start.parameters[c])
        poses = inverse(world_T_camera)
        poses[list(self.held)] = start.poses[list(self.held)]
        return BundleState(parameters, poses, points)


def kind_of(lens: str, free: tuple[str, ...]) -> str | None:
    """GTSAM's calibration for a lens with some parameters free; None where it has none."""
    if "f" in free:
        small = lens in {"pinhole", "brown1", "brown2"} and not {"cx", "cy"} & set(free)
        return "Cal3Bundler" if small else None
    if lens == "fisheye4":
        return "Cal3Fisheye"
    if lens == "pinhole":
        return "Cal3_S2"
    return "Cal3DS2" if lens in {"brown1", "brown2", "brown4"} else None


def native_bundle(
    problem: BundleProblem,
    state: BundleState,
    *,
    loss: str = "none",
    loss_px: float = 1.0,
    weights: Array | None = None,
) -> NativeBundle | None:
    """The problem in native factors, or None where a piece has none; `weights` (K,) are of the observations.

    The gauge is fixed by a prior on the first pose, unless poses are held, and one on its distance to the
    farthest; both are met exactly and cost nothing.
    """
    kinds = [kind_of(camera.lens, names) for camera, names in zip(problem.cameras, problem.free, strict=True)]
    one_focal = all(
        camera.intrinsics[0] == camera.intrinsics[1] or kind != "Cal3Bundler"
        for camera, kind in zip(problem.cameras, kinds, strict=True)
    )
    if None in kinds or not one_focal or (loss != "none" and loss not in ESTIMATORS):
        return None
    named = tuple(str(kind) for kind in kinds)
    free = tuple(bool(names) for names in problem.free)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for i, pose in enumerate(inverse(state.poses)):
        values.insert(X(i), _pose_of(pose))
    for j, point in enumerate(state.points):
        values.insert(L(j), point)
    calibrations = [_calibration(kind, row) for kind, row in zip(named, state.parameters, strict=True)]
    for c, (kind, calibration) in enumerate(zip(named, calibrations, strict=True)):
        if free[c]:
            values.insert(K(c), calibration)
            _hold_parameters(graph, problem, c, kind, calibration)
    noises = _noises(problem, loss, loss_px, weights)
    _observe(graph, problem, named, free, calibrations, noises)
    _hold_gauge(graph, values, problem, state)
    return NativeBundle(graph, values, named, free, problem.held)


def _noises(problem: BundleProblem, loss: str, loss_px: float, weights: Array | None) -> list[Any]:
    """The noise model of every observation."""
    if weights is not None:
        sigmas = (1.0 / np.sqrt(np.maximum(weights, LEAST_WEIGHT))).tolist()
        return [gtsam.noiseModel.Isotropic.Sigma(2, sigma) for sigma in sigmas]
    noise = gtsam.noiseModel.Unit.Create(2)
    if loss != "none":
        noise = gtsam.noiseModel.Robust.Create(ESTIMATORS[loss].Create(loss_px), noise)
    return [noise] * len(problem.images)


def _observe(
    graph: Any,
    problem: BundleProblem,
    kinds: tuple[str, ...],
    free: tuple[bool, ...],
    calibrations: list[Any],
    noises: list[Any],
) -> None:
    """One factor for every observation."""
    camera_of, images, tracks = problem.camera_of.tolist(), problem.images.tolist(), problem.tracks.tolist()
    for i, j, pixel, noise in zip(images, tracks, problem.pixels, noises, strict=True):
        c = camera_of[i]
        if free[c]:
            graph.add(FREE[kinds[c]](pixel, noise, X(i), L(j), K(c)))
        else:
            graph.add(FIXED[kinds[c]](pixel, noise, X(i), L(j), calibrations[c]))


def _hold_parameters(graph: Any, problem: BundleProblem, c: int, kind: str, calibration: Any) -> None:
    """Hold those parameters of a free calibration that are not free, such as the skew."""
    names = ORDER[kind]
    held = np.array([name not in problem.free[c] for name in names])
    if held.any():
        # an information of zero leaves the others alone
        information = np.where(held, HELD**-2, 0.0)
        noise = gtsam.noiseModel.Diagonal.Precisions(information)
        graph.add(PRIOR[kind](K(c), calibration, noise))


def _hold_gauge(graph: Any, values: Any, problem: BundleProblem, state: BundleState) -> None:
    """Priors on held poses, else on the first; and on a distance, unless two poses are held."""
    centres = inverse(state.poses)[:, 4:]
    first = problem.held[0] if problem.held else 0
    last = farthest(state, first)
    distance = float(np.linalg.norm(centres[last] - centres[first])) or 1.0
    width = HELD if problem.held else GAUGE
    noise = gtsam.noiseModel.Diagonal.Sigmas(width * np.array([1.0, 1.0, 1.0, *(3 * [distance])]))
    for i in problem.held or (0,):
        graph.add(gtsam.PriorFactorPose3(X(i), values.atPose3(X(i)), noise))
    if len(problem.held) < 2 and len(centres) > 1:
        noise = gtsam.noiseModel.Isotropic.Sigma(1, GAUGE * distance)
        graph.add(gtsam.RangeFactorPose3(X(first), X(last), distance, noise))


def optimise_bundle(native: NativeBundle, iterations: int) -> tuple[Any, int]:
    """Levenberg-Marquardt by GTSAM: values and the number of iterations.

    Raises
    ------
    UnderConstrainedError, SolverError
    """
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(iterations)
    parameters.setRelativeErrorTol(1e-10)
    parameters.setAbsoluteErrorTol(1e-12)
    parameters.setlambdaUpperBound(1e12)
    with readable():
        optimizer = gtsam.LevenbergMarquardtOptimizer(native.graph, native.values, parameters)
        values = optimizer.optimize()
    return values, int(optimizer.iterations())


def optimise_reweighted(
    problem: BundleProblem, state: BundleState, loss: str, loss_px: float, iterations: int
) -> tuple[BundleState, int]:
    """The same for a loss that GTSAM does not have: weighted least squares, weighed anew until it settles.

    The losses here bend down as residuals grow, so that no round raises the cost (Huber 1981, section 7.8).
    """
    cost, weights = cost_of(problem.residuals(state), loss, loss_px)
    steps = 0
    while steps < iterations:
        native = native_bundle(problem, state, weights=weights)
        if native is None:
            break
        values, made = optimise_bundle(native, STEPS_A_ROUND)
        state, steps, before = native.state(values, state), steps + max(made, 1), cost
        cost, weights = cost_of(problem.residuals(state), loss, loss_px)
        if cost >= before * (1.0 - 1e-11):
            break
    return state, steps


def _calibration(kind: str, p: Array) -> Any:
    """GTSAM's calibration of our parameters."""
    fx, fy, cx, cy, *rest = (float(value) for value in (*p, 0.0, 0.0, 0.0, 0.0))
    if kind == "Cal3Bundler":
        return gtsam.Cal3Bundler(fx, rest[0], rest[1], cx, cy)
    if kind == "Cal3_S2":
        return gtsam.Cal3_S2(fx, fy, 0.0, cx, cy)
    return getattr(gtsam, kind)(np.array([fx, fy, 0.0, cx, cy, *rest[:4]]))


def _parameters_of(kind: str, values: Any, c: int, before: Array) -> Array:
    """Our parameters, padded as they were, from GTSAM's calibration."""
    found = getattr(values, f"at{kind}")(K(c))
    after = before.copy()
    if kind == "Cal3Bundler":
        given = np.array([found.fx(), found.fx(), before[2], before[3], found.k1(), found.k2()])
    else:
        row = found.vector()
        # a fisheye's vector() leaves its coefficients out
        bent = [found.k1(), found.k2(), found.k3(), found.k4()] if kind == "Cal3Fisheye" else row[5:]
        given = np.concatenate([row[:2], row[3:5], bent])
    after[: len(given)] = given[: len(after)]
    return after


def _pose_of(row: Array) -> Any:
    return gtsam.Pose3(gtsam.Rot3.Quaternion(*row[:4]), row[4:])


def _row_of(pose: Any) -> Array:
    turn = pose.rotation().toQuaternion()
    return np.array([turn.w(), turn.x(), turn.y(), turn.z(), *pose.translation()])
