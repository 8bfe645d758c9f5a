"""Corners that are found, followed from frame to frame, and lost."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from factorlab.live.camera.reading import Column, Dots, Line, Number, Reading, Table
from factorlab.live.camera.task import Action, Task
from sequential.errors import DataError
from vision3d.frames import Frame

__all__ = ["DETECTORS", "FeaturesTask"]

DETECTORS = {"fast": "FAST", "orb": "ORB", "harris": "Harris"}
MOST = 300
BACK_PX = 0.7  # a corner that does not find back to where it came from is lost
APART_PX = 10
WINDOW = (17, 17)
TAIL = 12  # frames that a corner's tail goes back
AGES = (1, 5, 15, 30, 90)


class FeaturesTask(Task):
    """Corners of one detector, followed by Lucas and Kanade's method in a pyramid, forwards and back.

    Parameters
    ----------
    detector : `fast`, `orb` or `harris`
    """

    name: ClassVar = "features"
    columns: ClassVar = ("id", "x_px", "y_px", "age")

    def __init__(self, detector: str = "fast") -> None:
        self.act(detector)

    @property
    def actions(self) -> tuple[Action, ...]:
        """One button a detector."""
        return tuple((name, title) for name, title in DETECTORS.items() if name != self._detector)

    def act(self, action: str) -> str:
        """Change the detector."""
        if action not in DETECTORS:
            raise DataError(f"there is no detector {action!r}, only {', '.join(DETECTORS)}")
        self._detector = action
        self.restart()
        return f"corners by {DETECTORS[action]}"

    def restart(self) -> None:
        """Forget every corner."""
        self._grey: NDArray[np.uint8] | None = None
        self._points = np.empty((0, 2), np.float32)
        self._ids, self._ages = np.empty(0, np.int64), np.empty(0, np.int64)
        self._tails = np.empty((0, TAIL, 2), np.float32)
        self._next, self._t_ns = 0, 0

    def read(self, frame: Frame) -> Reading:
        """Follow what there is, then fill up."""
        before, points, detector = self._grey, self._points, self._detector
        kept, moved = np.ones(len(points), bool), points
        if before is not None and len(points):
            moved, kept = followed(before, frame.grey, points)
        steps = np.linalg.norm(moved - points, axis=1)[kept]
        dt = (frame.t_ns - self._t_ns) * 1e-9
        lost = int((~kept).sum())
        self._keep(moved, kept)
        fresh = detect(frame.grey, detector, self._points, MOST - len(self._points))
        self._add(fresh)
        self._grey, self._t_ns = frame.grey, frame.t_ns
        motion = float(np.median(steps)) if len(steps) else None
        return self._reading(motion, dt, int(kept.sum()), lost, len(fresh))

    def _keep(self, moved: NDArray[np.float32], kept: NDArray[np.bool_]) -> None:
        self._points, self._ids, self._ages = moved[kept], self._ids[kept], self._ages[kept] + 1
        tails = np.roll(self._tails[kept], 1, axis=1)
        tails[:, 0] = self._points
        self._tails = tails

    def _add(self, fresh: NDArray[np.float32]) -> None:
        count = len(fresh)
        self._points = np.concatenate([self._points, fresh])
        self._ids = np.concatenate([self._ids, np.arange(self._next, self._next + count)])
        self._ages = np.concatenate([self._ages, np.zeros(count, np.int64)])
        self._tails = np.concatenate([self._tails, np.repeat(fresh[:, None], TAIL, axis=1)])
        self._next += count

    def _reading(self, motion: float | None, dt: float, kept: int, lost: int, fresh: int) -> Reading:
        old = self._ages >= AGES[1]
        points = self._points.astype(np.float64)
        lengths = np.minimum(self._ages[old], TAIL - 1) + 1
        tails = [
            Line(tail[:length].astype(float), "accent", width=1)
            for tail, length in zip(self._tails[old], lengths, strict=True)
        ]
        followed_share = 100.0 * kept / (kept + lost) if kept + lost else None
        rows = tuple((f"{low} or more", int((self._ages >= low).sum())) for low in AGES)
        return Reading(
            f"{len(self._points)} corners",
            "good" if len(self._points) >= 20 else "warn" if len(self._points) else "idle",
            numbers=(
                Number("followed", followed_share, "%", 1),
                Number("median motion", motion, "px", 2),
                Number("speed", motion / dt if motion is not None and dt > 0 else None, "px/s", 0),
                Number("new", fresh, "", 0),
                Number("lost", lost, "", 0),
            ),
            tables=(Table("Age of the corners", (Column("frames"), Column("corners", "", 0)), rows),),
            traces={"motion px": motion, "corners": float(len(self._points))},
            marks=(*tails, Dots(points[~old], "warn", 2), Dots(points[old], "good", 2)),
            notes=() if len(self._points) else ("Nothing here has corners: show it texture, or more light.",),
            rows=tuple(
                {"id": int(k), "x_px": float(x), "y_px": float(y), "age": int(age)}
                for k, (x, y), age in zip(self._ids, self._points, self._ages, strict=True)
            ),
        )  # fmt: skip


def followed(
    before: NDArray[np.uint8], after: NDArray[np.uint8], points: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Where points (N, 2) of one image are in the next, and which of them find back."""
    import cv2

    flow: Any = cv2.calcOpticalFlowPyrLK
    there, good, _ = flow(before, after, points.reshape(-1, 1, 2), None, winSize=WINDOW, maxLevel=3)
    back, good_back, _ = flow(after, before, there, None, winSize=WINDOW, maxLevel=3)
    moved = np.asarray(there).reshape(-1, 2)
    error = np.linalg.norm(np.asarray(back).reshape(-1, 2) - points, axis=1)
    inside = ((moved >= 0) & (moved <= np.array(after.shape[::-1]) - 1)).all(axis=1)
    both = np.asarray(good).ravel().astype(bool) & np.asarray(good_back).ravel().astype(bool)
    return moved, both & inside & (error < BACK_PX)


def detect(
    grey: NDArray[np.uint8], detector: str, taken: NDArray[np.float32], count: int
) -> NDArray[np.float32]:
    """The strongest corners (N, 2) px, N <= count, apart from each other and from `taken`."""
    import cv2

    if count <= 0:
        return np.empty((0, 2), np.float32)
    free = np.full(grey.shape, 255, np.uint8)
    for x, y in np.round(taken).astype(int).tolist():
        cv2.circle(free, (x, y), APART_PX, 0, -1)
    if detector == "harris":
        found: Any = cv2.goodFeaturesToTrack(
            grey, count, 0.005, APART_PX, mask=free, blockSize=5, useHarrisDetector=True, k=0.04
        )
        return np.empty((0, 2), np.float32) if found is None else np.asarray(found, np.float32).reshape(-1, 2)
    maker: Any = cv2.FastFeatureDetector.create(20) if detector == "fast" else cv2.ORB.create(4 * MOST)
    chosen = []
    for one in sorted(maker.detect(grey, free), key=lambda one: -one.response):
        x, y = one.pt
        if free[round(y), round(x)]:
            chosen.append((x, y))
            cv2.circle(free, (round(x), round(y)), APART_PX, 0, -1)
            if len(chosen) == count:
                break
    return np.array(chosen, np.float32).reshape(-1, 2)
