"""A camera that walks past markers of unknown pose, projected: problem and truth."""

import numpy as np

from sequential.manifold import SE3
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import MarkerCorners, Prior
from vision3d.camera import Camera

CAMERA = Camera("brown4", (500.0, 500.0, 320.0, 240.0), (-0.1, 0.02, 0.0005, -0.0008))
SIDE_M, SIGMA_PX = 0.16, 0.5


def wall(rng, markers=8, views=60, *, camera=CAMERA, mount=None, held=1e-6):
    """Markers on a wall and a camera that circles before it: the problem, true poses and true markers."""
    place = np.array([[0.6 * (j % 4) - 0.9, 0.6 * (j // 4) - 0.3, 0.0] for j in range(markers)])
    marker = np.concatenate([np.tile([1.0, 0.0, 0.0, 0.0], (markers, 1)), place], axis=1)
    tilt = np.concatenate([0.2 * rng.standard_normal((markers, 3)), np.zeros((markers, 3))], axis=1)
    marker = SE3().retract(marker, tilt)
    angle = 0.1 * np.arange(views)
    centre = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), np.full(views, -2.0)], axis=1)
    pose = np.concatenate([np.tile([1.0, 0.0, 0.0, 0.0], (views, 1)), centre], axis=1)
    turn = np.concatenate([0.1 * rng.standard_normal((views, 3)), np.zeros((views, 3))], axis=1)
    pose = SE3().retract(pose, turn)
    pairs = np.stack(np.meshgrid(np.arange(views), np.arange(markers), indexing="ij"), -1).reshape(-1, 2)
    model = MarkerCorners(camera, SIDE_M, mount)
    exact = model.expected(pose[pairs[:, 0]], marker[pairs[:, 1]])
    seen = np.isfinite(exact).all(axis=1)
    pairs, exact = pairs[seen], exact[seen]
    z = exact + SIGMA_PX * rng.standard_normal(exact.shape)
    factors = (
        Factors(Prior(SE3()), ("m",), [[0]], marker[:1], held**2, name="first marker"),
        Factors(model, ("x", "m"), pairs, z, SIGMA_PX**2, name="corners"),
    )
    rough = {
        kind: SE3().retract(rows, 0.03 * rng.standard_normal((len(rows), 6)))
        for kind, rows in (("x", pose), ("m", marker))
    }
    start = Values({kind: np.arange(len(rows)) for kind, rows in rough.items()}, rough)
    return SlamProblem({"x": SE3(), "m": SE3()}, factors, start=start), pose, marker
