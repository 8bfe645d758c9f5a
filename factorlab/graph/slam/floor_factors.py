"""The native factor of a camera on a robot that stays on the floor."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from factorlab.graph.slam.lowering import Array, NativeFactor, native_factor
from factorlab.graph.slam.spatial_factors import calibration_of, mount_of
from sequential.slam.models import PlanarProjection

__all__: list[str] = []


@native_factor.register
def _(model: PlanarProjection) -> NativeFactor | None:
    camera: Any = model.camera
    found = calibration_of(camera)
    if found is None or found[0] == "Cal3Fisheye":
        return None
    bent = [*np.asarray(camera.distortion).tolist(), 0.0, 0.0, 0.0, 0.0][:4]
    fx, fy, cx, cy = (float(value) for value in camera.intrinsics)
    calibration = gtsam.Cal3DS2(fx, fy, 0.0, cx, cy, *bent)
    make, (mount,) = gtsam.PlanarProjectionFactor2, mount_of(model.body_T_camera)

    def factor(pose: int, point: int, pixel: Array, noise: Any) -> Any:
        return make(pose, point, pixel, mount, calibration, noise)

    return NativeFactor(factor, list, raises=True)
