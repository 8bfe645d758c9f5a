"""The map by the camera alone, step by step: start, refine, gate, refine."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.gating import Gated, gate, usual_scale, variance_scale
from factorlab.marker_map.start import Modes, start_map
from factorlab.marker_map.start_frames import REFINED_PX, start_frames
from sequential.errors import DataError
from vision3d.markers.sightings import MarkerSightings

if TYPE_CHECKING:
    from factorlab.graph.marker_map import MarkerMapGraph

__all__ = ["VisionMap", "renumbered", "vision_map"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class VisionMap:
    """A solution under the numbers of all frames (F) and markers (M) of the sightings.

    Attributes
    ----------
    sightings : with the variances that the residuals ask for
    poses, markers : (F, 7) world_T_body and (M, 7); what is not in `frames` and `rows` is the identity
    gated, scale, decided, iterations : as of `MarkerMap`
    """

    def __init__(self, sightings: MarkerSightings, mount: Array, root: int | None) -> None:
        from factorlab.graph.marker_rows import CornerRows

        self.sightings, self.mount, self.root = sightings, mount, root
        self.modes = Modes.of(sightings)
        self.corner_rows = CornerRows.of(sightings, mount)
        self.scale, self.decided, self.iterations, self.reference = 1.0, 0, 0, 0
        self.poses = np.tile([1.0, 0, 0, 0, 0, 0, 0], (len(sightings.t), 1))
        self.markers = np.tile([1.0, 0, 0, 0, 0, 0, 0], (len(sightings.ids), 1))
        self.frames = self.rows = np.zeros(0, dtype=np.int64)
        nothing = np.zeros(len(sightings), dtype=np.bool_)
        count = len(sightings.ids)
        self.gated = Gated(nothing, nothing, np.ones(count, dtype=np.bool_), np.zeros(count))

    def graph(self, taken: NDArray[np.bool_], *, robust: bool) -> MarkerMapGraph:
        """The problem of some sightings; sets `frames` and `rows` to those that it has."""
        from factorlab.graph.marker_map import MarkerMapGraph

        own, self.frames, self.rows = renumbered(self.sightings, taken)
        lost = self.reference not in self.rows
        if lost:
            raise DataError(
                f"no sighting of the reference marker {self.sightings.ids[self.reference]} fits the others; "
                "choose another with --reference"
            )
        reference = int(np.searchsorted(self.rows, self.reference))
        return MarkerMapGraph(own, self.mount, reference, robust=robust)

    def solve(self, taken: NDArray[np.bool_], *, robust: bool) -> Array:
        """Refine poses and markers; χ² (S,) of every sighting whose frame and marker have a pose."""
        from factorlab.graph.marker_map import MapState

        graph = self.graph(taken, robust=robust)
        start = MapState(self.poses[self.frames], self.markers[self.rows])
        solved = graph.solve(start, check=not robust)
        self.poses[self.frames], self.markers[self.rows] = solved.state.frames, solved.state.markers
        self.iterations += solved.iterations
        self.cost = solved.cost
        return self.chi2()

    def chi2(self) -> Array:
        """(S,) of every sighting whose frame and marker have a pose, NaN for others."""
        sightings = self.sightings
        error = self.corner_rows.errors(self.poses[sightings.frame], self.markers[sightings.marker])
        chi2 = np.asarray(np.einsum("si,si->s", error, error))
        known = np.isin(sightings.frame, self.frames) & np.isin(sightings.marker, self.rows)
        return np.where(known, chi2, np.nan)

    def widen(self, scale: float) -> None:
        """Raise the variances of all corners."""
        from factorlab.graph.marker_rows import CornerRows

        self.scale *= scale
        self.sightings = self.sightings.wider(scale)
        self.corner_rows = CornerRows.of(self.sightings, self.mount)


def vision_map(sightings: MarkerSightings, mount: Array, root: int | None, turns: Array | None) -> VisionMap:
    """Find and refine.

    Parameters
    ----------
    mount : (7,) body_T_camera
    root : row of the reference marker, or None to choose one
    turns : (F-1, 3) of the body by a gyro, or None

    Raises
    ------
    DataError, UnderConstrainedError, NotConvergedError
    """
    seen = VisionMap(sightings, mount, root)
    usable = seen.modes.probability[:, 0] > 0
    if not usable.any():
        raise DataError("no marker has a pose: their corners fit no square; check camera file and size")
    start = start_map(sightings, seen.modes, root)
    seen.reference, seen.markers = start.reference, start.poses.copy()
    frames = start_frames(seen.corner_rows, seen.modes, start, turns)
    kept = start.placed[sightings.marker] & usable & frames.placed[sightings.frame]
    seen.poses = frames.poses.copy()
    seen.solve(kept, robust=True)
    again = start_frames(
        seen.corner_rows, seen.modes, replace(start, poses=seen.markers), turns, rough_px=REFINED_PX
    )
    seen.poses[again.placed], seen.decided = again.poses[again.placed], again.doubtful
    chi2 = seen.solve(kept, robust=True)
    scale = usual_scale(sightings, chi2)
    seen.gated = gate(sightings, kept, chi2, seen.reference, scale)
    for _ in range(2):
        chi2 = seen.solve(seen.gated.taken, robust=False)
        seen.gated = gate(sightings, kept, chi2, seen.reference, scale, seen.gated)
    chi2 = seen.solve(seen.gated.taken, robust=False)
    unknowns = 6 * (len(seen.frames) + len(seen.rows) - 1)
    seen.widen(variance_scale(chi2, seen.gated.taken, unknowns))
    return seen


def renumbered(
    sightings: MarkerSightings, taken: NDArray[np.bool_], frames: Ints | None = None
) -> tuple[MarkerSightings, Ints, Ints]:
    """Sightings numbered by the frames and markers that they name, and the rows of those.

    `frames` are rows to keep besides, ascending.
    """
    some = sightings.keep(taken)
    rows = np.unique(some.frame if frames is None else np.concatenate([some.frame, frames]))
    markers, marker = np.unique(some.marker, return_inverse=True)
    own = replace(
        some, t=sightings.t[rows], ids=sightings.ids[markers], size_m=sightings.size_m[markers],
        frame=np.searchsorted(rows, some.frame), marker=marker, doubles=sightings.doubles[markers],
    )  # fmt: skip
    return own, rows, markers
