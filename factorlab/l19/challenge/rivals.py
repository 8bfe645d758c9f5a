"""The filters that a student's is compared with, ours among them: tuned on the public recording alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import sequential as sq
from factorlab.l19.challenge.measures import Filter
from factorlab.l19.challenge.trials import Trial
from sequential.log import nanoseconds

__all__ = ["GATE", "RIVALS", "TunedNoise", "kalman", "model_of", "rivals", "tuned_noise"]

Array = NDArray[np.float64]
GATE = 0.999
OURS = "Kalman réglé (le nôtre)"
RIVALS = ("mesures brutes", "passe-bas (a = 0,2)", "médiane (k = 9)", "Kalman non réglé", OURS)
UNTUNED = 0.1, 1.0  # q and R that somebody might guess


@dataclass(frozen=True, slots=True)
class TunedNoise:
    """q, °C²/s³, and R, °C², by the ten-line procedure."""

    q: float
    R: float


def model_of(q: float, R: float, first: float, gate: float | None = GATE) -> sq.StateSpace:
    """Temperature and slope; `first` is the first reading, °C."""
    return sq.StateSpace(
        manifold=sq.Vector(2),
        prior=sq.Gaussian(np.array([first, 0.0]), np.array([1.0, 0.25])),
        process=sq.ConstantVelocity(q),
        sensors={"thermometre": sq.LinearSensor([[1.0, 0.0]], R, gate=gate)},
    )


def kalman(q: float, R: float, gate: float | None = GATE) -> Filter:
    """A filter f(t, z) -> (N, 2): temperature and its σ, °C."""

    def smooth(t: Array, z: Array) -> Array:
        log = sq.SensorLog({"thermometre": sq.Stream(nanoseconds(t), z)})
        run = sq.run(sq.KalmanFilter(), model_of(q, R, float(z[0]), gate), log)
        return np.column_stack([run.mean[:, 0], np.sqrt(run.cov[:, 0, 0])])

    return smooth


def _raw(t: Array, z: Array) -> Array:
    return z


def tuned_noise(trial: Trial) -> TunedNoise:
    """R from thirty seconds of the plateau, then q by the NIS, as `factorlab tune --method nis` does."""
    R = float(np.var(trial.z[trial.rest], ddof=1))
    log = sq.SensorLog({"thermometre": sq.Stream(nanoseconds(trial.t), trial.z)})
    found = sq.tune_by_nis(
        lambda values: model_of(values["q"], R, float(trial.z[0])), [sq.Knob("q", 1e-3)], log
    )
    return TunedNoise(found.values["q"], R)


def rivals(tuned: TunedNoise) -> dict[str, Filter]:
    """By the names of RIVALS."""
    low, median = sq.LowPass(coefficient=0.2, interval=1.0), sq.SlidingMedian(9)
    filters: tuple[Filter, ...] = (
        _raw,
        low,
        median,
        kalman(*UNTUNED, gate=None),
        kalman(tuned.q, tuned.R),
    )
    return dict(zip(RIVALS, filters, strict=True))
