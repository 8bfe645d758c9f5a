"""The offline attitude smoother: every sample judged with the whole recording in hand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import NDArray

from sequential.attitude.estimator import in_threads
from sequential.attitude.history import AttitudeHistory, read_only
from sequential.attitude.smoother_chain import AttitudeChain, ChainSolution
from sequential.attitude.smoother_cut import attitude_chain
from sequential.attitude.smoother_model import AttitudeModel
from sequential.errors import ModelError
from sequential.manifold import SO3
from sequential.manifold.quaternion import quaternion_from_matrix
from sequential.sensors.recording import ImuRecording

__all__ = ["AttitudeSmoother", "attitude_history"]

Array = NDArray[np.float64]
DISTRUST = 0.25  # weight below which a reading of the field counts as disturbed


@final
@dataclass(frozen=True, slots=True)
class AttitudeSmoother:
    """Iterated smoothing of orientation, gyro errors and velocity from a whole recording.

    The gyro is integrated over nodes of a fifth of a second.  The chain of nodes knows the specific force
    (a body that does not run away has a velocity about zero, so the mean force over a few seconds points
    up), the magnetometer through the east component of the field alone (strength and dip say how far to
    trust it), and moments of rest, found with hindsight.  Bias, gain and misalignment of the gyro, bias of
    the accelerometer and delay of the magnetometer are estimated on the way.

    Parameters
    ----------
    model : noises
    iterations : passes about the smoothed trajectory; before them comes an extended filter and its smoother
    magnetometer : use it (9-D) or not (6-D); None where the recording has one
    free_heading : also give `heading_free`, the answer without magnetometer, for one pass more

    Notes
    -----
    Rauch, Tung, Striebel 1965; in the form of Bryson and Frazier, which inverts nothing (Bierman 1973);
    iterated as in Bell 1994, The iterated Kalman smoother as a Gauss-Newton method.
    """

    model: AttitudeModel = field(default_factory=AttitudeModel)
    iterations: int = 2
    magnetometer: bool | None = None
    free_heading: bool = True

    def __post_init__(self) -> None:
        if self.iterations < 1:
            raise ModelError(f"AttitudeSmoother.iterations must be at least 1, got {self.iterations}")

    @property
    def name(self) -> str:
        """smoother."""
        return "smoother"

    def estimate(self, recording: ImuRecording) -> AttitudeHistory:
        """Orientation at every sample, with covariance.

        Raises
        ------
        MissingStreamError, DataError
            where there is no gyro, no accelerometer, or no magnetometer although one is asked for; where the
            magnetometer is stuck.
        """
        if self.magnetometer:
            recording.require("mag", si=False)
        chain = attitude_chain(recording, self.model, field=self.magnetometer is not False)
        chain, solution = self.first_pass(chain)
        solution = self.solve(chain, solution)
        free = None
        if chain.field and self.free_heading:
            free = chain.solve(solution, field=False)
        return attitude_history(recording, chain, solution, free, self.name)

    def filtered(self, recording: ImuRecording) -> AttitudeHistory:
        """What the extended filter of the same model says, at the end of each node but not at every sample.

        It is the forward pass: a fifth of a second late at most.  Rest, and from it the first guess of the
        gyro's bias, are those of the whole recording; `ErrorStateAttitude` finds them as it goes.
        """
        chain = attitude_chain(recording, self.model, field=self.magnetometer is not False)
        weight = chain.first_weights() if chain.field else None
        solution = chain.solve(weight=weight, hindsight=False)
        return node_history(recording, chain, solution, "smoother's filter")

    def estimate_many(
        self, recordings: Iterable[ImuRecording], threads: int | None = None
    ) -> list[AttitudeHistory]:
        """Every recording by `estimate`, in threads: as many as there are processors unless given."""
        return in_threads(self.estimate, recordings, threads)

    def first_pass(self, chain: AttitudeChain) -> tuple[AttitudeChain, ChainSolution]:
        """Filter and smooth from nothing; also the chain, integrated anew with the bias that this found."""
        weight = chain.first_weights() if chain.field else None
        solution = chain.solve(weight=weight, covariance=False)
        return chain.integrated(solution.state[:, 3:6].mean(axis=0)), solution

    def solve(self, chain: AttitudeChain, about: ChainSolution) -> ChainSolution:
        """Passes about a solution, with the field weighed anew each time."""
        solution = about
        for left in range(self.iterations, 0, -1):
            weight = chain.weights(solution) if chain.field else None
            solution = chain.solve(solution, weight=weight, covariance=left == 1)
        return solution


def attitude_history(
    recording: ImuRecording,
    chain: AttitudeChain,
    solution: ChainSolution,
    free: ChainSolution | None,
    name: str,
) -> AttitudeHistory:
    """Give every sample its orientation from the nodes around it."""
    q, cov = _dense(chain, solution, heading=chain.field)
    unaided, unaided_cov = (None, None) if free is None else _dense(chain, free, heading=False)
    samples = np.diff(chain.first)
    bias = np.repeat(solution.state[:-1, 3:6], samples, axis=0)
    bias_cov = np.repeat(solution.cov[:-1, 3:6, 3:6], samples, axis=0)
    rest = np.repeat(chain.rest, samples)
    disturbed = np.repeat(solution.trust < DISTRUST, samples) if chain.field else None
    read_only(q, cov, unaided, unaided_cov, bias, bias_cov, rest, disturbed)
    return AttitudeHistory(
        recording.t,
        q,
        heading_free=unaided,
        cov=cov,
        cov_6d=unaided_cov if chain.field else cov,
        gyro_bias=bias,
        gyro_bias_cov=bias_cov,
        rest=rest,
        magnetic_disturbance=disturbed,
        name=name,
    )


def node_history(
    recording: ImuRecording, chain: AttitudeChain, solution: ChainSolution, name: str
) -> AttitudeHistory:
    """The nodes themselves, each at the last of its samples, with what the gyro's delay adds."""
    at, model = chain.first[1:] - 1, chain.model
    rotation, bias = solution.rotation[1:], solution.state[1:, 3:6]
    rate = np.where(chain.rest[:, None], 0.0, chain.samples.gyro[at] - bias)
    known = solution.cov[1:, :3, :3].copy()
    known[:, 2, 2] += model.heading_sigma**2 if chain.field else 0.0
    cov = np.einsum("kji,kjl,klm->kim", rotation, known, rotation)
    cov += model.latency_sigma**2 * np.einsum("ki,kj->kij", rate, rate)
    ahead = SO3().retract(quaternion_from_matrix(rotation), model.latency * rate)
    q = np.where(ahead[:, :1] < 0, -ahead, ahead)
    bias_cov = solution.cov[1:, 3:6, 3:6]
    return AttitudeHistory(
        recording.t[at], q, cov=cov, gyro_bias=bias, gyro_bias_cov=bias_cov, rest=chain.rest, name=name
    )


def _dense(chain: AttitudeChain, solution: ChainSolution, *, heading: bool) -> tuple[Array, Array]:
    from sequential.attitude.smoother_dense_kernel import densify

    count, model = len(chain.samples.gyro), chain.model
    q, cov = np.empty((count, 4)), np.empty((count, 3, 3))
    extra = np.array([0.0, 0.0, model.heading_sigma**2 if heading else 0.0])
    densify(
        chain.samples.dt, chain.samples.gyro, chain.first, chain.rest, solution.rotation, solution.state,
        solution.cov, model.latency, model.latency_sigma, extra, q, cov,
    )  # fmt: skip
    return q, cov
