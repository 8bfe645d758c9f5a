"""The model of the camera, which a calibration of the same session replaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["KnownCamera"]


@dataclass
class KnownCamera:
    """What the tasks of one session know of its camera; None: nothing yet."""

    camera: Camera | None = None
