"""Native factors of the plane, and of anything that adds: priors, relative poses, ranges and bearings."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from factorlab.graph.slam.lowering import Array, NativeFactor, native_factor
from factorlab.graph.slam.variables import type_of
from sequential.manifold import SE2
from sequential.slam.models import Between, LandmarkBearing, LandmarkRange, LandmarkRangeBearing, Prior

__all__: list[str] = []


@native_factor.register
def _(model: Prior) -> NativeFactor | None:
    found = type_of(model.manifold)
    if found is None or found.name == "NavState":  # its prior measures along another chart
        return None
    return NativeFactor(getattr(gtsam, f"PriorFactor{found.name}"), found.to_gtsam)


@native_factor.register
def _(model: Between) -> NativeFactor | None:
    found = type_of(model.manifold)
    if found is None:
        return None
    return NativeFactor(getattr(gtsam, f"BetweenFactor{found.name}"), found.to_gtsam)


@native_factor.register
def _(model: LandmarkRangeBearing) -> NativeFactor | None:
    make = gtsam.BearingRangeFactor2D

    def factor(pose: int, point: int, reading: tuple[float, Any], noise: Any) -> Any:
        return make(pose, point, reading[1], reading[0], noise)

    # GTSAM wants the bearing first
    return NativeFactor(factor, _polar, (1, 0))


def _polar(z: Array) -> list[tuple[float, Any]]:
    return [(distance, gtsam.Rot2(bearing)) for distance, bearing in z.tolist()]


@native_factor.register
def _(model: LandmarkRange) -> NativeFactor | None:
    make = gtsam.RangeFactor2D if isinstance(model.pose, SE2) else gtsam.RangeFactor3D
    return NativeFactor(make, lambda z: np.ravel(z).tolist())


@native_factor.register
def _(model: LandmarkBearing) -> NativeFactor | None:
    return NativeFactor(gtsam.BearingFactor2D, lambda z: [gtsam.Rot2(angle) for angle in z[:, 0].tolist()])
