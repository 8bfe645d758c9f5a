"""The lenses that a camera may have: names of their distortion coefficients, and what kernels call them."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["LENSES", "LENS_CODE", "Lens"]


@dataclass(frozen=True, slots=True)
class Lens:
    """A family of cameras: which distortion coefficients it has.

    Parameters
    ----------
    name : short name, the key of `LENSES`
    distortion : names of the coefficients, in OpenCV's order
    title : what people call it
    """

    name: str
    distortion: tuple[str, ...]
    title: str

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters: fx, fy, cx, cy, then the distortion."""
        return ("fx", "fy", "cx", "cy", *self.distortion)

    @property
    def is_fisheye(self) -> bool:
        """Whether the image radius grows with the angle, so that rays of 90° and more have an image."""
        return self.name == "fisheye4"


_RATIONAL = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
LENSES: dict[str, Lens] = {
    lens.name: lens
    for lens in (
        Lens("pinhole", (), "pinhole"),
        Lens("brown1", _RATIONAL[:1], "Brown, 1 radial"),
        Lens("brown2", _RATIONAL[:2], "Brown, 2 radial"),
        Lens("brown4", _RATIONAL[:4], "Brown-Conrady, 2 radial and 2 tangential"),
        Lens("brown5", _RATIONAL[:5], "Brown-Conrady, 3 radial and 2 tangential"),
        Lens("rational8", _RATIONAL, "rational"),
        Lens("thin12", (*_RATIONAL, "s1", "s2", "s3", "s4"), "rational with thin prism"),
        Lens("fisheye4", ("k1", "k2", "k3", "k4"), "Kannala-Brandt fisheye"),
    )
}
"""Every lens by its name."""
LENS_CODE: dict[str, int] = {name: code for code, name in enumerate(LENSES)}
"""What kernels call a lens."""
