"""Motion and sensor models; each is a small frozen declaration that every estimator takes."""

from sequential.models.continuous import ContinuousProcess
from sequential.models.declared import LinearSensor, Process, Sensor
from sequential.models.direction import Direction
from sequential.models.inertial import Strapdown, inertial_state
from sequential.models.kinematic import (
    ConstantAcceleration,
    CoordinatedTurn,
    GaussMarkov,
    Independent,
    Singer,
)
from sequential.models.linear import LinearProcess, tabulated_input
from sequential.models.motion import ConstantVelocity, RandomWalk
from sequential.models.position import Position
from sequential.models.ranging import Range, RangeBearing
from sequential.models.unicycle import Unicycle

__all__ = [
    "ConstantAcceleration",
    "ConstantVelocity",
    "ContinuousProcess",
    "CoordinatedTurn",
    "Direction",
    "GaussMarkov",
    "Independent",
    "LinearProcess",
    "LinearSensor",
    "Position",
    "Process",
    "RandomWalk",
    "Range",
    "RangeBearing",
    "Sensor",
    "Singer",
    "Strapdown",
    "Unicycle",
    "inertial_state",
    "tabulated_input",
]
