"""SLAM problems through every estimator, scored and put on one page."""

from factorlab.slam.engine import SlamComparison, compare_slam
from factorlab.slam.estimators import KINDS, NAMES

__all__ = ["KINDS", "NAMES", "SlamComparison", "compare_slam"]
