"""Native factors of cameras: projections and rectified pairs."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from factorlab.graph.slam.lowering import Array, NativeFactor, native_factor
from factorlab.graph.slam.variables import TYPES
from sequential.manifold import SE3
from sequential.slam.models import Projection, StereoProjection

__all__ = ["calibration_of"]

PROJECTIONS = {
    "Cal3_S2": gtsam.GenericProjectionFactorCal3_S2,
    "Cal3DS2": gtsam.GenericProjectionFactorCal3DS2,
    "Cal3Fisheye": gtsam.GenericProjectionFactorCal3Fisheye,
}


def calibration_of(camera: Any) -> tuple[str, Any] | None:
    """GTSAM's calibration of a camera, with its name; None where it has none."""
    lens = getattr(camera, "lens", None)
    names = {
        "pinhole": "Cal3_S2",
        "brown1": "Cal3DS2",
        "brown2": "Cal3DS2",
        "brown4": "Cal3DS2",
        "fisheye4": "Cal3Fisheye",
    }
    if lens not in names:
        return None
    fx, fy, cx, cy = (float(value) for value in camera.intrinsics)
    if lens == "pinhole":
        return "Cal3_S2", gtsam.Cal3_S2(fx, fy, 0.0, cx, cy)
    bent = [*np.asarray(camera.distortion).tolist(), 0.0, 0.0, 0.0, 0.0][:4]
    return names[lens], getattr(gtsam, names[lens])(np.array([fx, fy, 0.0, cx, cy, *bent]))


def mount_of(pose: Any) -> tuple[Any, ...]:
    """The pose of a camera on a body as GTSAM's last argument, or none."""
    return () if pose is None else (TYPES[SE3].to_gtsam(np.array([pose]))[0],)


@native_factor.register
def _(model: Projection) -> NativeFactor | None:
    found = calibration_of(model.camera)
    if found is None:
        return None
    make, calibration, mount = PROJECTIONS[found[0]], found[1], mount_of(model.body_T_camera)

    def factor(pose: int, point: int, pixel: Array, noise: Any) -> Any:
        return make(pixel, noise, pose, point, calibration, *mount)

    return NativeFactor(factor, list)


@native_factor.register
def _(model: StereoProjection) -> NativeFactor | None:
    fx, fy, cx, cy = model.intrinsics
    calibration = gtsam.Cal3_S2Stereo(fx, fy, 0.0, cx, cy, model.baseline_m)
    make, mount = gtsam.GenericStereoFactor3D, mount_of(model.body_T_camera)

    def factor(pose: int, point: int, pixels: Any, noise: Any) -> Any:
        return make(pixels, noise, pose, point, calibration, *mount)

    return NativeFactor(factor, lambda z: [gtsam.StereoPoint2(*row) for row in z.tolist()])
