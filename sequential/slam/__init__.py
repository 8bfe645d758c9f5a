"""Variables joined by measurements: one declaration for EKF-SLAM and for every graph.

A `StateSpace` is one state that moves; here are many variables of several kinds (poses, landmarks, marker
poses, calibrations), and measurements that join a few of them each.  `sequential.slam` holds what needs no
GTSAM: the declaration, the models with their Jacobians, and the filter; `factorlab.graph` solves the rest.
"""

from sequential.slam.association import Association, with_associations
from sequential.slam.ekf import EkfSlam
from sequential.slam.estimate import SlamRun, Values
from sequential.slam.factor_model import FactorModel, check_factor_model
from sequential.slam.problem import Factors, SlamProblem

__all__ = [
    "Association",
    "EkfSlam",
    "FactorModel",
    "Factors",
    "SlamProblem",
    "SlamRun",
    "Values",
    "check_factor_model",
    "with_associations",
]
