"""Run structure from motion on pictures, and keep whatever came of it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vision3d.sfm import NoModelError, Reconstruction, SfmSettings, ViewGraph, reconstruct

if TYPE_CHECKING:
    from factorlab.graph.bundle import BundleResult
    from vision3d.sfm.view_graph import Loops

__all__ = ["SfmDone", "SfmJob", "run_sfm"]

MOST_OBSERVATIONS = 200_000  # that our own adjustment takes on unasked


@dataclass(frozen=True)
class SfmJob:
    """What is asked for.

    Parameters
    ----------
    settings : of the reconstruction; a camera from a file is put in when it is read
    camera : its file; None: the pictures calibrate it
    which : camera in that file, where there are several
    refine : adjust once more with our own bundle adjustment, which says how sure everything is
    """

    settings: SfmSettings = field(default_factory=SfmSettings)
    camera: Path | None = None
    which: str | None = None
    refine: bool = True


@dataclass(frozen=True, eq=False)
class SfmDone:
    """What came of it.

    Parameters
    ----------
    sources : as they were named
    job : with the camera that was read
    found : the model; None where there is none
    fault : why there is none, one sentence
    missing : (name, reason) of pictures without a place
    graph : which pictures were matched with which
    seconds : the whole took
    stopped : it was ended early
    adjusted : our bundle adjustment of the model, with covariances; where it converged, `found` is its model
    unadjusted : why there is none, or what is wrong with it
    """

    sources: tuple[str, ...]
    job: SfmJob
    found: Reconstruction | None
    fault: str
    missing: tuple[tuple[str, str], ...]
    graph: ViewGraph | None
    seconds: float
    stopped: bool = False
    adjusted: BundleResult | None = None
    unadjusted: str = ""

    @property
    def given(self) -> int:
        """Number of pictures that were named."""
        return len(self.missing) + (0 if self.found is None else len(self.found))

    @cached_property
    def loops(self) -> Loops | None:
        """Rotations round triangles of pairs."""
        return None if self.graph is None else self.graph.loops()

    @cached_property
    def angles_rad(self) -> NDArray[np.float64]:
        """(P,) largest triangulation angle of every point."""
        from vision3d.sfm.geometry import triangulation_angles

        return np.zeros(0) if self.found is None else triangulation_angles(self.found)


def run_sfm(
    sources: Sequence[str],
    job: SfmJob,
    *,
    work: Path | None = None,
    stop: threading.Event | None = None,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> SfmDone:
    """Reconstruct; that there is no model is a result too, which says why.

    Raises
    ------
    DataError
        where the pictures or the camera's file cannot be read.
    Stopped
        where the work was ended before there was a model.
    """
    began = time.perf_counter()
    if job.camera is not None:
        from vision3d.camera_files.reading import read_camera

        camera = read_camera(job.camera, which=job.which)
        job = replace(job, settings=replace(job.settings, camera=camera))
    found, fault, graph = None, "", None
    missing: tuple[tuple[str, str], ...] = ()
    try:
        found = reconstruct(sources, job.settings, work=work, stop=stop, progress=progress)
        graph, missing = found.graph, found.missing
    except NoModelError as error:
        fault, graph, missing = str(error), error.graph, error.missing
    stopped = stop is not None and stop.is_set()
    result, why = None, ""
    if found is not None and job.refine and not stopped:
        progress("adjusting", 0, 1)
        found, result, why = _adjusted(found, job)
    seconds = time.perf_counter() - began
    return SfmDone(tuple(sources), job, found, fault, missing, graph, seconds, stopped, result, why)


def _adjusted(found: Reconstruction, job: SfmJob) -> tuple[Reconstruction, BundleResult | None, str]:
    """The model after our own adjustment with the loss that COLMAP ended with; or why it is COLMAP's."""
    from factorlab.graph.bundle import bundle_adjust
    from sequential.errors import FactorlabError
    from vision3d.sfm.settling import soft_scale

    if len(found.pixels) > MOST_OBSERVATIONS:
        return found, None, f"{len(found.pixels)} observations are more than {MOST_OBSERVATIONS}"
    result, fault = None, ""
    for gauge in ("centres", "points"):  # centres on a line, as two are, hold no gauge of their own
        try:
            result = bundle_adjust(
                found, refine_intrinsics=job.settings.camera is None, loss="soft_l1",
                loss_px=soft_scale(found), gauge=gauge,
            )  # fmt: skip
            break
        except FactorlabError as error:
            fault = fault or str(error)
    if result is None:
        return found, None, fault
    if result.converged:
        return result.reconstruction, result, ""
    return (
        found,
        result,
        f"not settled after {result.iterations} steps: the pictures leave something almost free",
    )
