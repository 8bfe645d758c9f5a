"""Are triangulated points as sure as they say?  Projected truth, rendered photographs, equalities and time.

Rendered pairs go the whole way: photographs with noise, SIFT, matching, patches aligned, triangulation, and
the surface itself as truth.  Sigmas are what the features say; of the truth nothing is used before the error
is taken, except to tell the points near jumps of depth from the others.
"""

from __future__ import annotations

import cv2
import numpy as np
from scene_worlds import measured_pair

from measure.figures import Figure, interleaved, say
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.match_correction import correct_matches
from vision3d.render import orbit_poses
from vision3d.rigid import compose, inverse, transform
from vision3d.triangulate import triangulate

LENSES = {
    "pinhole": Camera("pinhole", (560, 565, 319.5, 239.5), (), (640, 480)),
    "brown5": Camera("brown5", (533, 533, 342, 234), (-0.28, 0.05, 0.0012, -0.0001, 0.05), (640, 480)),
    "fisheye4": Camera("fisheye4", (230, 230, 320, 240), (0.02, -0.01, 0.003, 0.0), (640, 480)),
}
ORBIT = orbit_poses((0, 0.1, 1.6), 1.6, 6, arc_rad=0.6)
NAMES, FIRST_SEED = ("desk", "corridor", "wall", "ground"), 900
SIZED = "rendered_sized_by_residuals"


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    return {**projected(quick=quick), **rendered(quick=quick), **equal(), **times(quick=quick)}


def band(name: str, values: list[float], said: str, *, judged: bool = True) -> dict[str, Figure]:
    """The largest and the smallest of values that should be 1."""
    top, low = ((1.3, 1.1), (0.8, 0.9)) if judged else ((None, None), (None, None))
    return {
        f"triangulated_nees_{name}_largest": Figure(max(values), "", said, *top),
        f"triangulated_nees_{name}_smallest": Figure(min(values), "", said, *low, better="higher"),
    }


def projected(*, quick: bool) -> dict[str, Figure]:
    """Exact pixels with Gaussian noise, a sigma for each, through three lenses in 2 to 6 views."""
    n, values = 1000 if quick else 10_000, []
    for name, camera in LENSES.items():
        for views in (2, 3, 6):
            rng = np.random.default_rng(views)
            points = rng.uniform((-0.45, -0.3, 1.2), (0.45, 0.35, 2.2), (n, 3))
            sigma = rng.uniform(0.2, 0.8, (views, n))
            exact = np.stack([camera.project(transform(pose, points)) for pose in ORBIT[:views]])
            noisy = exact + sigma[..., None] * rng.normal(size=exact.shape)
            found = triangulate(camera, ORBIT[:views], noisy, sigma_px=sigma)
            error = found.points - points
            nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covs), error) / 3
            values.append(float(nees.mean()))
            say(f"  {name:<9} {views} views: NEES/3 {values[-1]:.3f}")
    return band("projected", values, f"3 lenses, 2, 3, 6 views, {n} points each")


def rendered(*, quick: bool) -> dict[str, Figure]:
    """Whole photographs; every scene several times, at the usual noise and at more."""
    sets, rows = 1 if quick else 3, {}
    held: dict[str, list[np.ndarray]] = {"rendered": [], "rendered_away_from_edges": [], SIZED: []}
    for noise in (2.0, 5.0):
        for name in NAMES:
            pairs = [
                measured_pair(name, np.random.default_rng(FIRST_SEED + seed), noise=noise)
                for seed in range(sets)
            ]
            nees, edge = (np.concatenate([getattr(p, part) for p in pairs]) for part in ("nees", "edge"))
            sized = np.concatenate([p.nees / p.factor for p in pairs])
            for values, part in zip(held.values(), (nees, nees[~edge], sized), strict=True):
                values.append(part)
            say(
                f"  {name:<9} noise {noise:g}: {len(nees)} points, NEES/3 {nees.mean():.3f}, away from edges "
                f"{nees[~edge].mean():.3f}, sized {sized.mean():.3f}, median {np.median(nees):.2f}, "
                f"{edge.mean():.0%} at edges"
            )
    said = f"{sets} pairs each of {', '.join(NAMES)} at noise 2 and 5"
    for what, parts in held.items():
        whole = float(np.mean(np.concatenate(parts)))
        rows |= band(f"{what}_mean", [whole], f"over all points; {said}", judged=what != SIZED)
        if what != SIZED:
            scenes = [float(values.mean()) for values in parts]
            rows |= band(f"{what}_by_scene", scenes, said, judged=False)
    return rows


def equal() -> dict[str, Figure]:
    """Against OpenCV, and the two ways to correct a match against each other."""
    rng, camera, poses = np.random.default_rng(1), LENSES["pinhole"], ORBIT[:2]
    points = rng.uniform((-0.45, -0.3, 1.2), (0.45, 0.35, 2.2), (2000, 3))
    pixels = np.stack([camera.project(transform(pose, points)) for pose in poses])
    pixels += rng.normal(0, 1.0, pixels.shape)
    matrices = [np.column_stack([rotation_matrix(pose[:4]), pose[4:]]) for pose in poses]
    homogeneous = cv2.triangulatePoints(*matrices, *(camera.undistort_points(row).T for row in pixels))
    linear = triangulate(camera, poses, pixels, method="linear").points
    apart = np.abs(linear - (homogeneous[:3] / homogeneous[3]).T).max()
    b_T_a = compose(poses[1], inverse(poses[0]))
    x, y, z = b_T_a[4:]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    back = np.linalg.inv(camera.matrix)
    matrix = back.T @ cross @ rotation_matrix(b_T_a[:4]) @ back
    quick, exact = (correct_matches(matrix, *pixels, method=way) for way in ("lindstrom", "hartley_sturm"))
    best = triangulate(camera, poses, pixels).points
    shown = np.stack([camera.project(transform(pose, best)) for pose in poses])
    ways = max(float(np.abs(np.stack(other) - np.stack(exact)).max()) for other in (quick, shown))
    return {
        "triangulated_linear_off_opencv": Figure(apart, "m", "2000 points", 1e-9, 1e-12),
        "triangulated_optima_apart": Figure(ways, "px", "Hartley-Sturm, Lindström, Gauss-Newton", 1e-4, 1e-6),
    }


def times(*, quick: bool) -> dict[str, Figure]:
    """Time of many points beside OpenCV's linear ones, which have neither covariance nor lens."""
    rng, camera, poses = np.random.default_rng(2), LENSES["brown5"], ORBIT[:2]
    n = 2000 if quick else 20_000
    points = rng.uniform((-0.45, -0.3, 1.2), (0.45, 0.35, 2.2), (n, 3))
    pixels = np.stack([camera.project(transform(pose, points)) for pose in poses])
    pixels += rng.normal(0, 0.5, pixels.shape)
    matrices = [np.column_stack([rotation_matrix(pose[:4]), pose[4:]]) for pose in poses]
    vector = np.append(camera.distortion, np.zeros(0))

    def theirs() -> object:
        rows = [cv2.undistortPoints(row[:, None], camera.matrix, vector)[:, 0].T for row in pixels]
        return cv2.triangulatePoints(*matrices, *rows)

    spent = interleaved({"ours": lambda: triangulate(camera, poses, pixels), "cv2": theirs}, 3)
    said = "undistortPoints and triangulatePoints: linear, no covariance"
    return {
        "triangulated_time_a_point": Figure(1e6 * spent["ours"] / n, "µs", "–"),
        "triangulated_time_over_opencv_linear": Figure(spent["ours"] / spent["cv2"], "x", said),
    }
