"""What a sensor records and what is wrong with it: recordings, their health, characterisation, calibration.

>>> import numpy as np
>>> from sequential.sensors import ImuErrors, simulate_imu, stationary
>>> errors = ImuErrors(gyro_bias=(0.01, 0.0, 0.0))
>>> imu, truth = simulate_imu(stationary(2.0), np.random.default_rng(1), errors=errors)
>>> round(imu.rate), imu.gyro[0].tolist(), imu.accel[0].round(3).tolist()
(100, [0.01, 0.0, 0.0], [0.0, 0.0, 9.807])
"""

from sequential.sensors.allan import AllanDeviation, allan_deviation
from sequential.sensors.calibration import AffineCalibration, ImuCalibration
from sequential.sensors.calibration_files import kalibr_yaml
from sequential.sensors.calibration_header import (
    c_header,
    calibration_hash,
    nominal_calibration,
    other_ranges,
)
from sequential.sensors.characterize import Characteristics, characterize
from sequential.sensors.characterize_step import StepResponse, step_response
from sequential.sensors.dwells import Dwells, find_dwells, join_recordings
from sequential.sensors.ellipsoid import FieldCheck, MagnetometerEllipsoid, MagnetometerFit
from sequential.sensors.estimate import Estimate
from sequential.sensors.ferraris import Ferraris, FerrarisFit
from sequential.sensors.field_alignment import FieldAlignment, align_field
from sequential.sensors.finding import Finding
from sequential.sensors.gravity import STANDARD_GRAVITY, local_gravity
from sequential.sensors.gyro_dwells import GyroBetweenDwells, GyroFit
from sequential.sensors.gyro_rest import GyroAtRest, bias_at_rest
from sequential.sensors.imu_noise import ImuNoiseReport, imu_noise
from sequential.sensors.motion import SIX_POSITIONS, Motion, constant_rate, stationary, tumble, waypoints
from sequential.sensors.multi_position import AccelerometerFit, MultiPosition
from sequential.sensors.noise_fit import Coefficient, NoiseFit, fit_noise
from sequential.sensors.positions import best_next_direction, missing_positions
from sequential.sensors.range_sensor import RangeFit, RangeSensor
from sequential.sensors.recording import ImuRecording
from sequential.sensors.simulate import ImuErrors, ImuSimulation, ImuTruth, simulate_imu
from sequential.sensors.still import StillDetector
from sequential.sensors.turns import KnownTurn, TurnFit, turn_gains
from sequential.sensors.verify import Move, Verification, verify

__all__ = [
    "SIX_POSITIONS",
    "STANDARD_GRAVITY",
    "AccelerometerFit",
    "AffineCalibration",
    "AllanDeviation",
    "Characteristics",
    "Coefficient",
    "Dwells",
    "Estimate",
    "Ferraris",
    "FerrarisFit",
    "FieldAlignment",
    "FieldCheck",
    "Finding",
    "GyroAtRest",
    "GyroBetweenDwells",
    "GyroFit",
    "ImuCalibration",
    "ImuErrors",
    "ImuNoiseReport",
    "ImuRecording",
    "ImuSimulation",
    "ImuTruth",
    "KnownTurn",
    "MagnetometerEllipsoid",
    "MagnetometerFit",
    "Motion",
    "Move",
    "MultiPosition",
    "NoiseFit",
    "RangeFit",
    "RangeSensor",
    "StepResponse",
    "StillDetector",
    "TurnFit",
    "Verification",
    "align_field",
    "allan_deviation",
    "best_next_direction",
    "bias_at_rest",
    "c_header",
    "calibration_hash",
    "characterize",
    "constant_rate",
    "find_dwells",
    "fit_noise",
    "imu_noise",
    "join_recordings",
    "kalibr_yaml",
    "local_gravity",
    "missing_positions",
    "nominal_calibration",
    "other_ranges",
    "simulate_imu",
    "stationary",
    "step_response",
    "tumble",
    "turn_gains",
    "verify",
    "waypoints",
]
