"""Challenge D1: a thermometer, a ramp, a plateau, one outlier; a student's filter is run and scored."""

from factorlab.l19.challenge.measures import Measures, measure, measured_filter
from factorlab.l19.challenge.trials import Trial, hidden_trials, public_trial

__all__ = ["Measures", "Trial", "hidden_trials", "measure", "measured_filter", "public_trial"]
