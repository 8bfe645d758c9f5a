"""`factorlab tune`: one log, one way of tuning, and what to write into the model."""

from factorlab.tuning.engine import METHODS, Fitted, tune_dataset, tune_still
from factorlab.tuning.text import fitted_document, fitted_lines

__all__ = ["METHODS", "Fitted", "fitted_document", "fitted_lines", "tune_dataset", "tune_still"]
