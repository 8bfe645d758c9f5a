"""What is made of the views of a board, in a thread of its own, while the camera goes on."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.live.camera.tasks.known import KnownCamera
from sequential.errors import FactorlabError
from vision3d.boards import Board
from vision3d.views import Missed, View

if TYPE_CHECKING:
    from factorlab.report.document import Verdict
    from vision3d.calibrate import Calibration
    from vision3d.calibrate.coverage import Coverage
    from vision3d.calibrate.next_pose import NextPose

__all__ = ["CalibrationDesk", "Saved", "Standing"]

FEWEST = 3  # views from which a calibration is tried
Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Saved:
    """A calibration that was written.

    Parameters
    ----------
    folder : holds the pictures and the report
    files : what the page offers to save, by name
    verdicts : of the report
    words : for the page
    """

    folder: Path
    files: dict[str, bytes]
    verdicts: tuple[Verdict, ...]
    words: str


@dataclass(frozen=True)
class Standing:
    """What is known at one moment.

    Parameters
    ----------
    views : corners of the pictures that were taken
    calibration, coverage, following : of these views; None before there are enough, or where they fail
    busy : what is being worked on; empty while nothing is
    fault : why the last piece of work failed
    saved : the report, once it was asked for
    """

    views: tuple[View, ...] = ()
    calibration: Calibration | None = None
    coverage: Coverage | None = None
    following: NextPose | None = None
    busy: str = ""
    fault: str = ""
    saved: Saved | None = None


class CalibrationDesk:
    """Takes pictures, and calibrates after each one.

    Every picture that shows the board is on the disk before it counts, so that nothing is lost.

    Parameters
    ----------
    board : what the pictures show
    lens : a name of `vision3d.camera.LENSES`; `auto` is the lens that predicts best, at the end
    folder : reports are made in a folder of their own in it
    command : stands in the report
    known : is told the camera that was saved
    """

    def __init__(
        self, board: Board, lens: str, folder: Path, command: str = "", known: KnownCamera | None = None
    ) -> None:
        self.board, self._lens, self._root, self._command = board, lens, folder, command
        self._known = known or KnownCamera()
        self.now, self.version = Standing(), 0
        self._pictures: list[tuple[str, Picture]] = []
        self._folder: Path | None = None
        self._taken = 0
        self._jobs: queue.Queue[tuple[str, Callable[[], Standing]] | None] = queue.Queue()
        self._thread = threading.Thread(target=self._run, name="calibration", daemon=True)
        self._thread.start()

    def take(self, picture: Picture) -> None:
        """Look for the board in a picture (h, w), and keep it where it is there."""
        self._ask("looking at the view", lambda: self._with(picture))

    def drop(self) -> None:
        """Forget the last view."""
        self._ask("calibrating", self._without_last)

    def clear(self) -> None:
        """Forget every view; what was saved stays on the disk."""
        self._ask("beginning anew", self._anew)

    def finish(self) -> None:
        """Calibrate from the pictures with every check, and write the report."""
        self._ask("calibrating with every check", self._report)

    def close(self) -> None:
        """Finish what was asked for."""
        self._jobs.put(None)
        self._thread.join()

    @property
    def folder(self) -> Path | None:
        """Where the pictures are; None before the first."""
        return self._folder

    def _say(self, standing: Standing) -> None:
        self.now, self.version = standing, self.version + 1

    def _ask(self, what: str, job: Callable[[], Standing]) -> None:
        self._say(replace(self.now, busy=what))
        self._jobs.put((what, job))

    def _run(self) -> None:
        while (asked := self._jobs.get()) is not None:
            what, job = asked
            self._say(replace(self.now, busy=what))
            try:
                done = job()
            except (FactorlabError, OSError) as fault:
                done = replace(self.now, fault=str(fault))
            except Exception as fault:  # noqa: BLE001 - told on the page; the next view is tried
                done = replace(self.now, fault=f"{what} failed: {type(fault).__name__}: {fault}")
            self._say(replace(done, busy="" if self._jobs.empty() else self.now.busy))

    def _with(self, picture: Picture) -> Standing:
        from vision3d.calibrate.detection import detect_view

        name = f"view{self._taken + 1:03d}"
        found = detect_view(name, picture, self.board)
        if isinstance(found, Missed):
            return replace(self.now, fault=f"the view was not kept: {found.reason}")
        self._write(name, picture)
        self._taken += 1
        self._pictures.append((f"{name}.png", picture))
        return self._fitted((*self.now.views, found[0]))

    def _write(self, name: str, picture: Picture) -> None:
        import cv2

        if self._folder is None:
            stamp = datetime.now().astimezone().strftime("%Y%m%d-%H%M%S")
            self._folder = self._root / f"{stamp}-calibration"
            (self._folder / "pictures").mkdir(parents=True)
        (self._folder / "pictures" / f"{name}.png").write_bytes(cv2.imencode(".png", picture)[1].tobytes())

    def _without_last(self) -> Standing:
        if self._folder is None or not self._pictures:
            return replace(self.now, fault="there is no view to drop")
        name, _ = self._pictures.pop()
        (self._folder / "pictures" / name).unlink(missing_ok=True)
        return self._fitted(self.now.views[:-1])

    def _anew(self) -> Standing:
        self._pictures.clear()
        self._folder, self._taken = None, 0
        return Standing()

    def _fitted(self, views: tuple[View, ...]) -> Standing:
        """The views with what a quick calibration says of them; the checks wait until the end."""
        from vision3d.calibrate import calibrate
        from vision3d.calibrate.coverage import coverage
        from vision3d.calibrate.next_pose import next_pose

        standing = Standing(views)
        if len(views) < FEWEST:
            return standing
        try:
            fit = calibrate(views, "brown5" if self._lens == "auto" else self._lens)
            standing = replace(standing, calibration=fit, coverage=coverage(fit))
            return replace(standing, following=next_pose(fit, self.board))
        except FactorlabError as fault:
            return replace(standing, fault=str(fault))

    def _report(self) -> Standing:
        from factorlab.camera import (
            CameraSettings,
            calibrate_held,
            camera_document,
            export_files,
            held_pictures,
        )
        from factorlab.report.document import write_document

        if self._folder is None or len(self._pictures) < FEWEST:
            return replace(self.now, fault=f"a calibration takes {FEWEST} views at least")
        done = calibrate_held(
            held_pictures(self._pictures), CameraSettings(board=self.board, lens=self._lens)
        )
        document, files = camera_document(done, self._command), export_files(done)
        page = write_document(document, self._folder / "report", force=True, files=files)
        offered = {name: text if isinstance(text, bytes) else text.encode() for name, text in files.items()}
        fit = done.calibration
        self._known.camera = fit.camera
        words = (
            f"saved to {self._folder}: {fit.camera.lens}, RMS {fit.rms_px:.3f} px, "
            f"fx {fit.camera.intrinsics[0]:.2f} ± {fit.std[0]:.2f} px"
        )
        saved = Saved(
            self._folder, {"report.html": page.read_bytes(), **offered}, tuple(document.verdicts), words
        )
        return replace(self.now, saved=saved, fault="")
