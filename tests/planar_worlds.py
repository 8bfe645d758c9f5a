"""A robot on a floor with a camera, among points of space."""

from dataclasses import dataclass

import numpy as np

from sequential.manifold import SE2, Vector, quaternion_from_matrix
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import PlanarProjection
from vision3d.camera import Camera

PIXEL = 0.5


@dataclass(frozen=True)
class CameraTour:
    problem: SlamProblem
    poses: np.ndarray
    points: np.ndarray


def mounted_camera():
    """A camera that looks along the robot's x axis, 20 cm ahead of its centre and 30 cm up."""
    camera = Camera("pinhole", (300.0, 300.0, 320.0, 240.0), (), (640, 480))
    body_R_camera = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    return camera, np.concatenate([quaternion_from_matrix(body_R_camera), [0.2, 0.0, 0.3]])


def camera_tour(rng, steps=40, points=60, *, still=False):
    """Known poses on a circle (or in one place), pixels with noise, unknown points."""
    turn = np.linspace(0.0, 2.0, steps)
    poses = np.column_stack([6.0 * np.sin(turn), 6.0 - 6.0 * np.cos(turn), turn])
    if still:
        poses = np.zeros((steps, 3))
    place = np.column_stack([rng.uniform(-2.0, 12.0, (points, 2)), rng.uniform(0.0, 2.0, points)])
    if still:
        place[:, 0] = np.abs(place[:, 0]) + 1.0
    model = PlanarProjection(*mounted_camera())
    index = np.stack(np.meshgrid(np.arange(steps), np.arange(points), indexing="ij"), -1).reshape(-1, 2)
    pixel = model.expected(poses[index[:, 0]], place[index[:, 1]])
    inside = ((pixel > 0.0) & (pixel < [640.0, 480.0])).all(axis=1)
    pixel = pixel[inside] + PIXEL * rng.standard_normal((inside.sum(), 2))
    seen = Factors(model, ("x", "l"), index[inside], pixel, PIXEL**2, name="camera")
    start = Values({"x": np.arange(steps)}, {"x": poses})
    return CameraTour(SlamProblem({"x": SE2(), "l": Vector(3)}, (seen,), start=start), poses, place)
