"""Where a state lives: vectors, rotations, poses, navigation states, and products of them.

>>> from sequential.manifold import SE3, Product, Vector
>>> state = Product(pose=SE3(), gyro_bias=Vector(3))
>>> state.size, state.dim
(10, 9)
"""

from sequential.manifold.nav_state import NavState
from sequential.manifold.product import Product
from sequential.manifold.protocol import Array, Block, Kind, Manifold
from sequential.manifold.se2 import SE2
from sequential.manifold.se3 import SE3
from sequential.manifold.so2 import SO2, wrap_angle
from sequential.manifold.so3 import (
    SO3,
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
    right_jacobian,
    right_jacobian_inverse,
    rotate,
    rotation_matrix,
    skew,
)
from sequential.manifold.vector import Vector

__all__ = [
    "SE2",
    "SE3",
    "SO2",
    "SO3",
    "Array",
    "Block",
    "Kind",
    "Manifold",
    "NavState",
    "Product",
    "Vector",
    "quaternion_exp",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_log",
    "quaternion_multiply",
    "quaternion_normalize",
    "right_jacobian",
    "right_jacobian_inverse",
    "rotate",
    "rotation_matrix",
    "skew",
    "wrap_angle",
]
