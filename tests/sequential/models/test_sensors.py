"""Every sensor of a body in space: its Jacobian, its meaning in plain NumPy, what it refuses."""

import numpy as np
import pytest
from sensor_worlds import BODY_T_CAMERA, EVERYTHING, FIELD, LANDMARKS, MOUNT, SENSORS, TILTED, context_of

import sequential as sq
from sequential.errors import DataError, ModelError, ShapeError
from sequential.jacobians import difference
from sequential.manifold import rotation_matrix
from sequential.manifold.quaternion import quaternion_inverse, quaternion_multiply, rotate
from sequential.model import evaluate
from sequential.sensors import simulate_imu, waypoints

SEES = {"pixels", "stereo", "stereo, one row"}  # these look ahead and want landmarks there


def anywhere(name, rng):
    scale = 0.15 if name in SEES else 1.0
    return EVERYTHING.retract(EVERYTHING.identity(), scale * rng.standard_normal(EVERYTHING.dim))


def seen(name, x, u):
    f = SENSORS[name].functions(EVERYTHING)
    return evaluate(f.value, x, u, 0.0, f.params, SENSORS[name].manifold.size)


@pytest.mark.parametrize("name", SENSORS)
def test_jacobian_meets_differences(name, rng):
    sensor = SENSORS[name]
    f, m = sensor.functions(EVERYTHING), sensor.manifold.dim
    for _ in range(20):
        x, u = anywhere(name, rng), context_of(name, rng)
        declared = evaluate(f.jacobian, x, u, 0.0, f.params, m * EVERYTHING.dim).reshape(m, -1)
        expected = difference(lambda y, u=u: seen(name, y, u), x, EVERYTHING, sensor.manifold)
        np.testing.assert_allclose(declared, expected, rtol=0, atol=1e-7 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", SENSORS)
def test_reading_is_the_formula(name, rng):
    x, u = anywhere(name, rng), context_of(name, rng)
    np.testing.assert_allclose(seen(name, x, u), FORMULAS[name](EVERYTHING.unpack(x), u), rtol=0, atol=1e-9)


def split(parts):
    """Attitude (matrix), position and velocity."""
    return rotation_matrix(parts["nav"][:4]), parts["nav"][4:7], parts["nav"][7:]


def antenna(parts, extra=0.0):
    R, p, _ = split(parts)
    return p + R @ (np.array([0.5, -0.3, 0.8]) + extra)


def wheel(parts, u, arm, turn, bias):
    R, _, v = split(parts)
    return rotation_matrix(turn).T @ (R.T @ v + np.cross(u - bias, arm))


def turned(parts, mount, reference=(1.0, 0, 0, 0)):
    q = quaternion_multiply(np.array(reference), quaternion_multiply(parts["nav"][:4], np.array(mount)))
    return sq.SO3().normalize(q)


def carried(parts, mount):
    R, p, _ = split(parts)
    return np.concatenate([turned(parts, mount[:4]), p + R @ mount[4:]])


def camera_point(parts, u):
    R, p, _ = split(parts)
    body = R.T @ (LANDMARKS[int(u[0])] - p)
    return rotate(quaternion_inverse(BODY_T_CAMERA[:4]), body - BODY_T_CAMERA[4:])


def pixel(point):
    return np.array([500.0 * point[0] / point[2] + 320.0, 510.0 * point[1] / point[2] + 240.0])


def pair(parts, u):
    left = camera_point(parts, u)
    return pixel(left), pixel(left - np.array([0.25, 0.0, 0.0]))


def likelier(parts, u):
    """A state as far from the first reading, in its sigmas, as the truth is from the likelier in its own."""
    own, e = sq.SO3(), turned(parts, TILTED)
    information = np.zeros((3, 3))
    information[np.triu_indices(3)] = u[9:15]
    information += np.triu(information, 1).T
    steps = [own.local(u[:4], e), u[15:].reshape(3, 3) @ own.local(u[4:8], e)]
    costs = [0.5 * s @ information @ s for s in steps]
    return own.retract(u[:4], steps[int(costs[1] < costs[0] - u[8])])


NONE = np.zeros(3)
FORMULAS = {
    "gps": lambda s, _: antenna(s),
    "gps, free arm": lambda s, _: antenna(s, s["arm"]),
    "barometer": lambda s, _: s["nav"][6:7],
    "barometer, bias, down": lambda s, _: s["offset"] - s["nav"][6:7],
    "magnetometer": lambda s, _: split(s)[0].T @ FIELD,
    "magnetometer, bias, mount": lambda s, _: rotation_matrix(TILTED).T @ split(s)[0].T @ FIELD + s["iron"],
    "velocity": lambda s, _: split(s)[2],
    "zero velocity": lambda s, _: split(s)[2],
    "body velocity": lambda s, _: (split(s)[0].T @ split(s)[2])[[1, 2]],
    "body velocity, scale, mount": lambda s, _: (
        wheel(s, NONE, NONE, TILTED, NONE)[[2, 0]] * np.array([1.0, 1.0 + s["offset"][0]])
    ),
    "wheels": lambda s, _: (split(s)[0].T @ split(s)[2]) * np.array([1.0 + s["offset"][0], 1.0, 1.0]),
    "wheels, arm": lambda s, u: wheel(s, u, np.array([-1.0, 0.3, -0.5]), TILTED, s["gyro_bias"]),
    "orientation": lambda s, _: turned(s, (1.0, 0, 0, 0)),
    "orientation, mount": lambda s, _: turned(s, TILTED),
    "orientation, free mount, reference": lambda s, _: turned(s, s["mount"], s["reference"]),
    "orientation, reference": lambda s, _: turned(s, TILTED, s["reference"]),
    "two modes": likelier,
    "pose": lambda s, _: sq.SE3().normalize(s["nav"][:7]),
    "pose, mount": lambda s, _: carried(s, MOUNT),
    "pose, free mount": lambda s, _: carried(s, s["rig"]),
    "pixels": lambda s, u: pixel(camera_point(s, u)),
    "stereo": lambda s, u: np.concatenate(pair(s, u)),
    "stereo, one row": lambda s, u: np.array([pair(s, u)[0][0], pair(s, u)[1][0], pair(s, u)[0][1]]),
}


def test_a_compass_without_bias_is_a_direction(rng):
    for manifold in (sq.SO3(), sq.SE3(), sq.NavState()):
        x = manifold.random(rng)
        compass, direction = sq.Magnetometer(FIELD, 1.0), sq.Direction(FIELD, 1.0)
        values = [evaluate(s.functions(manifold).value, x, NONE, 0.0, s.functions(manifold).params, 3)
                  for s in (compass, direction)]  # fmt: skip
        np.testing.assert_allclose(values[0], values[1], rtol=0, atol=1e-12)


def test_the_camera_stands_where_its_sighting_of_the_marker_says(rng):
    """A marker's attitude in the camera, turned round, with its covariance carried along."""
    own, cov = sq.SO3(), np.diag([1e-4, 4e-4, 9e-4])
    truth, marker = own.random(rng), own.random(rng)
    exact = quaternion_multiply(quaternion_inverse(truth), marker)
    noise = rng.multivariate_normal(np.zeros(3), cov, 4000)
    read, spread = sq.marker_attitude(own.retract(exact, noise), cov, marker)
    errors = own.local(truth, read)
    np.testing.assert_allclose(np.cov(errors.T), spread[0], rtol=0, atol=6e-5)
    back, _ = sq.marker_attitude(exact, cov)
    np.testing.assert_allclose(own.local(back[0], quaternion_inverse(exact)), 0.0, atol=1e-12)


@pytest.mark.parametrize("height", [0.0, 500.0, 3000.0, 9000.0])
def test_pressure_is_the_standard_atmosphere(height):
    """The hydrostatic equation, integrated in small steps by someone else's formula."""
    z = np.linspace(0.0, height, 20001)
    middle = 0.5 * (z[1:] + z[:-1]) if height else np.zeros(0)
    pressure = 101325.0 * np.exp(
        -np.sum(0.0289644 * 9.80665 / (8.31447 * (288.15 - 0.0065 * middle))) * (z[1] - z[0])
    )
    assert sq.pressure_height(pressure) == pytest.approx(height, abs=0.2)


def test_readings_of_stillness_are_taken_where_the_unit_is_still(rng):
    turns = [[1.0, 0, 0, 0], [np.sqrt(0.5), np.sqrt(0.5), 0, 0], [1.0, 0, 0, 0]]
    motion = waypoints(turns, dwell=4.0, travel=2.0)
    recording = simulate_imu(motion, rng, field=None).recording
    stream = sq.still_velocity(recording, every=0.5)
    assert len(stream) > 12
    assert not stream.values.any()
    assert np.median(np.diff(stream.t)) == pytest.approx(0.5e9)
    rows = np.searchsorted(recording.t, stream.t)
    rate = np.linalg.norm(recording.gyro[rows], axis=1)
    assert rate.max() < 0.05


def test_wheels_say_zero_across():
    stream = sq.wheel_readings([0.0, 0.1], [1.0, 2.0], np.ones((2, 3)))
    np.testing.assert_array_equal(stream.values, [[1.0, 0, 0], [2.0, 0, 0]])
    assert stream.context.shape == (2, 3)
    with pytest.raises(ShapeError, match=r"\(N,\)"):
        sq.wheel_readings([0.0], [[1.0, 2.0]])


def test_each_mode_is_weighed_by_its_own_noise(rng):
    """Half the squared distance of either mode, and its volume and odds: the largest term of the mixture."""
    own, world_q_body = sq.SO3(), sq.SO3().random(rng)
    f = sq.TwoModeOrientation(1.0).functions(own)
    taken = set()
    for _ in range(40):
        modes = own.retract(world_q_body, 0.3 * rng.standard_normal((2, 3)))
        covs = np.array([0.1 * root @ root.T + 0.02 * np.eye(3) for root in rng.standard_normal((2, 3, 3))])
        steps = own.local(modes, world_q_body)
        squares = np.einsum("ki,kij,kj->k", steps, np.linalg.inv(covs), steps)
        chances = np.array([0.7, 0.3]) * np.exp(-0.5 * squares) / np.sqrt(np.linalg.det(covs))
        stream = sq.two_mode_readings([0.0], modes[:1], modes[1:], 0.7 / 0.3, covs[:1], covs[1:])
        expected = evaluate(f.value, world_q_body, stream.context[0], 0.0, f.params, 4)
        off = own.local(modes[0], expected)
        best = int(chances.argmax())
        taken.add(best)
        assert off @ np.linalg.solve(covs[0], off) == pytest.approx(squares[best], rel=1e-9)
    assert taken == {0, 1}


def test_a_second_reading_may_be_absent():
    stream = sq.two_mode_readings([0.0, 1.0], np.eye(4)[:2], [[np.nan] * 4, [0, 1.0, 0, 0]], [5.0, 2.0])
    assert not stream.context[0, 4:8].any()
    x = np.array([0.0, 0, 1.0, 0])
    f = sq.TwoModeOrientation(1e-4).functions(sq.SO3())
    np.testing.assert_allclose(evaluate(f.value, x, stream.context[0], 0.0, f.params, 4), x)


BAD = [
    (lambda: sq.Barometer(1.0, up=0.5), ModelError, "up is 1 where z points up"),
    (lambda: sq.Barometer(1.0, axis=4).functions(sq.Vector(3)), ModelError, "reads number 4"),
    (lambda: sq.Barometer(1.0, bias="iron").functions(EVERYTHING), ModelError, "has 3 numbers; 1 number is"),
    (lambda: sq.Magnetometer((0, 0, 0), 1.0), ModelError, "not all zero"),
    (lambda: sq.Magnetometer(FIELD, 1.0, bias="offset").functions(EVERYTHING), ModelError, "3 numbers are"),
    (lambda: sq.Magnetometer(FIELD, 1.0, body_q_sensor=[1, 1, 0, 0]), DataError, "unit quaternion"),
    (lambda: sq.Velocity(1.0).functions(sq.SE3()), ModelError, "NavState"),
    (lambda: sq.Velocity(1.0, part="offset").functions(EVERYTHING), ModelError, "three numbers"),
    (lambda: sq.BodyVelocity(1.0, axes=(0, 0)), ModelError, "each once"),
    (lambda: sq.BodyVelocity(1.0).functions(sq.SE2()), ModelError, "NavState"),
    (lambda: sq.WheelOdometry(1.0, lever_arm=(1.0, 2.0)), ShapeError, "lever_arm of a WheelOdometry"),
    (lambda: sq.Orientation(1.0, body_q_sensor=TILTED, mount="mount"), ModelError, "not both"),
    (lambda: sq.Orientation(1.0, mount="rig").functions(EVERYTHING), ModelError, "mount needs a part 'rig'"),
    (lambda: sq.TwoModeOrientation(1.0, mode=2), ModelError, "None, 0 or 1"),
    (lambda: sq.PoseReading(1.0, body_T_sensor=TILTED), ShapeError, r"pose \(7,\), got shape \(4,\)"),
    (lambda: sq.PoseReading(1.0, planar=True).functions(sq.SE3()), ModelError, "SE2"),
    (lambda: sq.CameraProjection(LANDMARKS[:, :2], 1.0), ShapeError, r"\(L, 3\)"),
    (lambda: sq.CameraProjection(LANDMARKS, 1.0, (0.0, 1.0, 0, 0)), ModelError, "fx, fy, cx, cy"),
    (lambda: sq.StereoPixels(LANDMARKS, 1.0, (1.0, 1.0, 0, 0), 0.0), ModelError, "baseline"),
    (lambda: sq.Position(1.0, arm="iron").functions(sq.SE3()), ModelError, "'iron'"),
    (lambda: sq.Position(1.0, axes=4), ModelError, "2 or 3 axes"),
    (lambda: sq.pressure_height(1013.25), DataError, "hPa"),
    (lambda: sq.two_mode_readings([0.0], [TILTED], [TILTED], 0.0), ModelError, "odds are positive"),
    (lambda: sq.marker_attitude([TILTED], np.eye(2)), ShapeError, "covariances"),
]


@pytest.mark.parametrize(
    ("make", "error", "message"), BAD, ids=lambda value: getattr(value, "__name__", None)
)
def test_what_does_not_fit_is_said(make, error, message):
    with pytest.raises(error, match=message):
        make()


def walk(process, manifold, u):
    f, d = process.functions(manifold), manifold.dim
    return evaluate(f.noise, manifold.identity(), u, 0.5, f.params, d * d).reshape(d, d)


def test_named_parts_walk_and_others_stand_still():
    noise = sq.ImuNoise(1e-3, 1e-2, 1e-4, 1e-3)
    cov = walk(sq.Strapdown(noise, walks={"offset": 0.2}), EVERYTHING, np.zeros(6))
    assert cov[EVERYTHING.tangent("offset"), EVERYTHING.tangent("offset")].item() == pytest.approx(0.02)
    assert not cov[EVERYTHING.tangent("iron").start :].any()
    state = sq.Product(pose=sq.SE2(), scale=sq.Vector(2))
    cov = walk(sq.Unicycle(0.1, 0.1, 0.1, walks={"scale": [0.0, 0.4]}), state, np.zeros(2))
    np.testing.assert_allclose(np.diag(cov), [0.005, 0.005, 0.005, 0.0, 0.08])
    with pytest.raises(ModelError, match="moves 'nav' itself"):
        sq.Strapdown(noise, walks={"nav": 1.0}).functions(EVERYTHING)
    with pytest.raises(ModelError, match="'drift' walk, which is no part"):
        sq.Strapdown(noise, walks={"drift": 1.0}).functions(EVERYTHING)
    with pytest.raises(ModelError, match="zero or more"):
        sq.Unicycle(0.1, 0.1, 0.1, walks={"scale": -1.0}).functions(state)
    with pytest.raises(ModelError, match="along, across and heading"):
        sq.Unicycle(0.1, 0.1, 0.1, walks={"pose": 1.0}).functions(state)
