"""An attitude that is one of two: a small marker, whose mirror image about the line of sight fits as well.

Every look takes the likelier of both readings at the state it is asked at: a mixture of Gaussians whose
largest term stands for the sum (Olson and Agarwal 2013, "Inference on networks of mixtures for robust robot
mapping").  A filter so decides by its prediction, a smoother and a graph again at every linearisation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.log import Stream, covariances
from sequential.manifold import SO3, Manifold
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.orientation import HELPERS as ATTITUDE
from sequential.models.orientation import attitude_jacobian, attitude_places, seen_attitude
from sequential.models.parts import mounted
from sequential.models.rotation import (
    quaternion_exp,
    quaternion_product,
    right_jacobian,
    right_jacobian_inverse,
    rotation_vector,
    turned,
)
from sequential.noise import require_covariance

__all__ = ["TwoModeOrientation", "two_mode_readings"]

Array = NDArray[np.float64]
CONTEXT = 24  # both readings (8), log odds (1), information of the first (6), second's noise to first's (9)


@dataclass(frozen=True, eq=False)
class TwoModeOrientation(SensorModel):
    """`Orientation` whose reading is one of two; `two_mode_readings` makes the stream.

    Parameters
    ----------
    noise_cov : (3, 3), (3,) variances or a number, rad², of the right reading, about the sensor's axes,
        where readings bring none along
    mode : None takes the likelier one; 0 or 1 always the first or the second: for hypotheses side by side,
        as an `InteractingMultipleModel` or several runs hold them
    body_q_sensor, mount, reference, part : as of `Orientation`

    Notes
    -----
    A reading costs half its squared distance less the logarithm of its probability.  With the right
    prediction a mirrored reading is recognised; begun on a wrong one a filter may hold on to it: begin both
    ways where the first odds are low, and keep the likelier run (`Run.log_likelihood`).
    """

    noise_cov: ArrayLike  # type: ignore[assignment]
    mode: int | None = None
    body_q_sensor: ArrayLike | None = None
    mount: str | None = None
    reference: str | None = None
    part: str | None = None
    gate: float | None = None
    loss: Loss | None = None

    def __post_init__(self) -> None:
        if self.mode not in {None, 0, 1}:
            raise ModelError(f"mode is None, 0 or 1, got {self.mode!r}")
        if self.mount is not None and self.body_q_sensor is not None:
            raise ModelError("a TwoModeOrientation has a body_q_sensor or a mount in the state, not both")
        fixed = mounted(self.body_q_sensor, SO3(), "body_q_sensor of a TwoModeOrientation")
        object.__setattr__(self, "fixed_mount", fixed)
        object.__setattr__(self, "manifold", SO3())
        cov = require_covariance(self.noise_cov, 3, "the noise_cov of a TwoModeOrientation")
        object.__setattr__(self, "noise_cov", cov)

    def functions(self, manifold: Manifold) -> Functions:
        """Lowered: see `SensorModel.functions`."""
        who, fixed = "TwoModeOrientation", self.fixed_mount  # type: ignore[attr-defined]  # set above
        places = attitude_places(manifold, self.part, self.mount, self.reference, fixed, who)
        choice = -1 if self.mode is None else self.mode
        params = as_params(*places, choice, np.linalg.inv(np.asarray(self.noise_cov)))
        return Functions(nearest, nearest_jacobian, params, CONTEXT, helpers=HELPERS)


def apart(u: Any, at: int, e: Any) -> tuple[float, float, float]:
    """Rotation vector from the reading at u[at:] to the expected attitude e."""
    q = quaternion_product(u[at], -u[at + 1], -u[at + 2], -u[at + 3], e[0], e[1], e[2], e[3])
    return rotation_vector(q[0], q[1], q[2], q[3])


def as_first(u: Any, e: Any) -> tuple[float, float, float]:
    """How far e is from the second reading, in rotation vectors that weigh as those from the first do."""
    a, b, c = apart(u, 4, e)
    if u[9] == 0.0:
        return a, b, c
    return (
        u[15] * a + u[16] * b + u[17] * c,
        u[18] * a + u[19] * b + u[20] * c,
        u[21] * a + u[22] * b + u[23] * c,
    )


def half_square(v: Any, u: Any, p: Any) -> float:
    """Half the squared distance of a rotation vector, in sigmas of the first reading."""
    a, b, c = v
    if u[9] == 0.0:
        square = p[14] * a * a + p[18] * b * b + p[22] * c * c
        return 0.5 * square + p[15] * a * b + p[16] * a * c + p[19] * b * c
    square = u[9] * a * a + u[12] * b * b + u[14] * c * c
    return 0.5 * square + u[10] * a * b + u[11] * a * c + u[13] * b * c


def second_is_nearer(u: Any, e: Any, p: Any) -> bool:
    """Whether the second reading is the likelier one; there is none where its numbers are zero."""
    if u[4] * u[4] + u[5] * u[5] + u[6] * u[6] + u[7] * u[7] < 0.5 or p[13] == 0.0:
        return False
    if p[13] == 1.0:
        return True
    return half_square(as_first(u, e), u, p) < half_square(apart(u, 0, e), u, p) - u[8]


def nearest(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """What is expected beside the first reading; p = [places (13), mode or -1, information (9)].

    Where the second one counts, the expectation is moved to where its distance from the first, in the first
    one's sigmas, is the distance from the second in the second one's.
    """
    e = seen_attitude(x, p)
    if second_is_nearer(u, e, p):
        a, b, c = as_first(u, e)
        t = quaternion_exp(a, b, c)
        e = quaternion_product(u[0], u[1], u[2], u[3], t[0], t[1], t[2], t[3])
    out[0], out[1], out[2], out[3] = e


def nearest_jacobian(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """That of the attitude; after a move by W, Jr(W v) W Jr⁻¹(v) times it."""
    attitude_jacobian(x, u, dt, p, out)
    e = seen_attitude(x, p)
    if u[9] == 0.0 or not second_is_nearer(u, e, p):
        return
    v, w, d = apart(u, 4, e), as_first(u, e), int(p[2])
    inverse, jacobian = right_jacobian_inverse(v[0], v[1], v[2]), right_jacobian(w[0], w[1], w[2])
    for j in range(d):
        a, b, c = turned(inverse, out[j], out[d + j], out[2 * d + j])
        a, b, c = (
            u[15] * a + u[16] * b + u[17] * c,
            u[18] * a + u[19] * b + u[20] * c,
            u[21] * a + u[22] * b + u[23] * c,
        )
        out[j], out[d + j], out[2 * d + j] = turned(jacobian, a, b, c)


HELPERS = (
    *ATTITUDE,
    *(attitude_jacobian, quaternion_exp, right_jacobian, right_jacobian_inverse, rotation_vector, turned),
    *(apart, as_first, half_square, second_is_nearer),
)


def two_mode_readings(
    t: ArrayLike,
    first: ArrayLike,
    second: ArrayLike,
    odds: ArrayLike = 1.0,
    noise_cov: ArrayLike | None = None,
    second_cov: ArrayLike | None = None,
) -> Stream:
    """A stream for a `TwoModeOrientation`.

    Parameters
    ----------
    first, second : (N, 4) quaternions, the two readings at each time; NaN where there is no second
    odds : (N,) or a number, how many times likelier the first is than the second
    noise_cov : (N, 3, 3) rad² or None, where every reading brings its own; of the first reading
    second_cov : (N, 3, 3) of the second; that of the first unless given

    Raises
    ------
    ShapeError, NotPositiveDefiniteError, ModelError
    """
    one, two = (np.asarray(given, dtype=np.float64) for given in (first, second))
    if one.ndim != 2 or one.shape != two.shape or one.shape[1] != 4:
        raise ShapeError(f"both readings are quaternions (N, 4), got {one.shape} and {two.shape}")
    ratio = np.broadcast_to(np.asarray(odds, dtype=np.float64), (len(one),))
    if not (ratio > 0).all():
        raise ModelError("odds are positive numbers: 3 says that the first is three times likelier")
    if noise_cov is None and second_cov is not None:
        raise ModelError("second_cov is the noise of the second reading; give noise_cov, of the first, too")
    absent = np.asarray(np.isnan(two).any(axis=1))
    known = np.where(absent[:, None], 0.0, SO3().normalize(np.where(absent[:, None], [1.0, 0, 0, 0], two)))
    weight, weights = np.log(np.minimum(ratio, 1e12)), np.zeros((len(one), 15))
    own = None
    if noise_cov is not None:
        own = covariances(noise_cov, len(one))
        other = own if second_cov is None else covariances(second_cov, len(one))
        weights, volume = weighed(own, other)
        weight = weight + volume
    context = np.column_stack([SO3().normalize(one), known, weight, weights])
    return Stream(np.asarray(t), SO3().normalize(one), context, noise_cov=own)


def weighed(first: Array, second: Array) -> tuple[Array, Array]:
    """Information of the first and W = L1 L2⁻¹, (N, 15); half the logarithm of |second| / |first|, (N,)."""
    roots = np.linalg.cholesky(first), np.linalg.cholesky(second)
    information = np.linalg.inv(first)[:, *np.triu_indices(3)]
    to_first = (roots[0] @ np.linalg.inv(roots[1])).reshape(-1, 9)
    logs = [np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1) for root in roots]
    return np.hstack([information, to_first]), logs[1] - logs[0]
