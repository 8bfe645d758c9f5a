"""Find features: SIFT, ORB, and FAST's or Harris' corners with bits or patches.

| kind | where | described by | compare |
|---|---|---|---|
| `sift` | extrema of differences of Gaussians (Lowe, 2004) | RootSIFT (Arandjelović, 2012) | L2 |
| `orb` | FAST's corners on a pyramid (Rublee et al., 2011) | 256 turned comparisons | Hamming |
| `fast`, `harris` | FAST's or Harris' corners at full size | as ORB | Hamming |
| `fast-patch`, `harris-patch` | the same | 8x8 grey levels, turned and normalised | L2 |

SIFT bears changes of scale, light and view best; ORB is ten times quicker; corners of one size are for
pictures taken from about the same distance.
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ModelError, ShapeError
from vision3d.features.features import Array, Features
from vision3d.features.spreading import spread_levels, spread_rows

__all__ = ["KINDS", "Kind", "detect_features"]

Kind: TypeAlias = Literal["sift", "orb", "fast", "harris", "fast-patch", "harris-patch"]
KINDS: tuple[str, ...] = get_args(Kind)
SURPLUS = 20  # as many are found as are asked for, so that there is something to spread


def detect_features(
    image: ArrayLike,
    kind: Kind | str = "sift",
    *,
    count: int = 2000,
    spread: bool = True,
    mask: ArrayLike | None = None,
) -> Features:
    """Find and describe local features.

    Parameters
    ----------
    image : (h, w) grey levels or (h, w, 3) BGR, uint8
    kind : one of `KINDS`
    count : at most so many
    spread : choose them over the whole image; otherwise the strongest, wherever they are
    mask : (h, w), set where features may be

    Returns
    -------
    Features
        strongest first; none where the image is too small or without texture.

    Raises
    ------
    ModelError
        for an unknown kind.
    DataError, ShapeError
        where the image is none, or the mask has another size.
    """
    if kind not in KINDS:
        raise ModelError(f"no features are called {kind!r}; known are {', '.join(KINDS)}")
    if count < 1:
        raise ModelError(f"the number of features to find is 1 or more, got {count}")
    grey = grey_bytes(image)
    allowed = _mask(mask, grey)
    from vision3d.features import corner_features, pyramid_features

    more = SURPLUS * count if spread else count
    if kind == "sift":
        found = pyramid_features.sift(grey, allowed)
    elif kind == "orb":
        found = pyramid_features.orb(grey, allowed, more)
    else:
        found = corner_features.described(grey, allowed, kind, more)
    height, width = grey.shape
    if spread and kind == "orb":
        scale = np.round(found.size_px / found.size_px.min(initial=np.inf), 4)
        return found.take(spread_levels(found.pixels, found.response, scale, (width, height), count))
    if spread:
        return found.take(spread_rows(found.pixels, found.response, (width, height), count))
    return found.take(np.argsort(-found.response, kind="stable")[:count])


def grey_bytes(image: ArrayLike) -> NDArray[np.uint8]:
    from vision3d.image.colour import grey
    from vision3d.image.pixels import as_image

    pixels = as_image(image)
    if pixels.dtype != np.uint8:
        raise DataError(f"features are found in images of 8 bits, got {pixels.dtype}; scale it to 0-255")
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[:, :, 0]
    if pixels.ndim == 3 and pixels.shape[2] != 3:
        raise ShapeError(f"expected an image (h, w) or (h, w, 3), got {pixels.shape}")
    return np.ascontiguousarray(pixels if pixels.ndim == 2 else grey(pixels))


def _mask(mask: ArrayLike | None, image: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    if mask is None:
        return None
    from vision3d.image.pixels import as_mask

    allowed = as_mask(mask)
    if allowed.shape != image.shape:
        raise ShapeError(f"the mask is {allowed.shape} and the image {image.shape}; they must be of one size")
    return np.ascontiguousarray(allowed * np.uint8(255))


def none_of(kind: str, width: int, dtype: Any) -> Features:
    """No features, of the shape that some would have."""
    empty: Array = np.empty(0)
    return Features(np.empty((0, 2)), np.empty((0, width), dtype), empty, empty, empty, empty, kind)
