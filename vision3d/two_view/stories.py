"""From readings to a result: a camera that only turned, a plane, or a motion in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, UnderConstrainedError
from sequential.manifold.quaternion import quaternion_from_matrix, quaternion_log
from vision3d.camera import Array
from vision3d.two_view.motion import essential_matrix, motion, recover_pose
from vision3d.two_view.noise import Noise, fit_noise
from vision3d.two_view.planes import plane_homography
from vision3d.two_view.readings import Readings
from vision3d.two_view.refinement import (
    Refined,
    homography_distances,
    inflation,
    inverted,
    refine_motion,
    refine_plane,
    refine_rotation,
    sampson_distances,
)
from vision3d.two_view.result import Verdict

__all__ = ["Told", "tell_motion", "tell_plane", "tell_turn"]

FLAT, EITHER, FEWEST = 0.8, 0.6, 8
BIAS_PX, BIAS_SIGMAS = 0.1, 5.0
SURER = 5.0
"""How many pairs more must speak for one reading of a plane to rule out the other: some do by chance."""
ROUNDS = 3
STILL_SIGMAS = 4.0
"""A turn within so many of its standard deviations of none is none."""


@dataclass(frozen=True, slots=True)
class Told:
    """A story, before it is told in the order of the matches.

    Parameters
    ----------
    verdict, words : as in `TwoView`
    b_T_a, cov, essential, rivals, normal : as there
    squared : (N,) squared distances of the rows that were read
    agree : (N,) bool
    sigma : of a coordinate, px
    """

    verdict: Verdict
    words: str
    b_T_a: Array
    cov: Array
    squared: Array
    agree: NDArray[np.bool_]
    sigma: float
    rivals: Array
    normal: Array


def tell_motion(readings: Readings, level: float | None) -> Told:
    """A motion in space."""
    rows, limit = readings.rows, readings.threshold**2
    b_T_a, squared = readings.motion, readings.motion_squared
    agree = squared < limit
    noise = fit_noise(squared[agree])
    b_T_a = recover_pose(essential_matrix(b_T_a), rows[agree, :3], rows[agree, 3:6]).b_T_a
    information = refine_motion(rows[agree], b_T_a, iterations=0).information
    cov = _covariance(information, squared[agree], noise, 1, 5, level)
    words = f"{int(agree.sum())} of {len(rows)} pairs agree with one motion, known but for its length"
    return Told(
        "general",
        words,
        b_T_a,
        cov,
        squared,
        agree,
        level or noise.scale,
        np.empty((0, 7)),
        np.full(3, np.nan),
    )


def tell_plane(readings: Readings, level: float | None) -> Told:
    """A plane, whose two readings may both be possible."""
    rows, limit = readings.rows, 2.0 * readings.threshold**2
    agree = readings.homography_squared < limit
    noise = fit_noise(readings.homography_squared[agree], 2)
    found: list[tuple[float, Refined]] = []
    for one in readings.planes:
        refined = refine_plane(rows[agree], one.R, one.t, one.normal, loss="cauchy", scale=noise.cauchy)
        # what does not lie on the plane speaks for one reading
        found.append((_misfit(readings, _motion_of(refined)), refined))
    found.sort(key=lambda pair: pair[0])
    best = found[0][1]
    p = best.parameters
    rivals = [_motion_of(other) for cost, other in found[1:] if cost < found[0][0] + SURER]
    squared = homography_distances(rows, plane_homography(p[:9].reshape(3, 3), p[9:12], p[12:]))
    agree = squared < limit
    noise = fit_noise(squared[agree], 2)
    there = refine_plane(rows[agree], p[:9].reshape(3, 3), p[9:12], p[12:], iterations=0)
    cov = _covariance(there.information, squared[agree], noise, 2, 8, level)[:5, :5]
    words = f"{int(agree.sum())} of {len(rows)} pairs lie on one plane; " + (
        "two motions explain them as well, the other is among the rivals: matches off the plane, or a third "
        "picture, would tell"
        if rivals
        else "what lies off it, or behind the camera, rules the other reading out"
    )
    told = np.array(rivals).reshape(-1, 7)
    return Told("planar", words, _motion_of(best), cov, squared, agree, level or noise.scale, told, p[12:])


def tell_turn(readings: Readings, level: float | None) -> Told:
    """A camera that turned about its own centre, or did not move at all."""
    rows, limit = readings.rows, 2.0 * readings.threshold**2
    R, squared = readings.R, readings.rotation_squared
    for _ in range(ROUNDS):
        agree = squared < limit
        scale = fit_noise(squared[agree], 2).cauchy
        R = refine_rotation(rows[agree], R, loss="cauchy", scale=scale).parameters.reshape(3, 3)
        squared = homography_distances(rows, R)
    agree = squared < limit
    noise = fit_noise(squared[agree], 2)
    information = refine_rotation(rows[agree], R, iterations=0).information
    cov = np.full((5, 5), np.nan)
    cov[:3, :3] = _covariance(information, squared[agree], noise, 2, 3, level)
    b_T_a = np.concatenate([quaternion_from_matrix(R), np.zeros(3)])
    turn = quaternion_log(b_T_a[:4])
    still = float(turn @ np.linalg.pinv(cov[:3, :3]) @ turn) < STILL_SIGMAS**2
    words = f"{int(agree.sum())} of {len(rows)} pairs agree with " + (
        "no motion at all: the pictures are of the same place, looking the same way"
        if still
        else "a turn of the camera about its own centre: no direction of a translation, and no depth, can be "
        "told; take pictures from two places"
    )
    verdict: Verdict = "identical" if still else "pure rotation"
    return Told(
        verdict, words, b_T_a, cov, squared, agree, level or noise.scale, np.empty((0, 7)), np.full(3, np.nan)
    )


def tell(readings: Readings, level: float | None) -> Told:
    """The story that Torr's criterion prefers, or the nearest that the pairs allow."""
    best = readings.criterion.best
    if best != "pure rotation" and _without_parallax(readings, level):
        return tell_turn(readings, level)
    try:
        if readings.planes and (best == "planar" or (best == "general" and _open(readings))):
            return tell_plane(readings, level)
        if best != "pure rotation":
            return tell_motion(readings, level)
    except (DataError, UnderConstrainedError):
        pass  # nothing in front of both cameras, or a direction free: what is left is a turn
    return tell_turn(readings, level)


