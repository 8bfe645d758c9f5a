"""Recursive filters: settings only; beliefs go in and come out."""

from sequential.filters.extended import ExtendedKalmanFilter, IteratedExtendedKalmanFilter
from sequential.filters.kalman import KalmanFilter
from sequential.filters.multiple import InteractingMultipleModel
from sequential.filters.particle import ParticleFilter, resample
from sequential.filters.unscented import UnscentedKalmanFilter

__all__ = [
    "ExtendedKalmanFilter",
    "InteractingMultipleModel",
    "IteratedExtendedKalmanFilter",
    "KalmanFilter",
    "ParticleFilter",
    "UnscentedKalmanFilter",
    "resample",
]
