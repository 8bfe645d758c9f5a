"""Noise levels from the readings: innovation maximum likelihood over a few knobs of a model."""

from sequential.tuning.knobs import Knob, Tuning
from sequential.tuning.likelihood import innovation_log_likelihood
from sequential.tuning.tune import tune

__all__ = ["Knob", "Tuning", "innovation_log_likelihood", "tune"]
