"""What `factorlab match` is asked, and what its words mean to the robust search."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sequential.errors import ModelError

if TYPE_CHECKING:
    from vision3d.robust import RansacSettings

__all__ = ["METHODS", "MODELS", "MatchSettings"]

MODELS = ("auto", "homography", "fundamental", "essential")
METHODS: dict[str, dict[str, Any]] = {
    "ransac": {},
    "prosac": {"order": "prosac"},
    "lmeds": {"method": "lmeds"},
    "opencv": {"backend": "opencv"},
    "rho": {"backend": "opencv", "opencv_method": "RHO", "order": "prosac"},
    "usac": {"backend": "opencv", "opencv_method": "USAC_DEFAULT"},
    "usac_fast": {"backend": "opencv", "opencv_method": "USAC_FAST"},
    "usac_accurate": {"backend": "opencv", "opencv_method": "USAC_ACCURATE"},
    "usac_prosac": {"backend": "opencv", "opencv_method": "USAC_PROSAC", "order": "prosac"},
    "usac_magsac": {"backend": "opencv", "opencv_method": "USAC_MAGSAC"},
    "poselib": {"backend": "poselib"},
}
"""Names on the command line, and what they are among the settings of a robust fit."""


@dataclass(frozen=True)
class MatchSettings:
    """What is asked for.

    Parameters
    ----------
    features : a kind of `vision3d.features.KINDS`
    model : "homography" for planes and a camera that turns, "fundamental" for scenes with depth,
        "essential" where cameras are known, "auto" for whichever of the first two the pictures show
    method : a name in `METHODS`
    threshold_px : largest error of a match that agrees
    ratio : of Lowe's test
    count : features of a picture at most
    max_size : longer side of a picture in which features are sought, px
    camera, camera_b : files of the cameras; the second is the first's where it is None
    seed : of the search
    """

    features: str = "sift"
    model: str = "auto"
    method: str = "ransac"
    threshold_px: float = 3.0
    ratio: float = 0.8
    count: int = 4000
    max_size: int = 2000
    camera: Path | None = None
    camera_b: Path | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        """Meet what cannot be meant.

        Raises
        ------
        ModelError
            for unknown words, a threshold that is not positive, an essential matrix without a camera.
        """
        for name, known in (("model", MODELS), ("method", tuple(METHODS))):
            if getattr(self, name) not in known:
                raise ModelError(f"{name} is one of {', '.join(known)}; got {getattr(self, name)!r}")
        if not self.threshold_px > 0.0:
            raise ModelError(f"the threshold is a number of pixels above 0, got {self.threshold_px}")
        if self.model == "essential" and self.camera is None:
            raise ModelError(
                "an essential matrix needs the camera: give --camera FILE, or --model fundamental"
            )
        if self.model == "essential" and self.method != "ransac":
            raise ModelError(f"an essential matrix is sought by the method ransac, not by {self.method}")

    def robust(self, threshold_px: float | None = None) -> RansacSettings:
        """The settings of the robust fit."""
        from vision3d.robust import RansacSettings

        threshold = self.threshold_px if threshold_px is None else threshold_px
        return RansacSettings(threshold=threshold, **METHODS[self.method])
