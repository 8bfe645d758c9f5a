"""Which parameters of a camera a bundle adjustment moves, and which it ties together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.camera import LENSES, Camera

__all__ = ["Refine", "free_basis", "free_names"]

Array = NDArray[np.float64]
Refine = bool | Sequence[str]
"""True or False for all or nothing, else names."""

FOCAL = "f"
"""One focal length for both directions."""


def free_names(camera: Camera, refine: Refine) -> tuple[str, ...]:
    """Names of what is free in a camera.

    Parameters
    ----------
    camera : the camera
    refine : True for the focal length (one where fx equals fy, else two) and the distortion, as COLMAP does
        it: the principal point is hardly known from a few photographs; False for nothing; or names, among
        them `"f"` for a focal length that both directions share. Names that the lens lacks are passed over.

    Raises
    ------
    ModelError
        for a name that no lens has, or for `"f"` beside `"fx"` or `"fy"`.
    """
    if isinstance(refine, bool):
        if not refine:
            return ()
        focal = (FOCAL,) if camera.intrinsics[0] == camera.intrinsics[1] else ("fx", "fy")
        return (*focal, *camera.names[4:])
    asked = (refine,) if isinstance(refine, str) else tuple(refine)
    known = {FOCAL, *(name for lens in LENSES.values() for name in lens.parameters)}
    strange = [name for name in asked if name not in known]
    if strange:
        raise ModelError(f"no camera has a parameter {strange[0]!r}; known are {', '.join(sorted(known))}")
    if FOCAL in asked and {"fx", "fy"} & set(asked):
        raise ModelError("refine either 'f', one focal length, or 'fx' and 'fy'; got both")
    return tuple(name for name in (FOCAL, *camera.names) if name in asked)


def free_basis(camera: Camera, names: Sequence[str]) -> Array:
    """How the parameters (4+k,) of a camera follow its free ones: (4+k, number of names).

    A shared focal length keeps the ratio of fx and fy.
    """
    basis = np.zeros((camera.count, len(names)))
    for column, name in enumerate(names):
        if name == FOCAL:
            basis[0, column] = 1.0
            basis[1, column] = camera.intrinsics[1] / camera.intrinsics[0]
        else:
            basis[camera.names.index(name), column] = 1.0
    return basis
