"""Marker corners in GTSAM's own factors: `ProjectionFactorPPP` on the *inverse* pose of each marker.

That factor projects a point by the camera pose ``M ∘ X``.  With M = marker_T_world and X = world_T_camera the
camera stands in the frame of the marker, where its corners are known: four points that tight priors
hold.  A prior on the marker itself is a relative pose from M to an origin that is held too: ``M⁻¹ · origin``
is world_T_marker, so that the error is the same vector.
"""

from __future__ import annotations

from typing import Any

import gtsam
import gtsam_unstable
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.lowering import native_factors, noise_models
from factorlab.graph.slam.spatial_factors import calibration_of
from factorlab.graph.slam.variables import SHIFT, insert_values, keys_of, read_values, require_type
from sequential.manifold import SE3
from sequential.model import Loss
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import MarkerCorners, Prior
from sequential.slam.models.groups import inverse
from sequential.slam.models.marker import square_corners

__all__ = ["MarkerGraph", "marker_graph"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
HELD_M, HELD_ORIGIN = 1e-7, 1e-9
CORNER, ORIGIN = "#", "+"  # letters that no kind of variable has
FACTORS = {
    "Cal3_S2": gtsam_unstable.ProjectionFactorPPPCal3_S2,
    "Cal3DS2": gtsam_unstable.ProjectionFactorPPPCal3DS2,
    "Cal3Fisheye": gtsam_unstable.ProjectionFactorPPPCal3Fisheye,
}


class MarkerGraph:
    """A problem with marker corners as a native graph; markers stand in it inverted."""

    def __init__(self, problem: SlamProblem, graph: Any, kind: str, points: dict[int, Array]) -> None:
        self.problem, self.graph, self.kind, self.points = problem, graph, kind, points

    def ordering(self, values: Any) -> Any:
        """Cameras and all else first, then the corners, which everything touches, and the markers."""
        keys = values.keys()
        last = [ord(CORNER), ord(self.kind), ord(ORIGIN)]
        found = gtsam.Ordering()
        for key in sorted(keys, key=lambda k: (last.index(k >> SHIFT) if k >> SHIFT in last else -1, k)):
            found.push_back(key)
        return found

    def insert(self, values: Values) -> Any:
        """As `gtsam.Values`, with the corners and the origin."""
        found = insert_values(self.problem, self._turned(values))
        for key, point in self.points.items():
            found.insert(key, point)
        found.insert(keys_of(ORIGIN, [0])[0], gtsam.Pose3())
        return found

    def read(self, source: Any, index: dict[str, Ints]) -> Values:
        """Back to markers in the world."""
        return self._turned(read_values(self.problem, source, index))

    def _turned(self, values: Values) -> Values:
        rows = dict(values.rows)
        rows[self.kind] = SE3().normalize(inverse(SE3(), rows[self.kind]))
        return Values(dict(values.index), rows)


def marker_graph(problem: SlamProblem, loss: Loss | None = None) -> MarkerGraph | None:
    """The native graph; None for a mounted camera, a loss, a lens or corners that it has no form for."""
    kinds = {group.slots[1] for group in problem.factors if isinstance(group.model, MarkerCorners)}
    if len(kinds) != 1 or loss is not None:
        return None
    (kind,) = kinds
    graph = gtsam.NonlinearFactorGraph()
    points: dict[int, Array] = {}
    sides: dict[float, int] = {}
    for group in problem.factors:
        if isinstance(group.model, MarkerCorners):
            made = _corner_factors(group, sides.setdefault(group.model.side_m, len(sides)), points)
        elif kind not in group.slots:
            made = native_factors(group)
        else:
            made = _prior_factors(group, kind)
        if made is None:
            return None
        for factor in made:
            graph.push_back(factor)
    # an equality would have GTSAM eliminate by QR throughout, which is thirty times slower
    tight = gtsam.noiseModel.Isotropic.Sigma(3, HELD_M)
    for key, point in points.items():
        graph.push_back(gtsam.PriorFactorPoint3(key, point, tight))
    origin = gtsam.noiseModel.Isotropic.Sigma(6, HELD_ORIGIN)
    graph.push_back(gtsam.PriorFactorPose3(keys_of(ORIGIN, [0])[0], gtsam.Pose3(), origin))
    return MarkerGraph(problem, graph, kind, points)


def _prior_factors(group: Factors, kind: str) -> list[Any] | None:
    """Priors of markers; None for anything else that is said of them."""
    if not isinstance(group.model, Prior) or group.slots != (kind,):
        return None
    origin, poses = keys_of(ORIGIN, [0])[0], require_type(SE3(), kind).to_gtsam(np.asarray(group.z))
    keys, noises = keys_of(kind, np.asarray(group.index)[:, 0]), noise_models(group, None, group.loss)
    return [
        gtsam.BetweenFactorPose3(key, origin, pose, noise)
        for key, pose, noise in zip(keys, poses, noises, strict=True)
    ]


def _corner_factors(group: Factors, side: int, points: dict[int, Array]) -> list[Any] | None:
    """Four factors a sighting; markers of one side share corner points, which are eliminated last."""
    model = group.model
    assert isinstance(model, MarkerCorners)  # noqa: S101 - for the type checker
    found, covs = calibration_of(model.camera), group.covs()
    apart = np.kron(np.eye(4), np.ones((2, 2))) > 0
    if found is None or model.body_T_camera is not None or group.loss is not None or covs[:, ~apart].any():
        return None
    make, calibration = FACTORS[found[0]], found[1]
    index, z, corners = np.asarray(group.index), np.asarray(group.z), square_corners(model.side_m)
    factors, noises = [], _corner_noises(covs)
    body, marker = keys_of(group.slots[0], index[:, 0]), keys_of(group.slots[1], index[:, 1])
    for corner in range(4):
        held = keys_of(CORNER, [4 * side + corner])
        points[held[0]] = corners[corner]
        pixels = z[:, 2 * corner : 2 * corner + 2]
        factors += [
            make(pixel, noise, m, x, p, calibration)
            for pixel, noise, m, x, p in zip(pixels, noises[corner], marker, body, held * len(z), strict=True)
        ]
    return factors


def _corner_noises(covs: Array) -> list[list[Any]]:
    """Noise models of the corners of all sightings; equal ones are one."""
    known: dict[bytes, Any] = {}
    noises = []
    for corner in range(4):
        part = np.ascontiguousarray(covs[:, 2 * corner : 2 * corner + 2, 2 * corner : 2 * corner + 2])
        names = [one.tobytes() for one in part]
        for name, cov in zip(names, part, strict=True):
            if name not in known:
                known[name] = gtsam.noiseModel.Gaussian.Covariance(cov)
        noises.append([known[name] for name in names])
    return noises
