"""`factorlab attitude`: orientation of a recording by one estimator or several, judged and told."""

from factorlab.attitude.document import attitude_document
from factorlab.attitude.estimators import DEFAULT, TITLES, available, left_out, make_estimator
from factorlab.attitude.export import orientation_csv, orientation_tum
from factorlab.attitude.solve import Reference, Solved, reference_of, solve_attitude

__all__ = [
    "DEFAULT",
    "TITLES",
    "Reference",
    "Solved",
    "attitude_document",
    "available",
    "left_out",
    "make_estimator",
    "orientation_csv",
    "orientation_tum",
    "reference_of",
    "solve_attitude",
]
