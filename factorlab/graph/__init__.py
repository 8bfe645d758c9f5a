"""Factor graphs from the same declarations; the only room that imports GTSAM."""

from factorlab.graph.attitude import AttitudeGraph
from factorlab.graph.batch import BatchGraph
from factorlab.graph.bundle import BundleResult, bundle_adjust
from factorlab.graph.incremental import FixedLagGraph, IncrementalGraph

__all__ = [
    "AttitudeGraph",
    "BatchGraph",
    "BundleResult",
    "FixedLagGraph",
    "IncrementalGraph",
    "bundle_adjust",
]
