"""Markers over many frames: who was seen when, with which corners, from one camera.

>>> sightings = MarkerSightings.from_frames(camera, 0.05, [(t_ns, markers), ...])  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ShapeError, TimeOrderError
from vision3d.markers.detection import Marker
from vision3d.markers.pose import MarkerPose, marker_corners, marker_poses

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["MarkerSightings"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MarkerSightings:
    """Every sighting of every marker; arrays are read-only.

    Parameters
    ----------
    camera : that saw them
    t : (F,) ns, time of each frame on the camera's clock, increasing; frames without a marker count too
    ids : (M,) numbers of the markers, ascending
    size_m : (M,) side of each black square
    frame, marker : (S,) row of `t` and of `ids`; in the order of the frames
    corners : (S, 4, 2) px
    cov : (S, 8, 8) px², of x0 y0 x1 y1 …
    doubles : (M,) how often a number was read twice in one frame; the larger square is kept
    """

    camera: Camera
    t: Ints
    ids: Ints
    size_m: Array
    frame: Ints
    marker: Ints
    corners: Array
    cov: Array
    doubles: Ints

    def __post_init__(self) -> None:
        s, m = len(self.frame), len(self.ids)
        if self.corners.shape != (s, 4, 2) or self.cov.shape != (s, 8, 8) or self.size_m.shape != (m,):
            raise ShapeError(
                f"{s} sightings of {m} markers need corners ({s}, 4, 2), cov ({s}, 8, 8) and size_m ({m},); "
                f"got {self.corners.shape}, {self.cov.shape} and {self.size_m.shape}"
            )
        if len(back := np.flatnonzero(np.diff(self.t) <= 0)):
            k = int(back[0]) + 1
            raise TimeOrderError(
                f"frame {k} is at {self.t[k] * 1e-9:.6f} s, the one before at {self.t[k - 1] * 1e-9:.6f} s; "
                "frames come in the order of their times"
            )
        for name in self.__dataclass_fields__:
            if isinstance(value := getattr(self, name), np.ndarray):
                value.flags.writeable = False

    @classmethod
    def from_frames(
        cls,
        camera: Camera,
        size_m: float | Mapping[int, float],
        frames: Iterable[tuple[int, Sequence[Marker]]],
    ) -> MarkerSightings:
        """From what was detected in each frame: its time (ns) and its markers.

        `size_m` is the side of all, or of each by its number, -1 for the others.

        Raises
        ------
        DataError
            where a marker has no size.
        """
        t: list[int] = []
        rows: list[tuple[int, Marker]] = []
        doubles: list[tuple[int, Marker]] = []
        for k, (t_ns, markers) in enumerate(frames):
            t.append(int(t_ns))
            seen: set[int] = set()
            for one in sorted(markers, key=lambda one: (one.id, -one.side_px)):
                (doubles if one.id in seen else rows).append((k, one))
                seen.add(one.id)
        ids = np.unique(np.array([one.id for _, one in rows], dtype=np.int64))
        place = {int(number): k for k, number in enumerate(ids)}
        twice = np.zeros(len(ids), dtype=np.int64)
        for _, one in doubles:
            twice[place[one.id]] += 1
        return cls(
            camera,
            np.array(t, dtype=np.int64),
            ids,
            _sizes(size_m, ids),
            np.array([k for k, _ in rows], dtype=np.int64),
            np.array([place[one.id] for _, one in rows], dtype=np.int64),
            np.array([one.corners for _, one in rows]).reshape(-1, 4, 2),
            np.array([one.cov for _, one in rows]).reshape(-1, 8, 8),
            twice,
        )

    def __len__(self) -> int:
        return len(self.frame)

    @cached_property
    def points(self) -> Array:
        """(S, 4, 3) corners in the frame of their marker, m."""
        points: Array = marker_corners(1.0) * self.size_m[self.marker, None, None]
        return points

    @cached_property
    def poses(self) -> tuple[MarkerPose | None, ...]:
        """Both readings of every sighting by itself; None where the corners fit no square."""
        markers = [
            Marker(int(self.ids[m]), corners, np.sqrt(np.diagonal(cov)[::2]), cov)
            for m, corners, cov in zip(self.marker, self.corners, self.cov, strict=True)
        ]
        return marker_poses(self.camera, markers, self.size_m[self.marker].tolist())

    @property
    def counts(self) -> Ints:
        """(M,) sightings of each marker."""
        return np.bincount(self.marker, minlength=len(self.ids)).astype(np.int64)

    def keep(self, kept: NDArray[np.bool_]) -> MarkerSightings:
        """Some of the sightings; frames and markers stay, numbered as they were."""
        given: dict[str, Any] = {
            name: getattr(self, name)[kept] for name in ("frame", "marker", "corners", "cov")
        }
        fewer = replace(self, **given)
        if "poses" in self.__dict__:
            wanted = np.arange(len(self))[kept].tolist()
            fewer.__dict__["poses"] = tuple(self.poses[k] for k in wanted)
        return fewer

    def wider(self, factor: float) -> MarkerSightings:
        """The same with variances of corners multiplied."""
        return self if factor == 1.0 else replace(self, cov=self.cov * factor)

    def shifted(self, seconds: float) -> MarkerSightings:
        """The same on another clock: that many seconds are added to the times."""
        later = replace(self, t=self.t + round(seconds * 1e9))
        if "poses" in self.__dict__:
            later.__dict__["poses"] = self.poses
        return later


def _sizes(size_m: float | Mapping[int, float], ids: Ints) -> Array:
    if not isinstance(size_m, Mapping):
        return np.full(len(ids), float(size_m))
    lacking = [int(number) for number in ids if int(number) not in size_m and -1 not in size_m]
    if lacking:
        raise DataError(f"marker {lacking[0]} has no size; give one for all, or one for each number")
    return np.array([size_m.get(int(number), size_m.get(-1, 0.0)) for number in ids], dtype=np.float64)
