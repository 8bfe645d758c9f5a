"""Measurements that join variables, each with its Jacobians and, where it determines one, how to place it."""

from sequential.slam.models.calibrated import MountedRangeBearing, ScaledOdometry
from sequential.slam.models.displacement import Displacement
from sequential.slam.models.marker import MarkerCorners
from sequential.slam.models.planar_projection import PlanarProjection
from sequential.slam.models.projection import Projection, StereoProjection
from sequential.slam.models.ranging import LandmarkBearing, LandmarkRange, LandmarkRangeBearing
from sequential.slam.models.relative import Between, Prior
from sequential.slam.models.sensor import OfSensor

__all__ = [
    "Between",
    "Displacement",
    "LandmarkBearing",
    "LandmarkRange",
    "LandmarkRangeBearing",
    "MarkerCorners",
    "MountedRangeBearing",
    "OfSensor",
    "PlanarProjection",
    "Prior",
    "Projection",
    "ScaledOdometry",
    "StereoProjection",
]
