"""How far an orientation is from the truth: in all, about the vertical, and of the vertical itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError, NotPositiveDefiniteError, ShapeError
from sequential.manifold.quaternion import (
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
)

__all__ = ["AttitudeError", "attitude_error", "attitude_nees"]

Array = NDArray[np.float64]
Offset = Literal["none", "mean"]


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeError:
    """Root mean square errors in rad, and the errors themselves.

    Parameters
    ----------
    total, heading, inclination : RMSE over the rows judged
    errors : (N, 3) total, heading and inclination error of every row, rad, >= 0; NaN where there is no truth
    judged : (N,) rows that count
    offset : heading taken off the estimate first, rad, counter-clockwise seen from above
    """

    total: float
    heading: float
    inclination: float
    errors: Array
    judged: NDArray[np.bool_]
    offset: float = 0.0

    @property
    def degrees(self) -> tuple[float, float, float]:
        """Total, heading and inclination RMSE in degrees."""
        total, heading, inclination = np.degrees([self.total, self.heading, self.inclination]).tolist()
        return total, heading, inclination


def attitude_error(
    estimate: ArrayLike,
    truth: ArrayLike,
    where: ArrayLike | None = None,
    *,
    heading_offset: Offset = "none",
) -> AttitudeError:
    """Hold orientations to the truth as the BROAD benchmark does.

    Parameters
    ----------
    estimate : (N, 4) world_q_body
    truth : (N, 4) the same; NaN (or all zero) where there is none
    where : (N,) rows to judge, such as those of motion; all by default
    heading_offset : "mean" takes the mean heading error off first, for estimates that do not know north

    Raises
    ------
    ShapeError, NotFiniteError
        where arrays do not fit together, or a judged estimate is NaN.
    DataError
        where no row is left to judge.

    Notes
    -----
    With the error e = estimate ⊗ truth⁻¹ in the world frame: total 2 arccos|w|, heading 2 arctan|z/w|,
    inclination 2 arccos √(w² + z²).  Laidig, Caruso, Cereatti, Seel 2021, "BROAD", Data 6(7):72, section 4.
    """
    own, true, judged = _pairs(estimate, truth, where)
    error = quaternion_multiply(own, quaternion_inverse(true))
    offset = 0.0
    if heading_offset == "mean":
        offset = _mean_heading(error[judged])
        error = quaternion_multiply(_about_up(-offset), error)
    elif heading_offset != "none":
        raise DataError(f"heading_offset is 'none' or 'mean', got {heading_offset!r}")
    errors = _angles(error)
    total, heading, inclination = np.sqrt(np.mean(errors[judged] ** 2, axis=0)).tolist()
    errors.flags.writeable = judged.flags.writeable = False
    return AttitudeError(total, heading, inclination, errors, judged, offset)


def attitude_nees(
    estimate: ArrayLike,
    cov: ArrayLike,
    truth: ArrayLike,
    *,
    heading_offset: float = 0.0,
) -> Array:
    """Squared orientation error in units of its covariance: χ² with 3 degrees of freedom, if honest.

    Parameters
    ----------
    estimate, truth : (N, 4) world_q_body; NaN (or all zero) truth where there is none
    cov : (N, 3, 3) rad², of δ in R = R̂ exp(δ)
    heading_offset : taken off the estimate first, rad, as `AttitudeError.offset` says it

    Returns
    -------
    Array
        (N,) values; NaN where there is no truth.

    Raises
    ------
    ShapeError, NotFiniteError, NotPositiveDefiniteError
    """
    own, true, judged = _pairs(estimate, truth, None)
    own = quaternion_multiply(_about_up(-heading_offset), own)
    given = np.asarray(cov, dtype=np.float64)
    if given.shape != (len(own), 3, 3):
        raise ShapeError(f"{len(own)} orientations need covariances ({len(own)}, 3, 3), got {given.shape}")
    error = quaternion_log(quaternion_multiply(quaternion_inverse(own[judged]), true[judged]))
    try:
        lower = np.linalg.cholesky(given[judged])
    except np.linalg.LinAlgError as fault:
        raise NotPositiveDefiniteError("a covariance of the attitude is not positive definite") from fault
    values = np.full(len(own), np.nan)
    values[judged] = np.sum(np.linalg.solve(lower, error[..., None])[..., 0] ** 2, axis=1)
    return values


def _pairs(
    estimate: ArrayLike, truth: ArrayLike, where: ArrayLike | None
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Unit quaternions (N, 4) of both, and the rows (N,) to judge: those wanted that have a truth."""
    own, true = np.asarray(estimate, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    if own.ndim != 2 or own.shape[1:] != (4,) or own.shape != true.shape:
        raise ShapeError(
            f"estimate and truth are quaternions (N, 4), one a row; got {own.shape} and {true.shape}"
        )
    wanted = np.ones(len(own), dtype=np.bool_) if where is None else np.asarray(where)
    if wanted.shape != (len(own),) or wanted.dtype != np.bool_:
        raise ShapeError(f"where is a mask ({len(own)},) of bool, got {wanted.dtype} {wanted.shape}")
    judged = wanted & np.isfinite(true).all(axis=1) & (np.abs(true).max(axis=1, initial=0.0) > 0)
    if not judged.any():
        raise DataError("no row has a truth and is wanted: there is nothing to judge")
    length = np.linalg.norm(own, axis=1)
    if len(bad := np.flatnonzero(judged & ~(np.isfinite(length) & (length > 0)))):
        raise NotFiniteError(f"the estimate of row {bad[0]} is {own[bad[0]]}; it must be a unit quaternion")
    unit = np.full_like(own, np.nan)
    known = np.isfinite(length) & (length > 0)
    unit[known] = quaternion_normalize(own[known])
    true = np.where(judged[:, None], true, np.nan)
    true[judged] = quaternion_normalize(true[judged])
    return unit, true, judged


def _mean_heading(error: Array) -> float:
    """Circular mean of the signed heading errors of (M, 4), rad."""
    heading = 2.0 * np.arctan2(error[:, 3], error[:, 0])
    return float(np.arctan2(np.sin(heading).mean(), np.cos(heading).mean()))


def _about_up(angle: float) -> Array:
    return np.array([np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)])


def _angles(error: Array) -> Array:
    """Total, heading and inclination (N, 3), rad; arctangents, as arccosines lose small angles."""
    w, x, y, z = np.abs(error).T
    level, upright = np.hypot(x, y), np.hypot(w, z)
    total = 2.0 * np.arctan2(np.hypot(level, z), w)
    return np.column_stack([total, 2.0 * np.arctan2(z, w), 2.0 * np.arctan2(level, upright)])
