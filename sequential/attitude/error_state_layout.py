"""Where the numbers of the error-state filter stand: its state and its settings are flat arrays.

A flat state is what the compiled step, the streaming call and a port to C have in common.
"""

from __future__ import annotations

__all__ = ["STATE"]

# nominal values of the inclination filter
Q = 0  # 4: quaternion from the body to the frame of the gyro, whose z is up and whose heading drifts
BIAS = 4  # 3, rad/s
VELOCITY = 7  # 2, horizontal, m/s
POSITION = 9  # 2, horizontal, m
LEVEL = 11  # spectral density of the linear acceleration, m²/s³
# rest
STILL = 12  # time for which nothing moved, s
SLOW_GYRO = 13  # 3, low-passed
SLOW_ACCEL = 16  # 3, low-passed
# flags, 0 or 1
STARTED, RESTING, DISTURBED, NORTH_KNOWN = 20, 21, 22, 23
# nominal values of the heading filter; fields in units of SCALE
DELTA = 24  # heading of the frame of the gyro in the world, rad
NORTH, UP = 25, 26  # reference field
IRON = 27  # 3, residual hard iron in the body frame
DELAY = 30  # of the magnetometer behind the gyro, s
SCALE = 31  # length of the first field, in the magnetometer's unit
UNSEEN = 32  # time since the last correction by the field, s
HALF = 33  # 2: cosine and sine of half of DELTA
LAST_FIELD = 35  # 3: the reading before, to know a held one
PENDING = 38  # time over which no gyro was read, s
SEEN = 39  # 1 after the first block
# sums over a block
FORCE = 40  # 3, turned to the frame of the gyro
FIELD = 43  # 3, turned likewise
TURNED = 46  # 9, rotation matrices
RATE_SQUARED = 55
SAMPLES, FORCES, FIELDS = 56, 57, 58
RATE = 59  # 3, as read
SPECIFIC = 62  # 3, specific force as read
ELAPSED = 65  # s
START = 66  # 4, quaternion at the start of the block
# covariances, symmetric and whole, and the errors that a block has found
ERRORS, HEADING_ERRORS = 10, 7
P = 70  # (10, 10): rotation (frame of the gyro), bias, velocity, position
D = 170  # (7, 7): heading, north, up, iron, delay
X = 220  # 10
Y = 230  # 7
GAIN = 240  # 10
ROW = 250  # 7
MEAN_FORCE = 257  # 3, low-passed specific force in the frame of the gyro
AGE = 260  # s since the start or the last gap
LAST_RATE = 261  # 3, the reading before
STATE = 264

# settings
(
    BLOCK,
    GAP,
    GYRO_NOISE,
    TILT_SCALE,
    HEADING_SCALE,
    BIAS_WALK,
    BIAS_PRIOR,
    BANDWIDTH,
    SPREAD,
    LEVEL_FLOOR,
    LEVEL_TIME,
    VELOCITY_PRIOR,
    POSITION_PRIOR,
    GRAVITY,
    REST_GYRO,
    REST_ACCEL,
    REST_TIME,
    REST_RATE,
    REST_FILTER,
    REST_NOISE,
    FIELD_NOISE,
    FIELD_GATE,
    FIELD_DOUBT,
    BIAS_MEMORY,
    IRON_PRIOR,
    IRON_WALK,
    IRON_DOUBT,
    REFERENCE_WALK,
    REFERENCE_PRIOR,
    DELAY_MEAN,
    DELAY_PRIOR,
    LATENCY,
    LATENCY_SPREAD,
    TILT_FLOOR,
    HEADING_FLOOR,
    TILT_PRIOR,
    HEADING_PRIOR,
    TILT_KNOWN,
    LEVEL_PRIOR,
    SETTINGS,
) = range(40)
