"""What is wrong with a recording, told before anything is computed: sentences with place and remedy.

>>> import numpy as np
>>> from sequential.sensors import ImuRecording
>>> from sequential.sensors.health import inspect
>>> t = np.arange(2000) * 0.01
>>> rng = np.random.default_rng(1)
>>> in_g = ImuRecording(t, accel=[0, 0, 1] + 0.002 * rng.normal(size=(2000, 3)))
>>> print(next(str(finding) for finding in inspect(in_g) if finding.severity == "fail"))
the accelerometer shows 1.00 at rest where 9.81 m/s² is expected: it is in g; read it with units accel=g
"""

from sequential.sensors.health.inspect import failures, inspect

__all__ = ["failures", "inspect"]
