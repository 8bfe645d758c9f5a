"""A body that moves with every sensor of the family on board: each declared once, for filters and graphs."""

import math

import numpy as np
from worlds import World, drive, times

import sequential as sq

LANDMARKS = np.array(
    [
        [6.0, 2.0, 1.0],
        [7.0, -3.0, 2.0],
        [9.0, 1.0, -1.0],
        [8.0, 4.0, 3.0],
        [5.0, -1.0, -2.0],
        [11.0, 0.0, 0.5],
    ]
)
BODY_T_CAMERA = np.array([0.5, -0.5, 0.5, -0.5, 0.1, -0.05, 0.2])  # z of the camera along x of the body
TILTED = np.array([math.cos(0.3), 0.1, math.sin(0.3) * 0.9, -0.2])
TILTED = TILTED / np.linalg.norm(TILTED)
MOUNT = np.append(TILTED, [0.3, -0.2, 0.4])
FIELD = (20.0, 3.0, -43.0)

EVERYTHING = sq.Product(
    nav=sq.NavState(),
    accel_bias=sq.Vector(3),
    gyro_bias=sq.Vector(3),
    offset=sq.Vector(1),
    iron=sq.Vector(3),
    arm=sq.Vector(3),
    mount=sq.SO3(),
    reference=sq.SO3(),
    rig=sq.SE3(),
)

SENSORS = {
    "gps": sq.Position(0.2**2, lever_arm=(0.5, -0.3, 0.8)),
    "gps, free arm": sq.Position([0.04, 0.05, 0.09], lever_arm=(0.5, -0.3, 0.8), arm="arm"),
    "barometer": sq.Barometer(0.3**2),
    "barometer, bias, down": sq.Barometer(0.3**2, bias="offset", up=-1.0),
    "magnetometer": sq.Magnetometer(FIELD, 0.5**2),
    "magnetometer, bias, mount": sq.Magnetometer(FIELD, [0.2, 0.3, 0.4], bias="iron", body_q_sensor=TILTED),
    "velocity": sq.Velocity([0.01, 0.02, 0.03]),
    "zero velocity": sq.ZeroVelocity(0.02**2),
    "body velocity": sq.BodyVelocity([0.01, 0.04], axes=(1, 2)),
    "body velocity, scale, mount": sq.BodyVelocity(0.01, axes=(2, 0), scale="offset", body_q_sensor=TILTED),
    "wheels": sq.WheelOdometry([0.01, 0.02, 0.03], scale="offset"),
    "wheels, arm": sq.WheelOdometry(
        [0.01, 0.02, 0.03], lever_arm=(-1.0, 0.3, -0.5), gyro_bias="gyro_bias", body_q_sensor=TILTED
    ),
    "orientation": sq.Orientation([1e-4, 2e-4, 3e-4]),
    "orientation, mount": sq.Orientation([1e-4, 2e-4, 3e-4], body_q_sensor=TILTED),
    "orientation, free mount, reference": sq.Orientation(1e-4, mount="mount", reference="reference"),
    "orientation, reference": sq.Orientation(1e-4, body_q_sensor=TILTED, reference="reference"),
    "two modes": sq.TwoModeOrientation([1e-4, 2e-4, 3e-4], body_q_sensor=TILTED),
    "pose": sq.PoseReading([1e-4, 2e-4, 1e-4, 0.01, 0.02, 0.03]),
    "pose, mount": sq.PoseReading([1e-4, 2e-4, 1e-4, 0.01, 0.02, 0.03], body_T_sensor=MOUNT),
    "pose, free mount": sq.PoseReading(1e-3, mount="rig"),
    "pixels": sq.CameraProjection(LANDMARKS, [1.0, 2.0], (500.0, 510.0, 320.0, 240.0), BODY_T_CAMERA),
    "stereo": sq.StereoPixels(LANDMARKS, 1.0, (500.0, 510.0, 320.0, 240.0), 0.25, BODY_T_CAMERA),
    "stereo, one row": sq.StereoPixels(
        LANDMARKS, [1.0, 1.5, 2.0], (500.0, 510.0, 320.0, 240.0), 0.25, BODY_T_CAMERA, shared_row=True
    ),
}
"""Every sensor of a body in space, on `EVERYTHING`."""


