"""Structure from motion grown image by image: two views, then the image that sees most of what is there.

    model = grow(scene, verified_pairs(scene))

Every step is a part of this package: motions of two views, tracks, triangulation, the pose of an image from
points it sees, and a bundle adjustment that is passed in.  Schönberger, Frahm 2016, "Structure-from-motion
revisited", and before it Snavely, Seitz, Szeliski 2006, describe the scheme.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from vision3d.camera import Camera
from vision3d.sfm.growth import Growth, GrowthSettings, Scene
from vision3d.sfm.placing import place_image
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.seeding import PairGeometry, seeds
from vision3d.sfm.spanning import span_tracks
from vision3d.sfm.tracks import Tracks, build_tracks

__all__ = ["Adjust", "grow", "plausible"]

Adjust = Callable[[Reconstruction, bool], Reconstruction]
"""A bundle adjustment: a reconstruction, and whether its intrinsics move, gives the adjusted one."""

TRIALS = 3  # pairs to begin from, before the best that was had is kept
PLAUSIBLE_FOCAL = (0.25, 8.0)  # of the longer side: 127° to 7° across
ENOUGH = 0.9  # share of the images that ends the search for a better beginning


def grow(
    scene: Scene,
    pairs: Sequence[PairGeometry],
    settings: GrowthSettings | None = None,
    *,
    adjust: Adjust | None = None,
    placed: Callable[[int], None] = lambda _: None,
) -> Reconstruction | None:
    """Grow a reconstruction; None where no pair can begin one.

    Parameters
    ----------
    scene : images, their cameras and features
    pairs : pairs of images whose motion is known
    settings : thresholds
    adjust : the bundle adjustment; None for `vision3d.sfm.adjustment` with a soft-L1 loss
    placed : called with the number of images that have a pose, whenever there is one more
    """
    settings = settings or GrowthSettings()
    tracks = build_tracks(scene.pixels, {(pair.a, pair.b): pair.rows for pair in pairs})
    best: Growth | None = None
    for pair in seeds(pairs, settings)[:TRIALS]:
        growth = _grown_from(pair, scene, tracks, settings, adjust or plain_adjust, placed)
        if growth is not None and (best is None or growth.size > best.size):
            best = growth
        if best is not None and len(best.placed) >= ENOUGH * len(scene.names):
            break
    return None if best is None else best.reconstruction()


def plain_adjust(found: Reconstruction, refine: bool) -> Reconstruction:  # noqa: FBT001 - the callable's signature
    """Bundle adjustment on compiled Jacobians with a soft-L1 loss."""
    from vision3d.sfm.adjustment import adjust
    from vision3d.sfm.bundle_problem import bundle_problem, resettled

    problem, start = bundle_problem(found, refine=refine)
    return resettled(found, problem, adjust(problem, start, loss="soft_l1", settled=1e-7).state)


def plausible(camera: Camera) -> bool:
    """Whether a focal length is one that lenses have."""
    shares = camera.intrinsics[:2] / max(camera.size)
    return bool((shares >= PLAUSIBLE_FOCAL[0]).all() and (shares <= PLAUSIBLE_FOCAL[1]).all())


def _grown_from(
    pair: PairGeometry,
    scene: Scene,
    tracks: Tracks,
    settings: GrowthSettings,
    adjust: Adjust,
    placed: Callable[[int], None],
) -> Growth | None:
    """All that grows from one pair; None where its points do not hold."""
    growth = Growth.begun(scene, tracks, settings, pair)
    span_tracks(growth)
    if np.isfinite(growth.points[:, 0]).sum() < settings.least_points:
        return None
    _settle(growth, adjust)
    settled_at = 2
    refused: set[int] = set()
    while True:
        image = _next(growth, refused)
        if image is None:
            break
        if not place_image(growth, image):
            refused.add(image)
            continue
        span_tracks(growth)
        placed(len(growth.placed))
        # the whole is adjusted while it is small, and whenever it has grown by a tenth
        if len(growth.placed) <= 12 or len(growth.placed) >= 1.1 * settled_at:
            _settle(growth, adjust)
            settled_at = len(growth.placed)
            refused.clear()
    for _ in range(settings.rounds):
        _settle(growth, adjust)
    return growth if np.isfinite(growth.points[:, 0]).sum() >= settings.least_points else None


def _settle(growth: Growth, adjust: Adjust) -> None:
    """Adjust the whole, and look again at what fits it and what does not."""
    found = growth.reconstruction()
    refine = growth.scene.calibrate and len(growth.placed) >= growth.settings.calibrate_from
    moved = adjust(found, refine)
    if not all(plausible(camera) for camera in moved.cameras):
        # too little depth to calibrate by: the focal length runs away, and takes the rest along
        moved = adjust(found, False)  # noqa: FBT003 - the callable's signature
    growth.take(moved)
    growth.review()
    span_tracks(growth)


def _next(growth: Growth, refused: set[int]) -> int | None:
    """The image without a pose that sees points in most parts of it; None where none sees enough."""
    tracks = growth.tracks
    known = np.isfinite(growth.points[tracks.tracks, 0])
    best, most = None, 0
    for image in range(len(growth.scene.names)):
        if image in refused or image in growth.placed:
            continue
        mine = known & (tracks.images == image)
        if mine.sum() < growth.settings.least_inliers:
            continue
        cells = np.floor(8.0 * tracks.pixels[mine] / growth.scene.camera(image).size).astype(np.int64)
        score = len(np.unique(cells, axis=0)) * 10_000 + min(int(mine.sum()), 9_999)
        if score > most:
            best, most = image, score
    return best
