"""Reconstructions whose truth is known: cameras about a cloud of points, and what they see of it."""

from functools import cache

import numpy as np

from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_from_matrix
from vision3d.camera import Camera
from vision3d.rigid import inverse, transform
from vision3d.sfm import Reconstruction

CAMERA = Camera("brown1", (520.0, 520.0, 319.5, 239.5), (-0.08,), (640, 480))
SMALL = Camera("brown1", (330.0, 330.0, 199.5, 149.5), (-0.08,), (400, 300))
SE = SE3()


def looking_at(place, target=(0.0, 0.0, 0.0)):
    """The pose camera_T_world (7,) of a camera at a place, whose image is upright (world's y points down)."""
    forward = np.asarray(target, float) - place
    forward /= np.linalg.norm(forward)
    right = np.cross([0.0, 1.0, 0.0], forward)
    right /= np.linalg.norm(right)
    world_R_camera = np.column_stack([right, np.cross(forward, right), forward])
    return inverse(np.concatenate([quaternion_from_matrix(world_R_camera), place])[None])[0]


def on_an_arc(views, radius=5.0, spread_rad=1.0):
    """Poses (V, 7) of cameras on an arc about the origin, at changing heights."""
    angles = np.linspace(-0.5 * spread_rad, 0.5 * spread_rad, views)
    places = np.column_stack([radius * np.sin(angles), 0.3 * np.cos(5.0 * angles), -radius * np.cos(angles)])
    return np.array([looking_at(place) for place in places])


def seen_cloud(rng, views=6, count=120, sigma_px=0.0, camera=CAMERA, poses=None, reach=1.2):
    """A reconstruction that is the truth, whose pixels carry noise; every picture sees most points."""
    poses = on_an_arc(views) if poses is None else poses
    points = rng.uniform(-reach, reach, (count, 3))
    rows = []
    for view, pose in enumerate(poses):
        pixels = camera.project(transform(pose, points))
        inside = (pixels > 0.0).all(axis=1) & (pixels < np.array(camera.size) - 1.0).all(axis=1)
        inside &= rng.uniform(size=count) < 0.85
        rows += [(view, point, *pixels[point]) for point in np.flatnonzero(inside)]
    table = np.array(rows)
    lengths = np.bincount(table[:, 1].astype(int), minlength=count)
    table = table[lengths[table[:, 1].astype(int)] >= 2]
    number = np.cumsum(lengths >= 2) - 1
    pixels = table[:, 2:] + rng.normal(0.0, 1.0, (len(table), 2)) * sigma_px
    return Reconstruction(
        cameras=(camera,),
        names=tuple(f"view{k:02d}.png" for k in range(len(poses))),
        camera_of=np.zeros(len(poses), dtype=np.int64),
        cameras_T_world=poses,
        points=points[lengths >= 2],
        colors=rng.integers(0, 256, (int((lengths >= 2).sum()), 3)),
        image_index=table[:, 0].astype(np.int64),
        point_index=number[table[:, 1].astype(np.int64)],
        pixels=pixels,
        sigma_px=max(sigma_px, 1e-3),
    )


@cache
def rendered(name):
    """Pictures by name and their true poses: "desk", "turned", "bricks", "wall" or "elsewhere"."""
    from vision3d.render import desk, render_scene, repeated_wall, wall

    rng = np.random.default_rng(11)
    if name == "bricks":
        scene, poses = repeated_wall(rng), _arc_about(4, (0.0, 0.0, 2.0), 1.8, 0.5)
    elif name == "turned":
        scene, poses = desk(rng), np.array([_turn(a) for a in np.linspace(-0.3, 0.3, 4)])
    elif name == "wall":
        scene, poses = wall(rng), _arc_about(4, (0.0, 0.0, 2.0), 1.8, 0.7)
    else:
        scene = desk(np.random.default_rng(99 if name == "elsewhere" else 5))
        count = 2 if name == "elsewhere" else 5
        poses = _arc_about(count, (0.0, 0.1, 1.5), 1.6, 0.7)
    names = [f"{name}{k}.png" for k in range(len(poses))]
    images = {
        one: render_scene(SMALL, pose, scene, rng=rng).image for one, pose in zip(names, poses, strict=True)
    }
    return images, dict(zip(names, poses, strict=True))


def _arc_about(count, target, distance, spread_rad):
    target = np.asarray(target)
    angles = np.linspace(-0.5 * spread_rad, 0.5 * spread_rad, count)
    return np.array(
        [
            looking_at(
                target + distance * np.array([np.sin(a), 0.06 * np.cos(4 * a) - 0.1, -np.cos(a)]), target
            )
            for a in angles
        ]
    )


def _turn(angle_rad):
    return np.array([np.cos(0.5 * angle_rad), 0.0, np.sin(0.5 * angle_rad), 0.0, 0.0, 0.0, 0.0])


def rendered_desk(seed):
    """Six pictures of 640x480 about a desk by name, and their true poses."""
    from vision3d.render import desk, render_scene

    rng = np.random.default_rng(seed)
    scene, poses = desk(rng), _arc_about(6, (0.0, 0.1, 1.5), 1.6, 0.8)
    names = [f"desk{k}.png" for k in range(len(poses))]
    images = [render_scene(CAMERA, pose, scene, rng=rng).image for pose in poses]
    return dict(zip(names, images, strict=True)), dict(zip(names, poses, strict=True))
