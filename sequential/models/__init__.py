"""Motion and sensor models; each is a small frozen declaration that every estimator takes."""

from sequential.models.ambiguous import TwoModeOrientation, two_mode_readings
from sequential.models.barometer import Barometer, pressure_height
from sequential.models.body_velocity import BodyVelocity, WheelOdometry, wheel_readings
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
from sequential.models.magnetometer import Magnetometer
from sequential.models.motion import ConstantVelocity, RandomWalk
from sequential.models.orientation import Orientation, marker_attitude
from sequential.models.pixels import CameraProjection, StereoPixels
from sequential.models.pose_reading import PoseReading
from sequential.models.position import Position
from sequential.models.ranging import Range, RangeBearing
from sequential.models.turning import GyroAttitude, attitude_state
from sequential.models.unicycle import Unicycle
from sequential.models.velocity import Velocity, ZeroVelocity, still_velocity

__all__ = [
    "Barometer",
    "BodyVelocity",
    "CameraProjection",
    "ConstantAcceleration",
    "ConstantVelocity",
    "ContinuousProcess",
    "CoordinatedTurn",
    "Direction",
    "GaussMarkov",
    "GyroAttitude",
    "Independent",
    "LinearProcess",
    "LinearSensor",
    "Magnetometer",
    "Orientation",
    "PoseReading",
    "Position",
    "Process",
    "RandomWalk",
    "Range",
    "RangeBearing",
    "Sensor",
    "Singer",
    "StereoPixels",
    "Strapdown",
    "TwoModeOrientation",
    "Unicycle",
    "Velocity",
    "WheelOdometry",
    "ZeroVelocity",
    "attitude_state",
    "inertial_state",
    "marker_attitude",
    "pressure_height",
    "still_velocity",
    "tabulated_input",
    "two_mode_readings",
    "wheel_readings",
]
