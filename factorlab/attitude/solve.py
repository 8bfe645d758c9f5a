"""Estimators run on a recording, timed, and held to a truth where there is one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from factorlab.attitude.estimators import TITLES, make_estimator
from sequential.attitude import AttitudeHistory
from sequential.errors import DataError
from sequential.evaluate import AttitudeError, attitude_error, attitude_nees
from sequential.manifold.quaternion import quaternion_normalize
from sequential.sensors import ImuRecording

__all__ = ["Reference", "Solved", "reference_of", "solve_attitude"]

Array = NDArray[np.float64]
QUICK_S = 20.0
CHI2_95 = 7.815  # χ² of 3 degrees of freedom, 95 %
ANOTHER_NORTH = np.radians(20.0)
LONGEST_NS = 100_000_000  # between two poses of a truth that a sample may lie between


class Reference(NamedTuple):
    """A truth at the recording's samples: (N, 4), NaN where there is none, and the rows to judge (N,)."""

    world_q_body: Array
    where: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """What one estimator made of the recording."""

    name: str
    history: AttitudeHistory
    seconds: float
    error: AttitudeError | None = None
    nees: Array | None = None  # (N,), NaN where nothing is judged

    @property
    def title(self) -> str:
        """Name for a person."""
        return TITLES[self.name]

    @property
    def share(self) -> float | None:
        """Share of judged samples whose NEES is below its 95 % bound; 0.95 is honest."""
        if self.nees is None:
            return None
        return float(np.mean(self.nees[np.isfinite(self.nees)] < CHI2_95))


def solve_attitude(
    recording: ImuRecording, names: tuple[str, ...], reference: Reference | None = None
) -> tuple[Solved, ...]:
    """Run estimators by name, each with its default settings.

    Raises
    ------
    DataError
        where one cannot take the recording, or there is none of that name.
    """
    found = []
    for name in names:
        estimator = make_estimator(name)
        history, spent = _timed(estimator, recording)
        error = nees = None
        if reference is not None:
            error = _error(history.world_q_body, reference, north=recording.mag is not None)
            nees = _nees(history, reference, error)
        found.append(Solved(name, history, spent, error, nees))
    return tuple(found)


def _timed(estimator: Any, recording: ImuRecording) -> tuple[AttitudeHistory, float]:
    """The answer and its seconds: of a second call, as the first one loads what is compiled."""
    began = perf_counter()
    history = estimator.estimate(recording)
    spent = perf_counter() - began
    if spent < QUICK_S:
        began = perf_counter()
        history = estimator.estimate(recording)
        spent = perf_counter() - began
    return history, spent


def _error(world_q_body: Array, reference: Reference, *, north: bool) -> AttitudeError:
    """The error; without the mean heading offset where the two worlds have different norths."""
    turned = attitude_error(world_q_body, reference.world_q_body, reference.where, heading_offset="mean")
    if not north or abs(turned.offset) > ANOTHER_NORTH:
        return turned
    return attitude_error(world_q_body, reference.world_q_body, reference.where)


def _nees(history: AttitudeHistory, reference: Reference, error: AttitudeError) -> Array | None:
    if history.cov is None:
        return None
    judged = error.judged
    values = np.full(len(history), np.nan)
    values[judged] = attitude_nees(
        history.world_q_body[judged],
        history.cov[judged],
        reference.world_q_body[judged],
        heading_offset=error.offset,
    )
    return values


def reference_of(path: Path, recording: ImuRecording) -> Reference:
    """A truth in the TUM format, at the recording's stamps: between poses, the nearest one's line.

    Raises
    ------
    DataError
        where the file has no rotations, or shares no time with the recording.
    """
    from sequential.readers import read_tum

    truth = read_tum(path)
    if truth.quaternion is None or len(truth) < 2:
        raise DataError(f"{path} has no rotations to compare with; a TUM line is t x y z qx qy qz qw")
    after = np.clip(np.searchsorted(truth.t, recording.t), 1, len(truth) - 1)
    before = after - 1
    span = truth.t[after] - truth.t[before]
    share = (recording.t - truth.t[before]) / np.maximum(span, 1)
    inside = (share >= 0.0) & (share <= 1.0) & (span <= LONGEST_NS)
    if not inside.any():
        raise DataError(
            f"{path} shares no time with {recording.name!r}: it lasts from {truth.t[0] * 1e-9:.3f} s to "
            f"{truth.t[-1] * 1e-9:.3f} s, the recording from {recording.t[0] * 1e-9:.3f} s to "
            f"{recording.t[-1] * 1e-9:.3f} s; their stamps must count from the same moment"
        )
    one, other = truth.quaternion[before], truth.quaternion[after]
    other = np.where(np.sum(one * other, axis=1, keepdims=True) < 0.0, -other, other)
    between = quaternion_normalize(one + share[:, None] * (other - one))
    return Reference(np.where(inside[:, None], between, np.nan), np.ones(len(recording), dtype=bool))
