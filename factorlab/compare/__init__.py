"""Many estimators, one log, one table.

>>> from factorlab.compare import compare
>>> from factorlab.datasets import load
>>> (kitti,) = load("kitti")
>>> table = compare(kitti, ("ekf", "ieks"))
>>> [row.name for row in table.rows]
['ekf', 'ieks']
"""

from factorlab.compare.accuracy import Errors
from factorlab.compare.engine import Progress, compare
from factorlab.compare.estimators import EVERY_NAME, KINDS, NAMES, UnknownEstimatorError, make
from factorlab.compare.honesty import Nis, NormalisedError
from factorlab.compare.table import Comparison, Row, Tuned, document
from factorlab.compare.verdict import Finding

__all__ = [
    "EVERY_NAME",
    "KINDS",
    "NAMES",
    "Comparison",
    "Errors",
    "Finding",
    "Nis",
    "NormalisedError",
    "Progress",
    "Row",
    "Tuned",
    "UnknownEstimatorError",
    "compare",
    "document",
    "make",
]
