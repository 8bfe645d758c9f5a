"""Square markers in one picture: their numbers, their corners, and how sure those are.

OpenCV finds candidate squares and reads their cells; the corners are ours: lines fitted to the four sides,
whose scatter says what each corner is worth (`vision3d.kernels.quad_edges`).

>>> from vision3d.markers import detect_markers
>>> detect_markers(image, "6x6_250")  # doctest: +SKIP
(Marker(id=23, ...), Marker(id=40, ...))
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from vision3d.markers.dictionaries import (
    DICTIONARIES,
    FAMILIES,
    dictionary_name,
    smallest_of,
    surprise,
)

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["Marker", "bends_of", "detect_markers", "find_markers"]

Array = NDArray[np.float64]

SYSTEMATIC_PX = 0.02  # what is left of an edge's position with neither noise nor blur: 8 bits, sampling
CORRELATION = 1.5  # neighbouring profiles share pixels: a line is worth fewer of them
BLOOM_PX = 0.1  # by which light, ink and gamma move all four sides of a marker together, in or out
UNREFINED_PX = 0.5  # corners as OpenCV's contours give them
REACH_PX = 2.5
CURVATURE_PX = 2e-4  # half the curvature (1/px) that a lens without a name may give to a straight side
INWARD_PX = 0.5  # a contour runs through the outermost dark pixels
CONTOUR = 2  # OpenCV's CORNER_REFINE_CONTOUR: lines through contours, a start for ours


@dataclass(frozen=True, eq=False)
class Marker:
    """One marker in a picture; arrays are copied and read-only.

    Parameters
    ----------
    id : its number in the dictionary
    corners : (4, 2) px, clockwise from the top left of the marker as printed
    sigma_px : (4,) standard deviation of a coordinate of each corner
    cov_px2 : (8, 8) covariance of x0 y0 x1 y1 …; neighbours share a side, so their errors go together
    refined : whether lines were fitted to its sides; otherwise the corners are those of a contour
    dictionary : by the name of `vision3d.boards`
    """

    id: int
    corners: Array
    sigma_px: Array
    cov_px2: Array | None = None
    refined: bool = False
    dictionary: str = ""

    def __post_init__(self) -> None:
        corners = np.array(self.corners, dtype=np.float64)
        if corners.shape != (4, 2):
            raise ShapeError(f"marker {self.id}: corners are (4, 2), got {corners.shape}")
        sigma = np.array(np.broadcast_to(np.asarray(self.sigma_px, dtype=np.float64), (4,)))
        cov = None if self.cov_px2 is None else np.array(self.cov_px2, dtype=np.float64)
        for name, array in (("corners", corners), ("sigma_px", sigma), ("cov_px2", cov)):
            if array is not None:
                array.flags.writeable = False
                object.__setattr__(self, name, array)

    @property
    def cov(self) -> Array:
        """The covariance (8, 8) of x0 y0 x1 y1 …, px²; diagonal where none was given."""
        return np.diag(np.repeat(self.sigma_px**2, 2)) if self.cov_px2 is None else self.cov_px2

    @property
    def centre(self) -> Array:
        """Where the diagonals cross: the image of the marker's centre, (2,) px."""
        a, b, c, d = self.corners
        along, across = c - a, d - b
        det = along[0] * across[1] - along[1] * across[0]
        share = ((b - a)[0] * across[1] - (b - a)[1] * across[0]) / det
        centre: Array = a + share * along
        return centre

    @property
    def side_px(self) -> float:
        """Mean length of its sides."""
        return float(np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=0), axis=1).mean())


def detect_markers(
    image: NDArray[np.uint8], dictionary: str = "auto", *, camera: Camera | None = None
) -> tuple[Marker, ...]:
    """Find the markers of a dictionary, in the order of their numbers; of one number the largest comes first.

    Parameters
    ----------
    image : (height, width) or (height, width, 3), 8 bits
    dictionary : its name, as in `vision3d.boards`; "auto" tries every family and keeps the likeliest
    camera : that took it, if known: its lens says how straight sides are bent in the picture

    Raises
    ------
    ShapeError, ModelError
        where the image is no image, or there is no such dictionary.
    """
    return find_markers(image, dictionary, camera=camera)[0]


def find_markers(
    image: NDArray[np.uint8], dictionary: str = "auto", *, camera: Camera | None = None
) -> tuple[tuple[Marker, ...], str | None]:
    """Find markers and say of which dictionary; None where "auto" found nothing."""
    grey = _grey(image)
    if dictionary != "auto":
        name = dictionary_name(dictionary)
        return _refined(grey, *_squares(grey, name), name, camera), name
    best: tuple[float, str | None] = (0.0, None)
    for family, longest in FAMILIES.items():
        ids = _squares(grey, longest)[1]
        score = len(ids) * surprise(longest)
        if score > best[0]:
            best = (score, smallest_of(family, int(ids.max())))
    if best[1] is None:
        return (), None
    return _refined(grey, *_squares(grey, best[1]), best[1], camera), best[1]