def context_of(name, rng):
    """Some context that the sensor can be given, for one reading."""
    if name in {"pixels", "stereo", "stereo, one row"}:
        return np.array([float(rng.integers(len(LANDMARKS)))])
    if name == "wheels, arm":
        return rng.standard_normal(3)
    if name == "two modes":
        first, second = sq.SO3().random(rng, shape=(2,))
        covs = [root @ root.T + 0.1 * np.eye(3) for root in 0.3 * rng.standard_normal((2, 3, 3))]
        return sq.two_mode_readings([0.0], [first], [second], 2.0, covs[:1], covs[1:]).context[0]
    return np.zeros(1)


def aided():
    """Strapdown navigation with everything that is bolted to a car, calibration parts walking or static."""
    noise = sq.ImuNoise(
        gyro_density=2e-3,
        accel_density=2e-2,
        gyro_bias_walk=1e-4,
        accel_bias_walk=1e-3,
        integration_density=1e-3,
    )
    manifold = sq.Product(
        nav=sq.NavState(), accel_bias=sq.Vector(3), gyro_bias=sq.Vector(3), offset=sq.Vector(1),
        iron=sq.Vector(3), arm=sq.Vector(3), scale=sq.Vector(1),
    )  # fmt: skip
    mean = manifold.pack(
        nav=[math.cos(0.4), 0, 0, math.sin(0.4), 1.0, 2.0, 0.5, 2.0, 0.0, 0.1],
        accel_bias=[0.05, -0.02, 0.03], gyro_bias=[0.01, 0.0, -0.01],
        offset=[1.0], iron=[3.0, -2.0, 1.0], arm=[0.0, 0.0, 0.0], scale=[0.0],
    )  # fmt: skip
    sigmas = [
        *[0.05] * 3,
        *[0.5] * 3,
        *[0.3] * 3,
        *[0.05] * 3,
        *[0.01] * 3,
        2.0,
        *[2.0] * 3,
        *[0.1] * 3,
        0.05,
    ]
    sensors = {
        "gps": sq.Position(0.2**2, lever_arm=(0.5, -0.3, 0.8), arm="arm"),
        "barometer": sq.Barometer(0.3**2, bias="offset"),
        "compass": sq.Magnetometer(FIELD, 0.5**2, bias="iron", body_q_sensor=TILTED),
        "doppler": sq.Velocity(0.1**2),
        "log": sq.BodyVelocity([0.01, 0.04], axes=(0, 2), scale="scale"),
    }
    model = sq.StateSpace(
        manifold, sq.Gaussian(mean, sq.diagonal(sigmas)), sq.Strapdown(noise, walks={"offset": 0.05}),
        sensors, "imu", 0.0, static=("iron", "arm", "scale"),
    )  # fmt: skip
    readings = {"gps": 10, "barometer": 7, "compass": 4, "doppler": 20, "log": 6}
    return World("aided navigation", model, times(201, 0.02), imu_inputs(201), readings)


def imu_inputs(count):
    """Specific force and rate of a body that turns, speeds up and slows down."""
    k = np.arange(count)
    turning = np.column_stack([0.4 * np.sin(0.05 * k), 0.4 * np.cos(0.04 * k), 0.3 + 0 * k])
    pushing = np.column_stack([0.5 * np.cos(0.03 * k), 0.6 + 0 * k, 9.81 + 0.2 * np.sin(0.06 * k)])
    return np.column_stack([pushing, turning])


def seen_marker(sensor=None):
    """An attitude turned by a gyro with a bias, corrected by a camera that sees a marker."""
    noise = sq.ImuNoise(gyro_density=5e-3, accel_density=1.0, gyro_bias_walk=1e-3, accel_bias_walk=1.0)
    manifold = sq.attitude_state()
    prior = sq.Gaussian([1.0, 0, 0, 0, 0.02, -0.01, 0.03], sq.diagonal([*[0.3] * 3, *[0.05] * 3]))
    sensor = sensor or sq.Orientation([4e-4, 9e-4, 1e-4], body_q_sensor=TILTED)
    model = sq.StateSpace(manifold, prior, sq.GyroAttitude(noise), {"marker": sensor}, "gyro", 0.0)
    k = np.arange(201)
    rates = np.column_stack([np.sin(0.1 * k), 0.7 * np.cos(0.05 * k), 0.5 + 0.0 * k])
    return World("seen marker", model, times(201, 0.01), rates, {"marker": 7})


