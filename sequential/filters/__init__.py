"""Recursive filters: settings only; beliefs go in and come out."""

from sequential.filters.extended import ExtendedKalmanFilter, IteratedExtendedKalmanFilter
from sequential.filters.kalman import KalmanFilter
from sequential.filters.multiple import InteractingMultipleModel
from sequential.filters.particle import ParticleFilter, resample
from sequential.filters.sigma_sets import SigmaPoints, sigma_points
from sequential.filters.unscented import CubatureKalmanFilter, UnscentedKalmanFilter

__all__ = [
    "CubatureKalmanFilter",
    "ExtendedKalmanFilter",
    "InteractingMultipleModel",
    "IteratedExtendedKalmanFilter",
    "KalmanFilter",
    "ParticleFilter",
    "SigmaPoints",
    "UnscentedKalmanFilter",
    "resample",
    "sigma_points",
]
