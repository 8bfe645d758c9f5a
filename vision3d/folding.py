"""Where a distortion ceases to be one-to-one: past its fold, one pixel is the image of several rays.

A fitted polynomial says nothing about where there were no corners: a high order or a pole of the rational
model may turn the image inside out within its own borders.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import Polynomial

from vision3d.lenses import LENSES

if TYPE_CHECKING:
    from vision3d.camera import Array, Camera

__all__ = ["Fold", "check_monotonic", "radial_limit"]

IMAGINARY_MAX = 1e-9
"""Imaginary part, relative, of a root that is taken for real."""
BEFORE_POLE = 1.0 - 1e-9
"""Where the valid field ends before a pole, as a share of its squared radius."""
UNBOUNDED = 1e5
"""An image radius, in focal lengths, that only a pole gives."""
AT_POLE = 0.98
"""Share of a pole's radius beyond which rays belong to the pole rather than to the lens."""


@dataclass(frozen=True, slots=True)
class Fold:
    """Whether, and where, a distortion folds.

    Parameters
    ----------
    radius_px : distance from the principal point at which the radial part folds, px; inf where nowhere, or
        at a pole, up to which the image grows without bound
    angle_rad : angle from the optical axis beyond which rays have no image, rad; inf where there is none
    inside : whether some pixel of the image has no ray, or one that only a pole gives it
    lost : share of such pixels in the image, 0 to 1
    """

    radius_px: float
    angle_rad: float
    inside: bool
    lost: float

    def __str__(self) -> str:
        end = f"{np.degrees(self.angle_rad):.1f}° off axis"
        if np.isfinite(self.radius_px):
            what = f"the distortion folds {self.radius_px:.0f} px from the principal point ({end})"
        elif np.isfinite(self.angle_rad):
            what = f"the distortion has a pole {end}, beyond which nothing has an image"
        elif self.inside:
            what = "the tangential or thin-prism terms of the distortion fold the image"
        else:
            return "the distortion is one-to-one everywhere"
        if not self.inside:
            return f"{what}, outside the image" if np.isfinite(self.radius_px) else what
        return (
            f"{what}, inside the image: {100.0 * self.lost:.1f} % of its pixels have no ray; calibrate "
            "with corners near the corners of the image, or with fewer coefficients"
        )


def radial_limit(lens: str, parameters: Array) -> float:
    """Smallest radius x/z (fisheye: angle, rad) at which the image radius ceases to grow; inf where none.

    Parameters
    ----------
    lens : name of the lens
    parameters : (4+k,) intrinsics and distortion
    """
    k = dict(zip(_names(lens), parameters[4:], strict=True))
    if lens == "fisheye4":
        slope = Polynomial([1.0, *((2 * i + 1) * k[f"k{i}"] for i in range(1, 5))])
        return float(np.sqrt(min(_first_sign_change(slope), np.pi**2)))
    top = Polynomial([1.0, *(k.get(f"k{i}", 0.0) for i in range(1, 4))])
    under = Polynomial([1.0, *(k.get(f"k{i}", 0.0) for i in range(4, 7))])
    s = Polynomial([0.0, 1.0])
    # d(r g)/dr = (N D + 2 s (N' D - N D')) / D², with s = r² and g = N / D
    slope = top * under + 2.0 * s * (top.deriv() * under - top * under.deriv())
    pole = _first_sign_change(under) * BEFORE_POLE
    return float(np.sqrt(min(_first_sign_change(slope), pole)))


def check_monotonic(camera: Camera, *, samples: int = 48) -> Fold:
    """Look for the fold, and for pixels that no ray reaches, on a grid that includes the border.

    Parameters
    ----------
    camera : the camera
    samples : pixels along each side of the grid
    """
    width, height = camera.size
    across, down = np.meshgrid(
        np.linspace(-0.5, width - 0.5, samples), np.linspace(-0.5, height - 0.5, samples)
    )
    rays = camera.unproject(np.stack([across.ravel(), down.ravel()], axis=-1))
    limit = camera.limit
    is_fisheye = camera.lens == "fisheye4"
    # up to a pole the image grows without bound, so that every pixel finds a ray, crowded in front of it
    crowd = AT_POLE * limit if _image_radius(camera, min(limit, UNBOUNDED)) > UNBOUNDED else np.inf
    good = np.hypot(rays[:, 0], rays[:, 1]) < crowd * np.abs(rays[:, 2])
    lost = float(1.0 - good.mean())
    if not np.isfinite(limit) or (is_fisheye and limit >= np.pi):
        return Fold(np.inf, np.inf, lost > 0.0, lost)
    focal = float(np.sqrt(camera.intrinsics[0] * camera.intrinsics[1]))
    angle = limit if is_fisheye else float(np.arctan(limit))
    radius = _image_radius(camera, limit)
    return Fold(focal * radius if radius < UNBOUNDED else np.inf, angle, lost > 0.0, lost)


def _image_radius(camera: Camera, t: float) -> float:
    """Radial part of the distortion at t, in focal lengths; just inside of a pole it is huge."""
    k = dict(zip(_names(camera.lens), camera.distortion, strict=True))
    s = t * t
    if camera.lens == "fisheye4":
        return float(t * (1.0 + s * (k["k1"] + s * (k["k2"] + s * (k["k3"] + s * k["k4"])))))
    top = 1.0 + s * (k.get("k1", 0.0) + s * (k.get("k2", 0.0) + s * k.get("k3", 0.0)))
    under = 1.0 + s * (k.get("k4", 0.0) + s * (k.get("k5", 0.0) + s * k.get("k6", 0.0)))
    return float(t * top / under)


def _names(lens: str) -> tuple[str, ...]:
    return LENSES[lens].distortion


def _first_sign_change(polynomial: Polynomial) -> float:
    """Smallest positive root at which a polynomial that is 1 at 0 turns negative; inf where none."""
    roots = polynomial.trim().roots()
    real = np.sort(roots.real[np.abs(roots.imag) <= IMAGINARY_MAX * np.maximum(1.0, np.abs(roots))])
    for root in real[real > 0.0]:
        if polynomial(root * (1.0 + 1e-6)) <= 0.0:
            return float(root)
    return float("inf")
