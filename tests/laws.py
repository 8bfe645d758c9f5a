"""Laws: what must hold for a whole family, as functions that take any member of it.

`EVERY_MANIFOLD` with `assert_manifold_laws` says what a manifold is; the first is a list to parametrise
over, the second checks one member with a seeded generator.
"""

from itertools import pairwise

import numpy as np

from sequential.manifold import SE2, SE3, SO2, SO3, Kind, NavState, Product, Vector

EVERY_MANIFOLD = [
    Vector(1),
    Vector(5),
    SO2(),
    SO3(),
    SE2(),
    SE3(),
    NavState(),
    Product(pose=SE2(), speed=Vector(1)),
    Product(nav=NavState(), gyro_bias=Vector(3), accel_bias=Vector(3)),
    Product(robot=Product(pose=SE3(), arm=Product(joint=SO2(), wrist=SO3())), clock=Vector(2), field=SE2()),
]

ROTATION = {
    Kind.VECTOR: slice(0, 0),
    Kind.SO2: slice(0, 1),
    Kind.SO3: slice(0, 3),
    Kind.SE2: slice(2, 3),
    Kind.SE3: slice(0, 3),
    Kind.NAV: slice(0, 3),
}
"""Where the rotation lies in the tangent of a block."""

ANGLES = (0.0, 1e-12, 1e-8, 1e-5, 1e-3, 0.1, 0.99, 1.01, 2.0, 3.0, np.pi - 1e-5, np.pi - 1e-9)
"""Angles from zero to the edge of the chart, close to every switch between a series and a closed form."""


def assert_manifold_laws(manifold, rng):
    """Check everything that an estimator relies on when it moves a state."""
    assert_layout(manifold)
    assert_origin(manifold, rng)
    for angle in ANGLES:
        assert_retract_and_local_invert(manifold, rng, angle)
    for angle in (0.0, 1e-7, 0.1, 1.0, 2.0, np.pi - 0.05):
        assert_transport_meets_differences(manifold, rng, angle)
    assert_transport_carries_steps(manifold, rng)
    assert_leading_axes_broadcast(manifold, rng)
    assert_canonical(manifold, rng)


def step_of_angle(manifold, rng, angle, scale=1.0):
    """A normal step whose every rotation has the given angle in rad."""
    step = scale * rng.standard_normal(manifold.dim)
    for block in manifold.blocks():
        rotation = step[block.tangent : block.tangent + block.dim][ROTATION[block.kind]]
        if rotation.size:
            rotation *= angle / np.linalg.norm(rotation)
    return step


def assert_layout(manifold):
    blocks = manifold.blocks()
    assert sum(b.size for b in blocks) == manifold.size
    assert sum(b.dim for b in blocks) == manifold.dim
    for before, after in pairwise(blocks):
        assert after.storage == before.storage + before.size
        assert after.tangent == before.tangent + before.dim
    table = manifold.table()
    assert table.dtype == np.int64
    assert table.tolist() == [[b.kind, b.storage, b.tangent, b.size, b.dim] for b in blocks]
    assert len(set(manifold.labels())) == manifold.dim


def assert_origin(manifold, rng):
    """Nothing moves by a zero step, and a state is at distance zero from itself."""
    manifold.check(manifold.identity())
    x = manifold.random(rng)
    zero = np.zeros(manifold.dim)
    np.testing.assert_allclose(manifold.retract(x, zero), x, rtol=0, atol=1e-15)
    np.testing.assert_allclose(manifold.local(x, x), zero, rtol=0, atol=1e-15)
    carried, inverse = manifold.transport(x, x)
    np.testing.assert_allclose(carried, np.eye(manifold.dim), rtol=0, atol=1e-14)
    np.testing.assert_allclose(inverse, np.eye(manifold.dim), rtol=0, atol=1e-14)


def assert_retract_and_local_invert(manifold, rng, angle):
    """``local`` undoes ``retract`` and the other way round, up to the edge of the chart."""
    x, step = manifold.random(rng), step_of_angle(manifold, rng, angle)
    y = manifold.retract(x, step)
    manifold.check(y)
    np.testing.assert_allclose(manifold.local(x, y), step, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(manifold.retract(x, manifold.local(x, y)), y, rtol=1e-12, atol=1e-13)


def assert_transport_meets_differences(manifold, rng, angle):
    """Check ``Jinv = inv(J)`` and ``T = -Jinv @ J_from`` against central differences of ``local``."""
    x = manifold.random(rng)
    y = manifold.retract(x, step_of_angle(manifold, rng, angle, scale=3.0))
    carried, inverse = manifold.transport(x, y)
    at_y = central_difference(lambda d: manifold.local(x, manifold.retract(y, d)), manifold.dim)
    at_x = central_difference(lambda d: manifold.local(manifold.retract(x, d), y), manifold.dim)
    np.testing.assert_allclose(inverse @ at_y, np.eye(manifold.dim), rtol=0, atol=2e-8)
    np.testing.assert_allclose(carried, -inverse @ at_x, rtol=1e-8, atol=2e-8)


def central_difference(function, dim, step=1e-4):
    """Differentiate at zero, with an error of fourth order in the step."""
    moves = step * np.eye(dim)
    near = np.stack([function(move) - function(-move) for move in moves], axis=-1)
    far = np.stack([function(2 * move) - function(-2 * move) for move in moves], axis=-1)
    return (8.0 * near - far) / (12.0 * step)


def assert_transport_carries_steps(manifold, rng):
    """Move both ends of a difference together, as T says, and it stays the same to first order."""
    x, y = manifold.random(rng, scale=0.3), manifold.random(rng, scale=0.3)
    carried, _ = manifold.transport(x, y)
    step = 1e-6 * rng.standard_normal(manifold.dim)
    moved = manifold.local(manifold.retract(x, step), manifold.retract(y, carried @ step))
    np.testing.assert_allclose(moved, manifold.local(x, y), rtol=0, atol=1e-10)


def assert_leading_axes_broadcast(manifold, rng):
    """Many states at once give what a loop over them gives."""
    rows, columns = manifold.random(rng, shape=(3, 1)), manifold.random(rng, shape=(4,))
    steps = rng.standard_normal((4, manifold.dim))
    methods = (manifold.retract, steps), (manifold.local, columns), (manifold.transport, columns)
    for method, second in methods:
        together = method(rows, second)
        one_by_one = [[method(row[0], other) for other in second] for row in rows]
        if method == manifold.transport:
            together, one_by_one = np.stack(together, axis=2), np.array(one_by_one)
        np.testing.assert_allclose(together, one_by_one, rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(manifold.normalize(rows)[1, 0], manifold.normalize(rows[1, 0]))


def assert_canonical(manifold, rng):
    """Random and moved states are canonical already; normalising twice is normalising once."""
    x = manifold.random(rng, scale=5.0, shape=(50,))
    manifold.check(x)
    np.testing.assert_allclose(manifold.normalize(x), x, rtol=0, atol=1e-15)
    rough = x * 1.7
    once = manifold.normalize(rough)
    manifold.check(once)
    np.testing.assert_allclose(manifold.normalize(once), once, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(rough, x * 1.7, err_msg="normalize must not write into its argument")
