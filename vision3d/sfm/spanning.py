"""Tracks of images that have a pose become points, one wrong observation at a time left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision3d.sfm.growth import Growth
from vision3d.triangulate import triangulate

__all__ = ["span_tracks"]

TRIES = 3  # observations that a track may lose


def span_tracks(growth: Growth) -> int:
    """Triangulate every track that has no point yet and that two placed images see; gives how many came.

    A point is taken where all its observations fit and its rays open wide enough.  Where they do not fit, the
    worst observation is left out as long as three remain: an outlier of one image does not cost the track.
    """
    tracks, settings = growth.tracks, growth.settings
    placed = np.isfinite(growth.poses[tracks.images, 0])
    # observations of points that are known may fit by now
    known = np.isfinite(growth.points[tracks.tracks, 0])
    growth.fits |= known & placed & (growth.errors() <= settings.error_px)
    active = placed & ~known
    came = 0
    for _ in range(TRIES + 1):
        active &= np.bincount(tracks.tracks[active], minlength=tracks.count)[tracks.tracks] >= 2
        if not active.any():
            break
        came += _spanned(growth, active)
    return came


def _spanned(growth: Growth, active: NDArray[np.bool_]) -> int:
    """Triangulate from the active observations; those of points that came, and the worst of others, leave."""
    tracks, settings, images = growth.tracks, growth.settings, growth.placed
    rows = np.flatnonzero(active)
    wanted, column = np.unique(tracks.tracks[rows], return_inverse=True)
    view = np.searchsorted(images, tracks.images[rows])
    pixels = np.full((len(images), len(wanted), 2), np.nan)
    pixels[view, column] = tracks.pixels[rows]
    cameras = [growth.camera(image) for image in images]
    for camera, seen in zip(cameras, pixels, strict=True):
        seen[np.isnan(camera.unproject(seen)).any(axis=1)] = np.nan
    found = triangulate(cameras, growth.poses[images], pixels)
    before = growth.points[wanted].copy()
    growth.points[wanted] = found.points
    errors = growth.errors()[rows]
    worst = np.zeros(len(wanted))
    np.maximum.at(worst, column, errors)
    worst[np.isnan(found.points[:, 0])] = np.inf
    good = (worst <= settings.error_px) & found.in_front & (found.angles_rad >= settings.angle_rad)
    growth.points[wanted] = np.where(good[:, None], found.points, before)
    growth.fits[rows[good[column]]] = True
    often = np.bincount(column, minlength=len(wanted))
    leaves = good[column] | (often[column] < 3) | (errors >= worst[column])
    active[rows[leaves]] = False
    return int(good.sum())
