"""Views of a board, taken where it is held still in a new pose; and the camera that they give."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from factorlab.live.camera.reading import Column, Dots, Line, Mark, Number, Reading, State, Table
from factorlab.live.camera.task import Action, Task
from factorlab.live.camera.tasks.board_watch import BoardWatch, SeenBoard
from factorlab.live.camera.tasks.desk import FEWEST, CalibrationDesk, Standing
from factorlab.live.camera.tasks.known import KnownCamera
from sequential.errors import DataError
from vision3d.boards import Board
from vision3d.frames import Frame

__all__ = ["CalibrateTask"]

PATIENCE = 60  # frames without the board, after which the page says what may be wrong
MOST = 40  # views
ACTIONS = (
    ("finish", "Calibrate and save"),
    ("take", "Take this view"),
    ("drop", "Drop the last view"),
    ("clear", "Begin anew"),
)


class CalibrateTask(Task):
    """Watches a board, takes views of it, and says how to hold it next.

    Parameters
    ----------
    board : what is held before the camera
    lens : a name of `vision3d.camera.LENSES`, or `auto`
    folder : calibrations are saved in folders of their own in it
    command : stands in the report
    known : is told the camera that was saved
    """

    name: ClassVar = "calibrate"
    columns: ClassVar = ("corners", "speed_px_s", "views", "rms_px", "fx_px", "fx_sigma_px")

    def __init__(
        self, board: Board, lens: str, folder: Path, command: str = "", known: KnownCamera | None = None
    ) -> None:
        self.desk = CalibrationDesk(board, lens, folder, command, known)
        self._watch = BoardWatch(board)
        self._kept: list[SeenBoard] = []
        self._frame: Frame | None = None
        self._blind = 0

    @property
    def version(self) -> int:
        """Changes with what the desk has done."""
        return self.desk.version

    @property
    def actions(self) -> tuple[Action, ...]:
        """What can be done with the views so far."""
        views = len(self.desk.now.views)
        return tuple(one for one in ACTIONS if views >= {"finish": FEWEST, "take": 0}.get(one[0], 1))

    def prepare(self) -> None:
        """Load and compile what calibrates, by a picture without a board."""
        from vision3d.calibrate import calibrate
        from vision3d.calibrate.detection import detect_view
        from vision3d.kernels import adjustment, saddles

        detect_view("nothing", np.zeros((64, 64), np.uint8), self.desk.board)
        self._compiled = calibrate, adjustment, saddles

    def read(self, frame: Frame) -> Reading:
        """Where the board is; takes a view where it rests in a pose that is new."""
        fresh, self._frame = frame is not self._frame, frame
        seen = self._watch.look(frame)
        standing, width = self.desk.now, frame.image.shape[1]
        self._blind = 0 if seen else self._blind + fresh
        new = seen is not None and self._watch.is_new(seen, self._kept, width)
        if seen is not None and seen.still and new and len(self._kept) < MOST:
            self._take(frame, seen)
            standing = self.desk.now
        headline, state = self._headline(seen, new=new)
        return Reading(
            headline,
            state,
            numbers=_numbers(standing),
            tables=_tables(standing),
            traces={"RMS, px": standing.calibration.rms_px} if standing.calibration else {},
            marks=_marks(seen, standing),
            notes=self._notes(standing),
            rows=(self._row(seen, standing),),
            panel=_panel(standing, frame),
        )

    def act(self, action: str) -> str:
        """Take, drop, forget or calibrate."""
        match action:
            case "take":
                if self._frame is None:
                    raise DataError("there is no frame yet")
                self._take(self._frame, self._watch.look(self._frame))
                return ""
            case "drop":
                self.desk.drop()
                del self._kept[-1:]
                return "the last view is dropped"
            case "clear":
                self.desk.clear()
                self._kept.clear()
                return "views are forgotten; what was saved stays"
            case "finish":
                self.desk.finish()
                return ""
        return super().act(action)

    def file(self, name: str) -> bytes | None:
        """A file of the last report."""
        saved = self.desk.now.saved
        return None if saved is None else saved.files.get(name)

    def restart(self) -> None:
        """A source that begins anew keeps the views."""
        self._watch.forget()

    def summary(self) -> dict[str, object]:
        """Views, and what was saved."""
        standing = self.desk.now
        fit = standing.calibration
        return {
            "views": len(standing.views),
            "rms_px": None if fit is None else fit.rms_px,
            "intrinsics": None if fit is None else fit.camera.intrinsics,
            "pictures": None if self.desk.folder is None else str(self.desk.folder / "pictures"),
            "saved": None if standing.saved is None else str(standing.saved.folder),
            "fault": standing.fault,
        }

    def close(self) -> None:
        """Finish what the desk works on."""
        self.desk.close()

    def _take(self, frame: Frame, seen: SeenBoard | None) -> None:
        if seen is not None:
            self._kept.append(seen)
        self.desk.take(np.asarray(frame.grey))

    def _headline(self, seen: SeenBoard | None, *, new: bool) -> tuple[str, State]:
        if seen is None:
            return f"looking for a {self.desk.board.name}", "idle"
        if not seen.still:
            return ("hold the board still" if new else "move the board to another pose"), "warn"
        return ("taking this view", "good") if new else ("this pose is taken: move the board", "good")

    def _notes(self, standing: Standing) -> tuple[str, ...]:
        notes = [standing.busy + " …"] if standing.busy else []
        if standing.saved is not None:
            notes.append(standing.saved.words)
        if standing.fault:
            notes.append(standing.fault)
        if self._blind > PATIENCE:
            notes.append("the whole board has to be in the picture, sharp and evenly lit; is --board right?")
        if standing.following is not None:
            following = standing.following
            before, after = following.std_before_px, following.std_after_px
            notes.append(f"next: {following.words}, as outlined: 1 σ from {before:.3f} to {after:.3f} px")
        elif len(standing.views) < FEWEST:
            missing = FEWEST - len(standing.views)
            notes.append(f"{missing} more view{'s' if missing > 1 else ''} until a first calibration")
        if standing.coverage is not None:
            notes.extend(standing.coverage.advice[:2])
        return tuple(notes)

    def _row(self, seen: SeenBoard | None, standing: Standing) -> dict[str, Any]:
        fit = standing.calibration
        return {
            "corners": 0 if seen is None else len(seen.ids),
            "speed_px_s": None if seen is None else seen.speed_px_s,
            "views": len(standing.views),
            "rms_px": None if fit is None else fit.rms_px,
            "fx_px": None if fit is None else float(fit.camera.intrinsics[0]),
            "fx_sigma_px": None if fit is None else float(fit.std[0]),
        }


def _numbers(standing: Standing) -> tuple[Number, ...]:
    views = Number("views", float(len(standing.views)), "", 0)
    if (fit := standing.calibration) is None:
        return (views,)
    names = ("fx", "fy", "cx", "cy")
    values = (
        Number(name, float(fit.camera.intrinsics[k]), "px", 2, float(fit.std[k]))
        for k, name in enumerate(names)
    )
    following = standing.following
    sure = () if following is None else (Number("projection, 1 σ", following.std_before_px, "px", 3),)
    return (views, Number("RMS", fit.rms_px, "px", 3), *sure, *values)


def _tables(standing: Standing) -> tuple[Table, ...]:
    tables = []
    if standing.saved is not None:
        from factorlab.report.words import number

        columns = (Column("metric"), Column("value"), Column("verdict"))
        verdicts = tuple(
            (one.metric, f"{number(one.value)} {one.unit}".strip(), one.verdict)
            for one in standing.saved.verdicts
        )
        tables.append(Table("The report's verdicts", columns, verdicts))
    if standing.calibration is not None:
        fit = standing.calibration
        doubtful = set(fit.outlier_views)
        rows = tuple(
            (view.name, float(rms), "fits badly" if k in doubtful else "")
            for k, (view, rms) in enumerate(zip(fit.views, fit.view_rms, strict=True))
        )
        tables.append(Table("Views", (Column("view"), Column("RMS", "px", 3), Column("")), rows))
    return tuple(tables)


def _marks(seen: SeenBoard | None, standing: Standing) -> tuple[Mark, ...]:
    marks: list[Mark] = []
    if standing.following is not None:
        marks.append(Line(standing.following.outline_px, "accent", closed=True, width=2))
    if seen is not None:
        marks.append(Dots(seen.pixels, "good" if seen.still else "warn", 3))
    return tuple(marks)


def _panel(standing: Standing, frame: Frame) -> dict[str, Any]:
    panel: dict[str, Any] = {}
    if standing.views:
        height, width = frame.image.shape[:2]
        cover, following = standing.coverage, standing.following
        panel["coverage"] = {
            "size": [width, height],
            "cells": [[0]] if cover is None else cover.counts,
            "views": [np.round(hull(view.pixels), 1) for view in standing.views],
            "next": None if following is None else np.round(following.outline_px, 1),
        }
    if standing.coverage is not None:
        bars = standing.coverage.bars.items()
        panel["meters"] = [
            {"name": name, "share": share, "text": f"{100 * share:.0f} %"} for name, share in bars
        ]
    if standing.saved is not None:
        panel["files"] = list(standing.saved.files)
    return panel


def hull(pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners (M, 2) of the convex hull of points (N, 2)."""
    import cv2

    corners: Any = cv2.convexHull(np.asarray(pixels, np.float32))
    return np.asarray(corners, np.float64).reshape(-1, 2)
