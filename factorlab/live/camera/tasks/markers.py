"""Square markers: their numbers, and with a camera model where they are and how sure that is."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from factorlab.live.camera.reading import Column, Dots, Label, Line, Mark, Number, Reading, Role, Table
from factorlab.live.camera.task import Action, Task
from factorlab.live.camera.tasks.known import KnownCamera
from sequential.errors import DataError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.frames import Frame
from vision3d.markers import Marker, MarkerTracker, TrackedMarker, find_markers, marker_corners
from vision3d.markers.dictionaries import FAMILIES
from vision3d.pose import project_object

__all__ = ["MarkersTask"]

Array = NDArray[np.float64]
TOLD_ODDS, MOST_ODDS = 1e3, 1e6  # on the page and in the table; nobody knows the corners' errors better
PATIENCE = 50  # frames without a marker, after which a dictionary that was found out is looked for anew
TRACED = 3  # markers whose distance the page draws over time
PLACE = ("x_m", "y_m", "z_m")
POSE = (*PLACE, "qw", "qx", "qy", "qz")
NO_MODEL = "Give the camera's model by --camera FILE, or calibrate it here, to see where the markers are."


class MarkersTask(Task):
    """Finds the markers of a dictionary, and follows their poses where the camera is known.

    Parameters
    ----------
    known : the camera's model; without one, numbers and corners only
    size_m : side of the black squares
    dictionary : its name; `auto` finds it out
    """

    name: ClassVar = "markers"
    columns: ClassVar = (
        "id", "seen", "x_px", "y_px", "side_px", *POSE, *(f"sigma_{axis}" for axis in PLACE),
        "tilt_deg", "odds", *(f"other_{name}" for name in POSE),
    )  # fmt: skip

    def __init__(self, known: KnownCamera, size_m: float = 0.05, dictionary: str = "auto") -> None:
        self._known, self._size_m, self._asked = known, size_m, dictionary
        self._dictionary, self._tried, self._blind = dictionary, 0, 0
        self._tracker: MarkerTracker | None = None
        self._ids: set[int] = set()
        self._last: tuple[Frame, Reading] | None = None
        self.restart()

    @property
    def actions(self) -> tuple[Action, ...]:
        """Beginning anew is worth a button where poses are followed."""
        return () if self._camera is None else (("forget", "Begin the tracks anew"),)

    def prepare(self) -> None:
        """Compile what finds corners and poses, by a marker that stands before the camera."""
        from importlib import import_module

        import_module("vision3d.kernels.quad_edges")
        find_markers(np.zeros((64, 64), np.uint8), self._asked)
        camera = self._camera or Camera("pinhole", [300.0, 300.0, 160.0, 120.0], [], (320, 240))
        tracker = MarkerTracker(camera, self._size_m)
        depth = self._size_m * float(camera.intrinsics[0]) / 80.0
        for t in range(3):
            pose = np.array([np.cos(0.2), np.sin(0.2), 0.0, 0.0, 0.001 * t, 0.0, depth])
            corners = project_object(camera, pose, marker_corners(self._size_m))
            tracker.update(0.04 * t, [Marker(0, corners, np.full(4, 0.1))])

    def read(self, frame: Frame) -> Reading:
        """Every marker of the frame."""
        if self._last is None or self._last[0] is not frame:
            markers = self._found(np.asarray(frame.grey))
            self._ids.update(marker.id for marker in markers)
            if frame.still and self._camera is not None:  # a photograph says nothing about the one before
                self._tracker = MarkerTracker(self._camera, self._size_m)
            if self._tracker is None:
                reading = self._numbered(markers)
            else:
                reading = self._placed(self._tracker.update(frame.t_ns * 1e-9, markers))
            self._last = (frame, reading)
        return self._last[1]

    def _found(self, grey: NDArray[np.uint8]) -> tuple[Marker, ...]:
        """Markers of the dictionary; while it is not known, one family a frame is tried, which is quick."""
        if self._dictionary == "auto":
            families = tuple(FAMILIES.values())
            self._tried = (self._tried + 1) % len(families)
            if find_markers(grey, families[self._tried])[0]:
                self._dictionary = find_markers(grey, "auto")[1] or "auto"
        if self._dictionary == "auto":
            return ()
        markers, _ = find_markers(grey, self._dictionary, camera=self._camera)
        self._blind = 0 if markers else self._blind + 1
        if self._blind > PATIENCE:  # it may have been taken from something that is no marker
            self._dictionary, self._blind = self._asked, 0
        return markers

    def act(self, action: str) -> str:
        """Begin the tracks anew."""
        if action != "forget":
            return super().act(action)
        if self._camera is None:
            raise DataError("without a camera model there are no tracks")
        self.restart()
        return "the tracks begin anew"

    def restart(self) -> None:
        """Forget the tracks, and the dictionary where it was found out; take the model that is known now."""
        self._camera = self._known.camera
        self._tracker = None if self._camera is None else MarkerTracker(self._camera, self._size_m)
        self._dictionary, self._tried, self._blind = self._asked, 0, 0

    def summary(self) -> dict[str, object]:
        """Numbers that were seen, of which dictionary."""
        return {"dictionary": self._dictionary, "ids": sorted(self._ids)}

    def _numbered(self, markers: tuple[Marker, ...]) -> Reading:
        """Without a camera model: where in the image."""
        rows = tuple((one.id, *one.centre.tolist(), one.side_px) for one in markers)
        px = tuple(Column(name, "px", 1) for name in ("x", "y", "side"))
        return Reading(
            _counted(len(markers)),
            "good" if markers else "idle",
            numbers=(Number("markers", float(len(markers)), "", 0),),
            tables=(Table(f"Dictionary {self._dictionary}", (Column("id", "", 0), *px), rows),),
            traces={"markers": float(len(markers))},
            marks=tuple(mark for one in markers for mark in _outlined(one, "good", str(one.id))),
            notes=(NO_MODEL,),
            rows=tuple(
                {"id": one.id, "seen": 1, **_in_image(one)} for one in markers
            ),
        )  # fmt: skip

    def _placed(self, tracked: tuple[TrackedMarker, ...]) -> Reading:
        """With one: where in front of the camera."""
        seen = [one for one in tracked if one.seen]
        open_ones = [one for one in seen if not one.pose.certain]
        columns = (
            Column("id", "", 0), *(Column(axis, "mm", 1) for axis in "xyz"),
            Column("± σ", "mm", 2), Column("tilt", "°", 1), Column("odds"),
        )  # fmt: skip
        notes = [f"{one.id}: two poses fit, odds {_odds(one)}; tilt it, or come nearer" for one in open_ones]
        return Reading(
            _counted(len(seen)) + (f", {len(open_ones)} with two poses" if open_ones else ""),
            "idle" if not seen else "warn" if open_ones else "good",
            numbers=_nearest(seen),
            tables=(Table(f"Dictionary {self._dictionary}", columns, tuple(map(_table_row, tracked))),),
            traces={f"{one.id}: distance, mm": 1e3 * one.pose.modes[0].distance_m for one in seen[:TRACED]},
            marks=tuple(mark for one in seen for mark in self._axes(one)),
            notes=tuple(notes[:3]),
            rows=tuple(map(_csv_row, tracked)),
        )

    def _axes(self, one: TrackedMarker) -> tuple[Mark, ...]:
        """The outline, and the axes of the likelier pose; a pose that is open is amber."""
        assert self._camera is not None  # noqa: S101 - there are no tracks without
        assert one.marker is not None  # noqa: S101 - only those that are seen are drawn
        ends = 0.5 * self._size_m * np.vstack([np.zeros(3), np.eye(3)])
        origin, *tips = project_object(self._camera, one.pose.camera_T_marker, ends)
        roles: tuple[Role, ...] = ("x", "y", "z")
        axes = tuple(Line(np.array([origin, tip]), role) for role, tip in zip(roles, tips, strict=True))
        role: Role = "good" if one.pose.certain else "warn"
        return (*_outlined(one.marker, role, f"{one.id}  {one.pose.modes[0].distance_m:.3f} m"), *axes)


def _outlined(marker: Marker, role: Role, text: str) -> tuple[Mark, ...]:
    """The sides of a marker, its first corner and words."""
    return (
        Line(marker.corners, role, closed=True),
        Dots(marker.corners[:1], role, 4),
        Label(marker.corners.max(axis=0) + np.array([4.0, 14.0]), text, role),
    )


def _counted(count: int) -> str:
    return f"{count} marker{'s' if count > 1 else ''}" if count else "no marker"


def _nearest(seen: list[TrackedMarker]) -> tuple[Number, ...]:
    """How many there are, and the nearest of them."""
    count = Number("markers", float(len(seen)), "", 0)
    if not seen:
        return (count,)
    one = min(seen, key=lambda each: each.pose.modes[0].distance_m)
    mode = one.pose.modes[0]
    return (
        count,
        Number(f"to marker {one.id}", 1e3 * mode.distance_m, "mm", 1, 1e3 * distance_sigma(one)),
        Number("its tilt", float(np.degrees(mode.tilt_rad)), "°", 1),
    )


def distance_sigma(one: TrackedMarker) -> float:
    """Standard deviation of the distance of the likelier pose, m."""
    cov, place = translation_cov(one), one.pose.camera_T_marker[4:]
    sight = place / np.linalg.norm(place)
    return float(np.sqrt(sight @ cov @ sight))


def translation_cov(one: TrackedMarker) -> Array:
    """Covariance (3, 3) of the likelier place in the camera's axes, m²."""
    R = rotation_matrix(one.pose.camera_T_marker[:4])
    return np.asarray(R @ one.pose.cov[3:, 3:] @ R.T)


