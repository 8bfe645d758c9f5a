"""Orientation of an inertial sensor: estimators from the complementary filter on, and what they return."""

from sequential.attitude.angles import (
    attitude_from_angles,
    attitude_from_vectors,
    euler_rates,
    roll_pitch_yaw,
    tilt,
)
from sequential.attitude.history import AttitudeHistory

__all__ = [
    "AttitudeHistory",
    "attitude_from_angles",
    "attitude_from_vectors",
    "euler_rates",
    "roll_pitch_yaw",
    "tilt",
]
