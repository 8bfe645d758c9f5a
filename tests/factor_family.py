"""Every kind of factor with values it can be read at: what laws and contracts run over."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import sequential as sq
from sequential.manifold import SE2, SE3, SO2, SO3, NavState, Vector
from sequential.slam import FactorModel
from sequential.slam.models import (
    Between,
    Displacement,
    LandmarkBearing,
    LandmarkRange,
    LandmarkRangeBearing,
    MarkerCorners,
    MountedRangeBearing,
    OfSensor,
    PlanarProjection,
    Prior,
    Projection,
    ScaledOdometry,
    StereoProjection,
)
from vision3d.camera import Camera

PINHOLE = Camera("pinhole", (500.0, 480.0, 320.0, 240.0))
BENT = Camera("brown4", (500.0, 480.0, 320.0, 240.0), (-0.2, 0.05, 0.001, -0.002))
FISHEYE = Camera("fisheye4", (300.0, 290.0, 320.0, 240.0), (0.05, -0.01, 0.002, 0.0005))
MOUNT = SE3().retract(SE3().identity(), np.array([0.3, -0.2, 0.1, 0.05, -0.1, 0.2]))


@dataclass(frozen=True)
class Member:
    """A model, where its variables may be, and which of them it can place."""

    name: str
    model: FactorModel
    values: Callable[[np.random.Generator, int], tuple[np.ndarray, ...]]
    places: tuple[int, ...] = ()

    def draw(self, rng, count, noise=0.05):
        """Values, and measurements near what is expected there."""
        values = self.values(rng, count)
        measured = self.model.measured
        z = self.model.expected(*values)
        return measured.retract(z, noise * rng.standard_normal((count, measured.dim))), values


def anywhere(*manifolds, scale=2.0):
    """States of manifolds, rotations up to any angle."""
    return lambda rng, count: tuple(m.random(rng, scale, (count,)) for m in manifolds)


def with_scale(*manifolds, scale=0.7):
    """States of manifolds, the last of them a scale of some per cent."""

    def draw(rng, count):
        return (*anywhere(*manifolds[:-1], scale=scale)(rng, count), manifolds[-1].random(rng, 0.1, (count,)))

    return draw


def in_view(rng, count, mount=None, depth=(2.0, 6.0)):
    """Bodies anywhere and points that their cameras see."""
    pose = SE3().random(rng, 1.0, (count,))
    z = rng.uniform(*depth, count)
    point = np.stack([rng.uniform(-0.3, 0.3, count) * z, rng.uniform(-0.2, 0.2, count) * z, z], axis=-1)
    if mount is not None:
        point = mount[4:] + sq.manifold.rotate(mount[:4], point)
    return pose, pose[:, 4:] + sq.manifold.rotate(pose[:, :4], point)


def on_floor(rng, count):
    """Robots anywhere on the floor and points that their mounted cameras see."""
    pose = SE2().random(rng, 2.0, (count,))
    upright = np.zeros((count, 7))
    upright[:, 0], upright[:, 3] = np.cos(pose[:, 2] / 2), np.sin(pose[:, 2] / 2)
    upright[:, 4:6] = pose[:, :2]
    z = rng.uniform(2.0, 6.0, count)
    seen = np.stack([rng.uniform(-0.3, 0.3, count) * z, rng.uniform(-0.2, 0.2, count) * z, z], axis=-1)
    body = MOUNT[4:] + sq.manifold.rotate(MOUNT[:4], seen)
    return pose, upright[:, 4:] + sq.manifold.rotate(upright[:, :4], body)


def markers_in_view(rng, count, mount=None):
    """Bodies anywhere and markers that face them, more or less."""
    pose, place = in_view(rng, count, mount, depth=(0.8, 2.0))
    seen = np.broadcast_to(SE3().identity() if mount is None else mount, pose.shape)
    facing = sq.manifold.quaternion_multiply(pose[:, :4], seen[:, :4])
    marker = np.concatenate([facing, place], axis=-1)
    turn = np.concatenate([0.5 * rng.standard_normal((count, 3)), np.zeros((count, 3))], axis=-1)
    return pose, SE3().retract(marker, turn)


def mounted(view):
    """The same with the camera on a mount."""
    return lambda rng, count: view(rng, count, MOUNT)


FACTORS = [
    *(Member(f"prior {m}", Prior(m), anywhere(m), (0,)) for m in (SE2(), SE3(), SO2(), SO3(), Vector(3))),
    *(
        Member(f"between {m}", Between(m), anywhere(m, m), (0, 1))
        for m in (SE2(), SE3(), SO2(), SO3(), Vector(2), Vector(5))
    ),
    Member("range and bearing", LandmarkRangeBearing(), anywhere(SE2(), Vector(2)), (1,)),
    Member(
        "range and bearing, mounted",
        MountedRangeBearing(),
        with_scale(SE2(), Vector(2), Vector(4)),
        (1,),
    ),
    Member("odometry with scales", ScaledOdometry(), with_scale(SE2(), SE2(), Vector(2), scale=0.3), (0, 1)),
    Member("range in the plane", LandmarkRange(), anywhere(SE2(), Vector(2))),
    Member("range in space", LandmarkRange(SE3()), anywhere(SE3(), Vector(3))),
    Member("bearing", LandmarkBearing(), anywhere(SE2(), Vector(2))),
    Member("displacement in the plane", Displacement(), anywhere(SE2(), Vector(2)), (1,)),
    Member("displacement, arm", Displacement(SE2(), (0.3, -0.1)), anywhere(SE2(), Vector(2)), (1,)),
    Member("displacement in space", Displacement(SE3()), anywhere(SE3(), Vector(3)), (1,)),
    Member("projection", Projection(PINHOLE), in_view),
    Member("projection, mounted", Projection(PINHOLE, MOUNT), mounted(in_view)),
    Member("projection, brown4", Projection(BENT), in_view),
    Member("projection, fisheye4", Projection(FISHEYE, MOUNT), mounted(in_view)),
    Member("projection on the floor", PlanarProjection(PINHOLE, MOUNT), on_floor),
    Member("projection on the floor, brown4", PlanarProjection(BENT, MOUNT), on_floor),
    Member("stereo", StereoProjection((500.0, 480.0, 320.0, 240.0), 0.12), in_view, (1,)),
    Member(
        "stereo, mounted",
        StereoProjection((500.0, 480.0, 320.0, 240.0), 0.12, MOUNT),
        mounted(in_view),
        (1,),
    ),
    Member("marker", MarkerCorners(PINHOLE, 0.16), markers_in_view, (0, 1)),
    Member("marker, brown4", MarkerCorners(BENT, 0.16), markers_in_view, (0, 1)),
    Member("marker, mounted", MarkerCorners(BENT, 0.16, MOUNT), mounted(markers_in_view), (0, 1)),
    Member("sensor: position", OfSensor(sq.Position(0.1, axes=3), SE3()), anywhere(SE3())),
    Member("sensor: direction", OfSensor(sq.Direction((0.2, 0.0, 1.0), 0.1), SO3()), anywhere(SO3())),
    Member(
        "sensor: range and bearing",
        OfSensor(sq.RangeBearing(np.array([[1.0, 2.0], [5.0, 1.0]]), 0.1), SE2(), (1.0,)),
        anywhere(SE2()),
    ),
    Member("sensor: navigation", OfSensor(sq.Position(0.1, axes=3), NavState()), anywhere(NavState())),
]
