"""Reconstructions whose truth is known: cameras past a cloud of points, seen with Gaussian noise."""

import numpy as np

from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.rigid import inverse, transform
from vision3d.sfm import Reconstruction
from vision3d.sfm.growth import Scene

SIZE = (640, 480)
CAMERAS = {
    "pinhole": Camera("pinhole", (520, 520, 322.0, 238.0), (), SIZE),
    "brown1": Camera("brown1", (520, 520, 322.0, 238.0), (-0.1,), SIZE),
    "brown2": Camera("brown2", (520, 520, 322.0, 238.0), (-0.1, 0.03), SIZE),
    "brown4": Camera("brown4", (520, 524, 322.0, 238.0), (-0.1, 0.03, 1e-3, -5e-4), SIZE),
    "brown5": Camera("brown5", (520, 524, 322.0, 238.0), (-0.1, 0.03, 1e-3, -5e-4, 0.01), SIZE),
    "rational8": Camera(
        "rational8", (520, 524, 322.0, 238.0), (0.2, 0.03, 1e-3, -5e-4, 0.01, 0.3, 0.05, 0.01), SIZE
    ),
    "thin12": Camera(
        "thin12",
        (520, 524, 322.0, 238.0),
        (0.2, 0.03, 1e-3, -5e-4, 0.01, 0.3, 0.05, 0.01, 1e-3, 0, -1e-3, 0),
        SIZE,
    ),
    "fisheye4": Camera("fisheye4", (320, 322, 322.0, 238.0), (-0.01, 0.005, -0.001, 0.0), SIZE),
}
"""One camera of every lens."""


def longer(camera, share):
    """The camera with its focal lengths grown by a share."""
    return camera.with_parameters(camera.parameters * np.r_[2 * [1 + share], np.ones(camera.count - 2)])


def bundle_world(rng, *, views=6, points=120, lens="brown2", sigma_px=0.5, cameras=1):
    """A reconstruction at its truth: cameras on an arc look at a cloud; pixels carry noise."""
    base = CAMERAS[lens]
    lenses = tuple(longer(base, 0.02 * c) for c in range(cameras))
    cloud = rng.uniform([-2.0, -1.5, 4.0], [2.0, 1.5, 8.0], (points, 3))
    turns = np.c_[
        0.05 * rng.standard_normal(views), np.linspace(0.25, -0.25, views), 0.05 * rng.standard_normal(views)
    ]
    centres = np.c_[np.linspace(-1.6, 1.6, views), 0.3 * rng.standard_normal((views, 2))]
    # the identity for the first, so that the gauge's pose is simple to read
    turns[0], centres[0] = 0.0, 0.0
    start = np.tile(SE3().identity(), (views, 1))
    world_T_camera = SE3().retract(start, np.concatenate([turns, np.zeros((views, 3))], axis=1))
    world_T_camera[:, 4:] = centres
    poses = inverse(world_T_camera)
    of = np.arange(views) % cameras
    images, tracks, pixels = [], [], []
    for i, pose in enumerate(poses):
        seen = lenses[of[i]].project(transform(pose, cloud))
        inside = ((seen > 0) & (seen < np.array(SIZE) - 1)).all(axis=1)
        images.append(np.full(inside.sum(), i))
        tracks.append(np.flatnonzero(inside))
        pixels.append(seen[inside] + sigma_px * rng.standard_normal((inside.sum(), 2)))
    whole = Reconstruction(
        cameras=lenses,
        names=tuple(f"{i:02d}.png" for i in range(views)),
        camera_of=of,
        cameras_T_world=poses,
        points=cloud,
        colors=np.full((points, 3), 90, dtype=np.uint8),
        image_index=np.concatenate(images),
        point_index=np.concatenate(tracks),
        pixels=np.concatenate(pixels),
        sigma_px=max(sigma_px, 1e-6),
    )
    return whole.selected(np.ones(len(whole.pixels), dtype=bool))


def disturbed(truth, rng, *, share=1.0, focal=0.02):
    """The same reconstruction away from its truth: poses by 0.6°, places by 1 % of the depth, focal lengths
    by 2 %."""
    depth = float(np.median(np.linalg.norm(truth.points - truth.centres.mean(axis=0), axis=1)))
    steps = (
        share * np.r_[0.01, 0.01, 0.01, *(3 * [0.01 * depth])] * rng.standard_normal((len(truth.names), 6))
    )
    steps[0] = 0.0
    cameras = tuple(longer(camera, share * focal) for camera in truth.cameras)
    return truth.replaced(
        cameras=cameras,
        cameras_T_world=inverse(SE3().retract(inverse(truth.cameras_T_world), steps)),
        points=truth.points + share * 0.01 * depth * rng.standard_normal(truth.points.shape),
    )


def seen_from(world, rng, *, wrong=0.0, calibrate=False):
    """What a matcher would give: features of every image in any order, and matches, some of them wrong."""
    views = len(world.names)
    order = [rng.permutation(np.flatnonzero(world.image_index == i)) for i in range(views)]
    scene = Scene(
        world.names, world.cameras, world.camera_of, tuple(world.pixels[rows] for rows in order),
        tuple(np.tile(np.uint8([200, 100, i]), (len(rows), 1)) for i, rows in enumerate(order)), calibrate,
    )  # fmt: skip
    matches = {}
    for a in range(views):
        for b in range(a + 1, views):
            of_a, of_b = world.point_index[order[a]], world.point_index[order[b]]
            _, rows_a, rows_b = np.intersect1d(of_a, of_b, return_indices=True)
            lost = rng.random(len(rows_b)) < wrong
            rows_b[lost] = rng.permutation(rows_b[lost])
            if len(rows_a):
                matches[a, b] = np.c_[rows_a, rows_b]
    return scene, matches
