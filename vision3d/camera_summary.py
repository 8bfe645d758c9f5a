"""What a camera is like, in quantities that a person knows: angles of view, and how far its lens bends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision3d.camera import Array, Camera
from vision3d.folding import Fold
from vision3d.lenses import LENSES

__all__ = ["CameraSummary", "summarise"]


@dataclass(frozen=True, slots=True)
class CameraSummary:
    """A camera in a few numbers.

    Parameters
    ----------
    camera : that they are of
    across_rad, down_rad, corner_rad : angle of view through the principal point from side to side, from top
        to bottom, and between the corners that see furthest; NaN where the lens has no ray there
    bend_px : how far the distortion moves a corner of the image, at most; NaN where it has none to compare
    off_centre_px : (2,) principal point minus the middle of the image
    pixel_rad : angle between neighbouring pixels in the middle
    fold : where the distortion ceases to be one-to-one
    """

    camera: Camera
    across_rad: float
    down_rad: float
    corner_rad: float
    bend_px: float
    off_centre_px: Array
    pixel_rad: float
    fold: Fold

    def lines(self) -> list[str]:
        """Some lines of text."""
        camera, (width, height) = self.camera, self.camera.size
        pairs = zip(camera.names, camera.parameters.tolist(), strict=True)
        values = [f"{name} {value:.6g}" for name, value in pairs]
        said = [
            f"{LENSES[camera.lens].title} ({camera.lens}), {width}x{height} px",
            "  ".join(values[:4]) + " px",
            *(["  ".join(values[4:])] if len(values) > 4 else []),
            self._view(),
            self._middle(),
        ]
        if len(camera.distortion):
            if np.isfinite(self.bend_px):
                said.append(f"the distortion moves the corners by up to {self.bend_px:.1f} px")
            said.append(str(self.fold))
        return said

    def _view(self) -> str:
        corners = f"{_degrees(self.corner_rad)} between corners"
        if not np.isfinite(self.corner_rad):
            corners = "and some corners have no ray"
        sides = f"sees {_degrees(self.across_rad)} across, {_degrees(self.down_rad)} down"
        return f"{sides}, {corners}; a pixel in the middle is {np.degrees(self.pixel_rad):.3f}°"

    def _middle(self) -> str:
        right, below = self.off_centre_px.tolist()
        side, height = "right" if right >= 0.0 else "left", "below" if below >= 0.0 else "above"
        place = f"{abs(right):.1f} px {side} of and {abs(below):.1f} px {height} the middle"
        return f"its axis meets the image {place}"


def summarise(camera: Camera) -> CameraSummary:
    """Describe a camera."""
    width, height = camera.size
    _, _, cx, cy = camera.intrinsics.tolist()
    edges = np.array([[-0.5, cy], [width - 0.5, cy], [cx, -0.5], [cx, height - 0.5]])
    corners = np.array([[x, y] for x in (-0.5, width - 0.5) for y in (-0.5, height - 0.5)])
    left, right, top, bottom = _off_axis(camera, edges).tolist()
    steep = _off_axis(camera, corners)
    flat = Camera("pinhole", camera.intrinsics, (), camera.size)
    moved = np.linalg.norm(flat.project(camera.unproject(corners)) - corners, axis=1)
    middle = camera.unproject(np.array([[cx, cy], [cx + 1.0, cy]]))
    return CameraSummary(
        camera,
        left + right,
        top + bottom,
        float(max(steep[0] + steep[3], steep[1] + steep[2])),
        float(np.max(moved)),
        np.array([cx - 0.5 * (width - 1), cy - 0.5 * (height - 1)]),
        float(np.arccos(np.clip(middle[0] @ middle[1], -1.0, 1.0))),
        camera.check_monotonic(),
    )


def _off_axis(camera: Camera, pixels: Array) -> Array:
    """Angles (N,) between the optical axis and what pixels see, rad."""
    rays = camera.unproject(pixels)
    angles: Array = np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2])
    return angles


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.1f}°" if np.isfinite(angle) else "an unknown angle"
