"""Graphs over the variables and measurements of a `sequential.slam.SlamProblem`."""

from factorlab.graph.slam.batch import BatchSlam
from factorlab.graph.slam.fixed_lag import FixedLagSlam
from factorlab.graph.slam.gnc import GncResult, GncSlam
from factorlab.graph.slam.incremental import IncrementalSlam
from factorlab.graph.slam.lowering import NativeFactor, native_factor

__all__ = [
    "BatchSlam",
    "FixedLagSlam",
    "GncResult",
    "GncSlam",
    "IncrementalSlam",
    "NativeFactor",
    "native_factor",
]
