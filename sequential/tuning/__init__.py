"""Noise levels from the readings: at rest, by the NIS, by likelihood, by EM, by autocovariances."""

from sequential.tuning.als import autocovariance_least_squares
from sequential.tuning.by_nis import tune_by_nis
from sequential.tuning.em import expectation_maximization
from sequential.tuning.knobs import Knob
from sequential.tuning.likelihood import innovation_log_likelihood
from sequential.tuning.result import Tuning
from sequential.tuning.scaling import noise_knobs, scaled, scaled_process
from sequential.tuning.still import noise_from_still
from sequential.tuning.tune import tune
from sequential.tuning.verdict import Verdict, judge

__all__ = [
    "Knob",
    "Tuning",
    "Verdict",
    "autocovariance_least_squares",
    "expectation_maximization",
    "innovation_log_likelihood",
    "judge",
    "noise_from_still",
    "noise_knobs",
    "scaled",
    "scaled_process",
    "tune",
    "tune_by_nis",
]
