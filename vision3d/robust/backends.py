"""OpenCV's and PoseLib's robust searches, behind the project's settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, SolverError, ToolMissingError
from vision3d.robust.settings import RansacSettings

__all__ = ["Outside", "poselib_options", "search_outside", "seed_of", "the_poselib"]

Array = NDArray[np.float64]
NOT_SAID = "not said"


@dataclass(frozen=True, slots=True, eq=False)
class Outside:
    """What a search outside of this project found: a model (3, 3) in the unit of the data."""

    model: Array
    iterations: int
    stopped: str
    backend: str


def search_outside(
    kind: str, a: Array, b: Array, settings: RansacSettings, rng: np.random.Generator | None
) -> Outside:
    """Let a backend look for the "homography" or "fundamental" matrix of matches a, b (N, 2).

    Raises
    ------
    ToolMissingError
        where PoseLib is asked for and not installed.
    SolverError
        where the backend finds nothing.
    """
    work: dict[tuple[str, str], Callable[..., Outside]] = {
        ("opencv", "homography"): _opencv_homography,
        ("opencv", "fundamental"): _opencv_fundamental,
        ("poselib", "homography"): _poselib_homography,
        ("poselib", "fundamental"): _poselib_fundamental,
    }
    if (settings.backend, kind) not in work:
        raise ModelError(f"the backend {settings.backend} has no {kind}; take backend='own'")
    found = work[settings.backend, kind](a, b, settings, seed_of(rng))
    if not np.isfinite(found.model).all():
        raise SolverError(f"{found.backend} found no {kind} among {len(a)} matches; try backend='own'")
    return found


def seed_of(rng: np.random.Generator | None) -> int:
    """A seed that libraries take: below 2³¹."""
    return 0 if rng is None else int(rng.integers(1 << 31))


def opencv_method(settings: RansacSettings) -> tuple[int, str]:
    """OpenCV's number and name of the method: `lmeds` and PROSAC's order choose those that do it."""
    import cv2

    name = settings.opencv_method
    if name == "RANSAC" and settings.method == "lmeds":
        name = "LMEDS"
    if name == "RANSAC" and settings.order == "prosac":
        name = "USAC_PROSAC"
    return int(getattr(cv2, name)), name


def _order(name: str, settings: RansacSettings, count: int, seed: int) -> NDArray[np.int64]:
    """The order in which a method shall see the rows.

    RHO and USAC_PROSAC take them for best first; where they are not said to be, chance is fairer than the
    order they came in.
    """
    if name in {"RHO", "USAC_PROSAC"} and settings.order != "prosac":
        return np.random.default_rng(seed).permutation(count)
    return np.arange(count)


def _opencv_homography(a: Array, b: Array, settings: RansacSettings, seed: int) -> Outside:
    import cv2

    method, name = opencv_method(settings)
    cv2.setRNGSeed(seed)
    order = _order(name, settings, len(a), seed)
    H, _ = cv2.findHomography(
        a[order],
        b[order],
        method,
        settings.threshold,
        maxIters=settings.max_iterations,
        confidence=settings.confidence,
    )
    return _said(H, name)


def _opencv_fundamental(a: Array, b: Array, settings: RansacSettings, seed: int) -> Outside:
    import cv2

    method, name = opencv_method(settings)
    if name == "RHO":
        raise ModelError("OpenCV's RHO knows homographies only; take another opencv_method")
    cv2.setRNGSeed(seed)
    order = _order(name, settings, len(a), seed)
    F, _ = cv2.findFundamentalMat(
        a[order], b[order], method, settings.threshold, settings.confidence, settings.max_iterations
    )
    return _said(None if F is None else F[:3], name)


def _said(model: Any, name: str) -> Outside:
    found = np.full((3, 3), np.nan) if model is None else np.asarray(model, dtype=np.float64)
    return Outside(found, -1, NOT_SAID, f"opencv {name}")


def the_poselib() -> Any:
    """PoseLib.

    Raises
    ------
    ToolMissingError
        where it is not installed.
    """
    try:
        import poselib
    except ImportError as missing:
        raise ToolMissingError(
            "backend='poselib' needs PoseLib, which is not installed: pip install 'factorlab[poselib]', "
            "or take backend='own'"
        ) from missing
    return poselib


def poselib_options(settings: RansacSettings, seed: int, threshold: str) -> dict[str, Any]:
    """PoseLib's options; `threshold` is the name of the one that holds it."""
    return {
        threshold: settings.threshold,
        "max_iterations": settings.max_iterations,
        "success_prob": settings.confidence,
        "progressive_sampling": settings.order == "prosac",
        "seed": seed,
    }


def _poselib_homography(a: Array, b: Array, settings: RansacSettings, seed: int) -> Outside:
    options = poselib_options(settings, seed, "max_reproj_error")
    return _poselib_said(*the_poselib().estimate_homography(a, b, options))


def _poselib_fundamental(a: Array, b: Array, settings: RansacSettings, seed: int) -> Outside:
    options = poselib_options(settings, seed, "max_epipolar_error")
    return _poselib_said(*the_poselib().estimate_fundamental(a, b, options))


def _poselib_said(model: Any, told: dict[str, Any]) -> Outside:
    tried = int(told["iterations"])
    return Outside(np.asarray(model, dtype=np.float64), tried, NOT_SAID, "poselib")
