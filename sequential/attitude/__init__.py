"""Orientation of an inertial sensor: estimators from the complementary filter on, and what they return."""

from sequential.attitude.angles import (
    attitude_from_angles,
    attitude_from_vectors,
    body_rates,
    euler_rates,
    roll_pitch_yaw,
    tilt,
)
from sequential.attitude.complementary import ComplementaryAttitude
from sequential.attitude.error_state import ErrorStateAttitude
from sequential.attitude.estimator import AttitudeFilter
from sequential.attitude.history import AttitudeHistory
from sequential.attitude.madgwick import Madgwick
from sequential.attitude.mahony import Mahony
from sequential.attitude.smoother import AttitudeSmoother
from sequential.attitude.smoother_model import AttitudeModel
from sequential.attitude.tilt_kalman import TiltKalman

__all__ = [
    "AttitudeFilter",
    "AttitudeHistory",
    "AttitudeModel",
    "AttitudeSmoother",
    "ComplementaryAttitude",
    "ErrorStateAttitude",
    "Madgwick",
    "Mahony",
    "TiltKalman",
    "attitude_from_angles",
    "attitude_from_vectors",
    "body_rates",
    "euler_rates",
    "roll_pitch_yaw",
    "tilt",
]
