"""An attitude that is one of two: a small marker, whose mirror image about the line of sight fits as well.

Every look takes the likelier of both readings at the state it is asked at: a mixture of Gaussians whose
largest term stands for the sum (Olson and Agarwal 2013, "Inference on networks of mixtures for robust robot
mapping").  A filter so decides by its prediction, a smoother and a graph again at every linearisation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, ShapeError
from sequential.log import Stream
from sequential.manifold import SO3, Manifold
from sequential.model import Functions, Loss, SensorModel, as_params
from sequential.models.orientation import HELPERS as ATTITUDE
from sequential.models.orientation import attitude_jacobian, attitude_places, seen_attitude
from sequential.models.parts import mounted
from sequential.models.rotation import quaternion_product
from sequential.noise import require_covariance

__all__ = ["TwoModeOrientation", "two_mode_readings"]

Array = NDArray[np.float64]
CONTEXT = 9  # both readings, and the logarithm of the odds of the first


@dataclass(frozen=True, eq=False)
class TwoModeOrientation(SensorModel):
    """`Orientation` whose reading is one of two; `two_mode_readings` makes the stream.

    Parameters
    ----------
    noise_cov : (3, 3), (3,) variances or a number, rad², of the right reading, about the sensor's axes
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
        return Functions(nearest, attitude_jacobian, params, CONTEXT, helpers=HELPERS)


def distance(u: Any, at: int, e: Any, p: Any) -> float:
    """Half the squared distance, in sigmas, of the expected attitude e from the reading at u[at:]."""
    w, a, b, c = quaternion_product(u[at], -u[at + 1], -u[at + 2], -u[at + 3], e[0], e[1], e[2], e[3])
    if w < 0.0:
        w, a, b, c = -w, -a, -b, -c
    s = math.sqrt(a * a + b * b + c * c)
    k = 2.0 if s < 1e-9 else 2.0 * math.atan2(s, w) / s
    a, b, c = k * a, k * b, k * c
    square = p[14] * a * a + p[18] * b * b + p[22] * c * c
    return 0.5 * square + p[15] * a * b + p[16] * a * c + p[19] * b * c


def second_is_nearer(u: Any, e: Any, p: Any) -> bool:
    """Whether the second reading is the likelier one; there is none where its numbers are zero."""
    if u[4] * u[4] + u[5] * u[5] + u[6] * u[6] + u[7] * u[7] < 0.5 or p[13] == 0.0:
        return False
    return p[13] == 1.0 or distance(u, 4, e, p) < distance(u, 0, e, p) - u[8]


def nearest(x: Any, u: Any, dt: float, p: Any, out: Any) -> None:
    """What is expected beside the first reading; p = [places (13), mode or -1, information (9)].

    Where the second one counts, the expectation is turned by what lies between the two, so that its
    distance from the first is that from the second.
    """
    e = seen_attitude(x, p)
    if second_is_nearer(u, e, p):
        q = quaternion_product(u[0], u[1], u[2], u[3], u[4], -u[5], -u[6], -u[7])
        e = quaternion_product(q[0], q[1], q[2], q[3], e[0], e[1], e[2], e[3])
    out[0], out[1], out[2], out[3] = e


HELPERS = (*ATTITUDE, distance, second_is_nearer)


def two_mode_readings(
    t: ArrayLike,
    first: ArrayLike,
    second: ArrayLike,
    odds: ArrayLike = 1.0,
    noise_cov: ArrayLike | None = None,
) -> Stream:
    """A stream for a `TwoModeOrientation`.

    Parameters
    ----------
    first, second : (N, 4) quaternions, the two readings at each time; NaN where there is no second
    odds : (N,) or a number, how many times likelier the first is than the second
    noise_cov : (N, 3, 3) or None, where every reading brings its own

    Raises
    ------
    ShapeError
    """
    one, two = (np.asarray(given, dtype=np.float64) for given in (first, second))
    if one.ndim != 2 or one.shape != two.shape or one.shape[1] != 4:
        raise ShapeError(f"both readings are quaternions (N, 4), got {one.shape} and {two.shape}")
    ratio = np.broadcast_to(np.asarray(odds, dtype=np.float64), (len(one),))
    if not (ratio > 0).all():
        raise ModelError("odds are positive numbers: 3 says that the first is three times likelier")
    absent = np.asarray(np.isnan(two).any(axis=1))
    known = np.where(absent[:, None], 0.0, SO3().normalize(np.where(absent[:, None], [1.0, 0, 0, 0], two)))
    one = SO3().normalize(one)
    weight = np.log(np.minimum(ratio, 1e12))
    own = None if noise_cov is None else np.asarray(noise_cov, dtype=np.float64)
    return Stream(np.asarray(t), one, np.column_stack([one, known, weight]), noise_cov=own)