def _open(readings: Readings) -> bool:
    """Whether a plane holds most pairs, and the others do not say which of its readings is right."""
    limit = readings.threshold**2
    flat = readings.homography_squared[readings.motion_squared < limit] < 2.0 * limit
    if len(readings.planes) < 2 or not np.mean(flat) > FLAT:
        return False
    best = _misfit(readings, readings.motion)
    return all(_misfit(readings, motion(one.R, one.t)) < best + SURER for one in readings.planes)


def _without_parallax(readings: Readings, level: float | None) -> bool:
    """Whether a turn explains most pairs, and what is left puts as many points behind the cameras as ahead.

    Tails of the noise are wider than Gaussian ones, and an essential matrix is happy to follow them; depths
    from noise have either sign.  Below a tenth of a pixel there are features' biases, whatever the sign.
    """
    limit = readings.threshold**2
    agree = readings.motion_squared < limit
    count = int(agree.sum())
    if count < FEWEST or not np.mean(readings.rotation_squared[agree] < 2.0 * limit) > FLAT:
        return False
    floor = BIAS_PX if level is None else min(BIAS_PX, BIAS_SIGMAS * level)
    if float(np.median(readings.rotation_squared[agree])) < floor**2:
        return True
    rays = readings.rows[agree, :3], readings.rows[agree, 3:6]
    try:
        votes = recover_pose(essential_matrix(readings.motion), *rays).votes
    except DataError:
        return True
    return bool(votes.max() < count * (EITHER + 1.5 / np.sqrt(count)))


def _misfit(readings: Readings, b_T_a: Array) -> float:
    """How many pairs do not agree with a motion, those that nearly do not by their share."""
    return float(np.minimum(sampson_distances(readings.rows, b_T_a) / readings.threshold**2, 1.0).sum())


def _motion_of(refined: Refined) -> Array:
    return motion(refined.parameters[:9].reshape(3, 3), refined.parameters[9:12])


def _covariance(
    information: Array, squared: Array, noise: Noise, dims: int, parameters: int, level: float | None
) -> Array:
    """Covariance of the estimate: under the noise that there is, or under the sigma that is known."""
    spread = inflation(squared / noise.scale**2, np.sqrt(noise.freedom), dims) * noise.scale**2
    spread *= len(squared) / max(1.0, len(squared) - parameters / dims)
    return inverted(information, "the motion") * (spread if level is None else level**2)
