"""What a sensor records and what is wrong with it: recordings, their health, characterisation, calibration.

>>> import numpy as np
>>> from sequential.sensors import ImuRecording
>>> still = ImuRecording(t=np.arange(200) * 0.01, accel=np.tile([0.0, 0.0, 9.81], (200, 1)))
>>> round(still.rate), round(still.duration, 2), still.mag is None
(100, 1.99, True)
"""

from sequential.sensors.calibration import AffineCalibration, ImuCalibration
from sequential.sensors.calibration_files import c_header, kalibr_yaml
from sequential.sensors.finding import Finding
from sequential.sensors.recording import ImuRecording

__all__ = ["AffineCalibration", "Finding", "ImuCalibration", "ImuRecording", "c_header", "kalibr_yaml"]