def _odds(one: TrackedMarker) -> str:
    odds = one.pose.odds
    if odds > TOLD_ODDS:
        return f"> {TOLD_ODDS:.0f} : 1"
    return f"{odds:.1f} : 1" if odds < 10 else f"{odds:.0f} : 1"


def _table_row(one: TrackedMarker) -> tuple[Any, ...]:
    mode = one.pose.modes[0]
    where = (1e3 * mode.camera_T_marker[4:]).tolist()
    sure = _odds(one) if one.seen else "not seen"
    return (one.id, *where, 1e3 * distance_sigma(one), float(np.degrees(mode.tilt_rad)), sure)


def _in_image(marker: Marker) -> dict[str, float]:
    x, y = marker.centre.tolist()
    return {"x_px": x, "y_px": y, "side_px": marker.side_px}


def _csv_row(one: TrackedMarker) -> dict[str, Any]:
    mode, *others = one.pose.modes
    sigmas = np.sqrt(np.diag(translation_cov(one)))
    row: dict[str, Any] = {"id": one.id, "seen": int(one.seen)}
    row |= {} if one.marker is None else _in_image(one.marker)
    row |= _pose(mode.camera_T_marker, "") | dict(zip((f"sigma_{n}" for n in PLACE), sigmas, strict=True))
    row |= {"tilt_deg": float(np.degrees(mode.tilt_rad)), "odds": min(one.pose.odds, MOST_ODDS)}
    return row | (_pose(others[0].camera_T_marker, "other_") if others else {})


def _pose(pose: Array, prefix: str) -> dict[str, float]:
    return {f"{prefix}{name}": float(value) for name, value in zip(POSE, (*pose[4:], *pose[:4]), strict=True)}
