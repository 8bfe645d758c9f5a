"""How good an estimate is, and whether it knows: NIS, NEES, whiteness, ATE, RPE."""

from sequential.evaluate.alignment import Alignment, align, umeyama
from sequential.evaluate.attitude_error import AttitudeError, attitude_error, attitude_nees
from sequential.evaluate.blame import Blame, Candidate, blame
from sequential.evaluate.bootstrap import BootstrapBand, block_bootstrap, gap_labels
from sequential.evaluate.consistency import (
    AverageNees,
    Consistency,
    anees,
    chi2_band,
    nees,
    nis_summary,
    normalised_error,
    summarise,
)
from sequential.evaluate.diagnose import Finding, diagnose
from sequential.evaluate.monte_carlo import MonteCarlo, monte_carlo
from sequential.evaluate.observability import NamedDirection, Observability, observability
from sequential.evaluate.pose_error import PoseErrors, ape, rpe, statistics
from sequential.evaluate.trajectory import Trajectory, associate, interpolate
from sequential.evaluate.whiteness import Whiteness, autocorrelation, whiteness

__all__ = [
    "Alignment",
    "AttitudeError",
    "AverageNees",
    "Blame",
    "BootstrapBand",
    "Candidate",
    "Consistency",
    "Finding",
    "MonteCarlo",
    "NamedDirection",
    "Observability",
    "PoseErrors",
    "Trajectory",
    "Whiteness",
    "align",
    "anees",
    "ape",
    "associate",
    "attitude_error",
    "attitude_nees",
    "autocorrelation",
    "blame",
    "block_bootstrap",
    "chi2_band",
    "diagnose",
    "gap_labels",
    "interpolate",
    "monte_carlo",
    "nees",
    "nis_summary",
    "normalised_error",
    "observability",
    "rpe",
    "statistics",
    "summarise",
    "umeyama",
    "whiteness",
]
