"""Least squares that wrong frames and knocks do not sway, and that finds the noise of every sensor itself."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from vision3d.calibrate.noise import floor_of
from vision3d.camera import Camera
from vision3d.inertial.adjust import Adjusted, BiasWalk, adjust, freedoms
from vision3d.inertial.problem import Corners, Imu, Problem
from vision3d.inertial.state import Constants, State

__all__ = ["fit", "frame_medians"]

Array = NDArray[np.float64]
FALSE_ALARMS = 0.02
CAUCHY = 2.385
WORSE_FRAME = 4.0
ROUNDS, NOISE_ROUNDS = 6, 5


def fit(
    camera: Camera, corners: Corners, imu: Imu, begun: State, constants: Constants, walk: BiasWalk
) -> tuple[Problem, Adjusted, BiasWalk]:
    """Least squares, robust, the noise found: problem (with weights and noise), solution, bias walk."""
    problem = _first_problem(camera, corners, imu, constants)
    adjusted = adjust(problem, begun, walk)
    for round_ in range(ROUNDS):
        problem = _scaled_by_medians(problem, adjusted)
        problem = _weighed(problem, adjusted, trim=round_ >= ROUNDS // 2)
        adjusted = adjust(problem, adjusted.state, walk, iterations=12)
        if round_ == 0 and not _doubtful(problem, adjusted):
            break
    problem = _weighed(problem, adjusted, trim=True)
    problem, adjusted = _with_noise(problem, adjusted, walk)
    counted = np.where(problem.corner_weight[:, None] > 0.0, adjusted.linear.residuals_px, np.nan)
    if (floor := floor_of(counted, corners.sigma_px)) > 0.0:
        wider = replace(corners, sigma_px=np.hypot(corners.sigma_px, floor))
        # who is believed was decided by the sigmas as stated, and is decided anew
        problem = replace(problem, corners=wider, corner_weight=np.ones(len(wider.frame)))
        for _ in range(2):
            adjusted = adjust(problem, adjusted.state, walk, iterations=12)
            problem = _weighed(_scaled_by_medians(problem, adjusted), adjusted, trim=True)
        problem, adjusted = _with_noise(problem, adjusted, walk)
    return problem, adjusted, walk


def _with_noise(problem: Problem, adjusted: Adjusted, walk: BiasWalk) -> tuple[Problem, Adjusted]:
    """Least squares and noise in turn, until neither moves."""
    for _ in range(NOISE_ROUNDS):
        before = problem
        adjusted = adjust(problem, adjusted.state, walk)
        problem = _noise_found(problem, adjusted)
        if np.allclose(_noise(before), _noise(problem), rtol=2e-3):
            break
    return problem, adjust(problem, adjusted.state, walk)


def _noise(problem: Problem) -> Array:
    return np.array([problem.gyro_sigma, problem.accel_sigma, problem.corner_scale])


def _first_problem(camera: Camera, corners: Corners, imu: Imu, constants: Constants) -> Problem:
    """Noise of the IMU from its third differences, which a smooth motion hardly enters."""
    sigmas = []
    for values, least in ((imu.gyro, 1e-4), (imu.accel, 1e-3)):
        third = np.diff(values, 3, axis=0)
        sigmas.append(max(1.4826 * float(np.median(np.abs(third))) / np.sqrt(20.0), least))
    n, c = len(imu.t), len(corners.frame)
    # corners begin wider than their detector says: neither lens nor clock is right yet
    wide = max(1.0, 0.3 / float(np.median(corners.sigma_px)))
    return Problem(
        camera, corners, imu, constants, sigmas[0], sigmas[1], wide, np.ones(n), np.ones(n), np.ones(c)
    )


def _distances(adjusted: Adjusted, problem: Problem) -> tuple[Array, Array, Array]:
    """Lengths of the residuals in sigmas: gyro (N,), accelerometer (N,), corners (C,)."""
    linear = adjusted.linear
    sigma = problem.corner_scale * problem.corners.sigma_px
    return (
        np.linalg.norm(linear.gyro.e, axis=1),
        np.linalg.norm(linear.accel.e, axis=1),
        np.linalg.norm(linear.residuals_px, axis=1) / sigma,
    )


def _scaled_by_medians(problem: Problem, adjusted: Adjusted) -> Problem:
    gyro, accel, corner = _distances(adjusted, problem)
    medians = [
        float(np.median(one)) / np.sqrt(chi2.median(k)) for one, k in ((gyro, 3), (accel, 3), (corner, 2))
    ]
    return replace(
        problem,
        gyro_sigma=problem.gyro_sigma * max(medians[0], 1e-3),
        accel_sigma=problem.accel_sigma * max(medians[1], 1e-3),
        corner_scale=problem.corner_scale * max(medians[2], 1e-3),
    )


def _limits(problem: Problem) -> tuple[float, float]:
    """Lengths in sigmas that no reading of so many has by chance: of three numbers, and of two."""
    return (
        float(np.sqrt(chi2.isf(FALSE_ALARMS / len(problem.imu.t), 3))),
        float(np.sqrt(chi2.isf(FALSE_ALARMS / max(1, len(problem.corners.frame)), 2))),
    )


def _rescaled(problem: Problem, adjusted: Adjusted) -> tuple[Array, Array, Array]:
    """Distances once each group's median is that of a normal distribution.

    A corner is as far off as its own sigma or all corners' say, whichever is less: a detector may err.
    """
    gyro, accel, corner = _distances(adjusted, problem)
    pixels = np.linalg.norm(adjusted.linear.residuals_px, axis=1)
    own = [_unit_median(one, k) for one, k in ((gyro, 3), (accel, 3), (corner, 2), (pixels, 2))]
    return own[0], own[1], np.minimum(own[2], own[3])


def _unit_median(lengths: Array, numbers: int) -> Array:
    """Lengths of so many numbers each, scaled so that their median is that of standard normal ones."""
    scale = max(float(np.median(lengths) / np.sqrt(chi2.median(numbers))), 1e-9)
    return np.asarray(lengths / scale)


def _doubtful(problem: Problem, adjusted: Adjusted) -> bool:
    inertial, corner = _limits(problem)
    gyro, accel, corners = _rescaled(problem, adjusted)
    return bool((gyro > inertial).any() or (accel > inertial).any() or (corners > corner).any())


def _weighed(problem: Problem, adjusted: Adjusted, *, trim: bool) -> Problem:
    """Weights by Cauchy's loss, or 0 and 1 once it has settled; a frame that fits badly has none."""
    inertial, corner = _limits(problem)
    gyro, accel, corners = _rescaled(problem, adjusted)
    if trim:
        weights = [
            np.where(one > limit, 0.0, 1.0)
            for one, limit in ((gyro, inertial), (accel, inertial), (corners, corner))
        ]
    else:
        weights = [
            1.0 / (1.0 + (one / (CAUCHY * np.sqrt(k / 1.0))) ** 2)
            for one, k in ((gyro, 3), (accel, 3), (corners, 2))
        ]
    typical = frame_medians(problem.corners, corners)
    wrong = typical > WORSE_FRAME * np.sqrt(chi2.median(2))
    weights[2] = np.where(wrong[problem.corners.frame], 0.0, weights[2])
    return replace(problem, gyro_weight=weights[0], accel_weight=weights[1], corner_weight=weights[2])


def frame_medians(corners: Corners, distances: Array) -> Array:
    """The median over the corners of every frame, (F,)."""
    starts = np.searchsorted(corners.frame, np.arange(len(corners.t) + 1))
    return np.array([np.median(distances[a:b]) if b > a else 0.0 for a, b in pairwise(starts)])


def _noise_found(problem: Problem, adjusted: Adjusted) -> Problem:
    """Noise by its residuals, less what the unknowns use up of them (Förstner 1979)."""
    linear = adjusted.linear
    used = freedoms(adjusted)
    factors = []
    for count, cost, taken in (
        (3.0 * np.count_nonzero(problem.gyro_weight), linear.gyro.cost, used[0]),
        (3.0 * np.count_nonzero(problem.accel_weight), linear.accel.cost, used[1]),
        (2.0 * np.count_nonzero(problem.corner_weight), linear.corner_cost, used[2]),
    ):
        left = max(count - taken, 0.02 * count)
        factors.append(np.sqrt(max(2.0 * cost / max(left, 1.0), 1e-12)))
    return replace(
        problem,
        gyro_sigma=problem.gyro_sigma * factors[0],
        accel_sigma=problem.accel_sigma * factors[1],
        corner_scale=problem.corner_scale * factors[2],
    )