def mounted_marker():
    """The same, with the camera's place on the inertial unit unknown: learnt from turns."""
    noise = sq.ImuNoise(gyro_density=5e-3, accel_density=1.0, gyro_bias_walk=1e-3, accel_bias_walk=1.0)
    manifold = sq.Product(attitude=sq.SO3(), gyro_bias=sq.Vector(3), mount=sq.SO3())
    mean = manifold.pack(attitude=[1.0, 0, 0, 0], gyro_bias=[0.02, -0.01, 0.03], mount=TILTED)
    prior = sq.Gaussian(mean, sq.diagonal([*[0.03] * 3, *[0.05] * 3, *[0.05] * 3]))
    sensors = {
        "marker": sq.Orientation(0.02**2, mount="mount"),
        "gravity": sq.Direction((0.0, 0.0, 9.81), 0.3**2),
    }
    model = sq.StateSpace(manifold, prior, sq.GyroAttitude(noise), sensors, "gyro", 0.0, static=("mount",))
    k = np.arange(201)
    rates = np.column_stack([np.sin(0.1 * k), 0.7 * np.cos(0.05 * k), 0.5 + 0.0 * k])
    return World("marker, unknown mount", model, times(201, 0.01), rates, {"marker": 7, "gravity": 4})


def drifting_camera(names=("pixels", "stereo", "pose")):
    """A body that drifts about before landmarks of known places."""
    sensors = {
        "pixels": sq.CameraProjection(LANDMARKS, [1.0, 2.0], (500.0, 510.0, 320.0, 240.0), BODY_T_CAMERA),
        "stereo": sq.StereoPixels(LANDMARKS, 1.0, (500.0, 510.0, 320.0, 240.0), 0.25, BODY_T_CAMERA),
        "pose": sq.PoseReading([4e-4, 4e-4, 4e-4, 0.01, 0.02, 0.03], body_T_sensor=MOUNT),
    }
    model = sq.StateSpace(
        sq.SE3(), sq.Gaussian(sq.SE3().identity(), sq.diagonal([*[0.1] * 3, *[0.3] * 3])),
        sq.RandomWalk([0.002] * 3 + [0.02] * 3), {name: sensors[name] for name in names}, start=0.0,
    )  # fmt: skip
    rows = {"pixels": np.arange(1, 61), "stereo": np.arange(3, 61, 3), "pose": np.arange(5, 61, 5)}
    rows = {name: rows[name] for name in names}
    which = {name: (np.arange(len(rows[name])) % len(LANDMARKS))[:, None] for name in names if name != "pose"}
    return World("drifting camera", model, times(61, 0.1), None, rows, which)


def planar_localiser():
    """A wheeled robot with a localiser whose place on it is unknown, and an antenna."""
    manifold = sq.Product(pose=sq.SE2(), lidar=sq.SE2(), arm=sq.Vector(2))
    prior = sq.Gaussian(
        [0.5, -1.0, 0.4, 0.2, 0.1, 0.3, 0.1, 0.0], sq.diagonal([*[0.2] * 3, *[0.1] * 3, 0.2, 0.2])
    )
    sensors = {
        "lidar": sq.PoseReading([0.01, 0.01, 4e-4], mount="lidar", planar=True),
        "gps": sq.Position([0.04, 0.09], axes=2, lever_arm=(0.3, 0.0), arm="arm"),
    }
    model = sq.StateSpace(
        manifold, prior, sq.Unicycle(0.02, 0.02, 0.02), sensors, "odometry", 0.0, static=("lidar", "arm")
    )
    return World("planar localiser", model, times(121, 0.1), drive(121), {"lidar": 6, "gps": 4})


SENSOR_WORLDS = [aided(), seen_marker(), mounted_marker(), drifting_camera(), planar_localiser()]
