"""Products: names lead to slices, states are packed and unpacked, mistakes are named."""

import numpy as np
import pytest

from sequential.errors import DataError, ShapeError
from sequential.manifold import SE2, SE3, SO2, Block, Kind, NavState, Product, Vector

ROBOT = Product(pose=SE3(), bias=Vector(3), heading=SO2())


def test_names_lead_to_slices_and_parts():
    assert (ROBOT.size, ROBOT.dim) == (11, 10)
    assert [ROBOT.storage(name) for name in ROBOT.parts] == [slice(0, 7), slice(7, 10), slice(10, 11)]
    assert [ROBOT.tangent(name) for name in ROBOT.parts] == [slice(0, 6), slice(6, 9), slice(9, 10)]
    assert ROBOT.part("bias") == Vector(3)
    assert dict(ROBOT.parts) == {"pose": SE3(), "bias": Vector(3), "heading": SO2()}


def test_pack_and_unpack_are_inverse(rng):
    x = ROBOT.random(rng, shape=(4,))
    np.testing.assert_array_equal(ROBOT.pack(**ROBOT.unpack(x)), x)


def test_pack_broadcasts_and_takes_bare_numbers():
    history = ROBOT.pack(pose=np.tile(SE3().identity(), (5, 1)), bias=[1, 2, 3], heading=0.5)
    assert history.shape == (5, 11)
    np.testing.assert_array_equal(history[3, 7:], [1.0, 2.0, 3.0, 0.5])


def test_order_of_arguments_does_not_matter_to_pack():
    state = Product(a=Vector(1), b=Vector(1))
    np.testing.assert_array_equal(state.pack(b=2.0, a=1.0), [1.0, 2.0])


def test_nested_products_flatten():
    outer = Product(first=Vector(2), robot=ROBOT, nav=NavState())
    assert outer.blocks() == (
        Block(Kind.VECTOR, 0, 0, 2, 2),
        Block(Kind.SE3, 2, 2, 7, 6),
        Block(Kind.VECTOR, 9, 8, 3, 3),
        Block(Kind.SO2, 12, 11, 1, 1),
        Block(Kind.NAV, 13, 12, 10, 9),
    )
    assert outer.labels()[2] == "robot.pose.rx"
    inner = outer.part("robot")
    assert isinstance(inner, Product)
    np.testing.assert_array_equal(inner.unpack(outer.unpack(np.arange(23.0))["robot"])["heading"], [12.0])


def test_labels_name_part_and_component():
    assert Product(pose=SE2(), bias=Vector(2)).labels() == (
        *("pose.x", "pose.y", "pose.heading"),
        *("bias.x0", "bias.x1"),
    )


def test_parts_do_not_touch_each_other(rng):
    x, y = ROBOT.random(rng), ROBOT.random(rng)
    for matrix, member in zip(ROBOT.transport(x, y), SE3().transport(x[:7], y[:7]), strict=True):
        np.testing.assert_array_equal(matrix[:6, :6], member)
        assert not matrix[:6, 6:].any()
        assert not matrix[6:, :6].any()


def test_equality_includes_names_and_order():
    assert Product(a=SO2(), b=SE2()) == Product(a=SO2(), b=SE2())
    assert Product(a=SO2(), b=SE2()) != Product(b=SE2(), a=SO2())
    assert Product(a=SO2()) != Product(c=SO2())


def test_products_are_frozen():
    with pytest.raises(AttributeError):
        ROBOT.names = ()
    with pytest.raises(TypeError):
        ROBOT.parts["pose"] = SE2()


def test_repr_is_the_constructor():
    assert repr(ROBOT) == "Product(pose=SE3(), bias=Vector(n=3), heading=SO2())"


def test_mistakes_are_named():
    with pytest.raises(DataError, match="did you mean 'pose'"):
        ROBOT.storage("pos")
    with pytest.raises(DataError, match="'heading' is missing"):
        ROBOT.pack(pose=SE3().identity(), bias=np.zeros(3))
    with pytest.raises(DataError, match="not 'wheels'"):
        ROBOT.pack(pose=SE3().identity(), bias=np.zeros(3), heading=0.0, wheels=4)
    with pytest.raises(ShapeError, match=r"part 'bias' .* got \(2,\)"):
        ROBOT.pack(pose=SE3().identity(), bias=np.zeros(2), heading=0.0)
    with pytest.raises(DataError, match="at least one"):
        Product()
    with pytest.raises(DataError, match="must be a Manifold"):
        Product(pose=SE2)


def test_a_bad_quaternion_is_located_in_the_whole_state():
    x = Product(bias=Vector(3), pose=SE3()).identity()
    x[3] = 1.01
    with pytest.raises(DataError, match=r"components 3:7 .*1\.01"):
        Product(bias=Vector(3), pose=SE3()).check(x)
