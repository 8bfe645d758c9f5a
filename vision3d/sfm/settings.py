"""What a reconstruction is asked for."""

from __future__ import annotations

from dataclasses import dataclass

from sequential.errors import ModelError
from vision3d.camera import Camera

__all__ = ["LENS_MODELS", "MAPPERS", "SfmSettings"]

MAPPERS = ("incremental", "global", "own")
LENS_MODELS = {
    "auto": "SIMPLE_RADIAL",
    "pinhole": "SIMPLE_PINHOLE",
    "brown1": "SIMPLE_RADIAL",
    "brown2": "RADIAL",
    "brown4": "OPENCV",
    "fisheye4": "OPENCV_FISHEYE",
}
"""By the lens to calibrate: COLMAP's model to map with, with one focal length where it has such a one."""


@dataclass(frozen=True)
class SfmSettings:
    """How pictures become a reconstruction.

    Parameters
    ----------
    camera : known intrinsics, which are kept; None: every camera is calibrated from the pictures
    lens : of a camera that is calibrated: one of `LENS_MODELS`; "auto" begins with one radial coefficient and
        takes a second one where the residuals ask for it
    sharing : which pictures have one camera: "auto" goes by size and by what EXIF says of camera and zoom,
        "one" by size only, "each" gives every picture its own
    mapper : "incremental" grows from two views, "global" solves for all at once; "own" grows
        with the solvers of this package instead of COLMAP's
    max_size : features are sought in pictures reduced to this longer side, px
    max_features : kept of each picture, the largest first
    seed : of everything that draws at random
    threads : 0: as many as there are processors

    Raises
    ------
    ModelError
        for names and numbers that mean nothing.
    """

    camera: Camera | None = None
    lens: str = "auto"
    sharing: str = "auto"
    mapper: str = "incremental"
    max_size: int = 1600
    max_features: int = 8192
    seed: int = 0
    threads: int = 0

    def __post_init__(self) -> None:
        choices = {
            "mapper": (self.mapper, MAPPERS),
            "lens": (self.lens, tuple(LENS_MODELS)),
            "sharing": (self.sharing, ("auto", "one", "each")),
        }
        for name, (value, allowed) in choices.items():
            if value not in allowed:
                raise ModelError(f"no {name} {value!r} here; choose one of {', '.join(allowed)}")
        if self.max_size < 64 or self.max_features < 100:
            raise ModelError(
                f"max_size is at least 64 px and max_features at least 100, got {self.max_size} px and "
                f"{self.max_features}"
            )