def _grey(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """One channel, contiguous."""
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8 or image.ndim not in {2, 3}:
        told = (
            f"{image.dtype} of shape {image.shape}" if isinstance(image, np.ndarray) else type(image).__name__
        )
        raise ShapeError(f"an image is uint8 of shape (height, width) or (height, width, 3), got {told}")
    if image.ndim == 2:
        return np.ascontiguousarray(image)
    import cv2

    if image.shape[2] not in {1, 3, 4}:
        raise ShapeError(f"an image has 1, 3 or 4 channels, got {image.shape[2]}")
    if image.shape[2] == 1:
        return np.ascontiguousarray(image[..., 0])
    code = cv2.COLOR_BGR2GRAY if image.shape[2] == 3 else cv2.COLOR_BGRA2GRAY
    return np.asarray(cv2.cvtColor(image, code), dtype=np.uint8)


def _squares(grey: NDArray[np.uint8], name: str) -> tuple[Array, NDArray[np.int64]]:
    """What OpenCV reads: corners (M, 4, 2) and numbers (M,), of one number the largest square first."""
    from vision3d import cv

    found = cv.detect_markers(grey, name, parameters={"cornerRefinementMethod": CONTOUR})
    order = np.lexsort((-_sides(found.corners), found.ids))
    return np.ascontiguousarray(_grown(found.corners[order])), found.ids[order]


def _outward(quads: Array) -> Array:
    """Covariance (M, 8, 8) of corners (M, 4, 2) whose sides all move outward by one pixel, one sigma."""
    step = (_grown(quads) - quads).reshape(-1, 8) / INWARD_PX
    together: Array = step[:, :, None] * step[:, None, :]
    return together


def _grown(quads: Array) -> Array:
    """Move the sides of quadrilaterals (M, 4, 2) outward by INWARD_PX."""
    ahead = np.roll(quads, -1, axis=1) - quads
    ahead /= np.linalg.norm(ahead, axis=2, keepdims=True)
    behind = np.roll(ahead, 1, axis=1)
    # the outward normals are (dy, -dx) and ask for INWARD_PX both: Cramer's rule
    sine = behind[..., 0] * ahead[..., 1] - behind[..., 1] * ahead[..., 0]
    step = (behind - ahead) / np.where(np.abs(sine) > 0.2, sine, np.inf)[..., None]
    return quads + INWARD_PX * step


def bends_of(camera: Camera, quads: Array) -> Array:
    """How a lens bends the straight sides of quadrilaterals (M, 4, 2): (M, 4) offset / u², px outward."""
    rays = camera.unproject(quads.reshape(-1, 2)).reshape(-1, 4, 3)
    middle = camera.project((rays + np.roll(rays, -1, axis=1)).reshape(-1, 3)).reshape(-1, 4, 2)
    side = np.roll(quads, -1, axis=1) - quads
    length = np.linalg.norm(side, axis=2)
    away = middle - quads
    outward = (away[..., 0] * side[..., 1] - away[..., 1] * side[..., 0]) / length
    bends: Array = np.nan_to_num(-4.0 * outward)
    return bends


def _sides(quads: Array) -> Array:
    """Mean length of the sides, (M,)."""
    sides: Array = np.linalg.norm(quads - np.roll(quads, 1, axis=1), axis=2).mean(axis=1)
    return sides


def _refined(
    grey: NDArray[np.uint8], quads: Array, ids: NDArray[np.int64], name: str, camera: Camera | None
) -> tuple[Marker, ...]:
    """Markers with our corners."""
    if not len(ids):
        return ()
    from vision3d.kernels.quad_edges import refine_quads

    corners, covs = np.empty_like(quads), np.zeros((len(ids), 8, 8))
    done = np.zeros(len(ids), dtype=np.bool_)
    cells = DICTIONARIES[name].bits + 2
    noise = np.array([SYSTEMATIC_PX, CORRELATION, CURVATURE_PX if camera is None else 0.1 * CURVATURE_PX])
    bends = np.zeros(quads.shape[:2]) if camera is None else bends_of(camera, quads)
    refine_quads(grey, quads, bends, cells, noise, REACH_PX, corners, covs, done)
    covs += BLOOM_PX**2 * _outward(corners)
    covs[~done] = np.eye(8) * UNREFINED_PX**2
    sigmas = np.sqrt(np.diagonal(covs, axis1=1, axis2=2).reshape(-1, 4, 2).mean(axis=2))
    return tuple(
        Marker(int(ids[m]), corners[m], sigmas[m], covs[m], bool(done[m]), name) for m in range(len(ids))
    )
