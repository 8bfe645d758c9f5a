"""Markers' map and camera's way with an IMU: honesty by Monte Carlo, what the IMU buys, and what it costs.

Simulated rooms with an analytic motion, eight markers, a camera at 15 Hz, an IMU at 100 Hz, 8 s each; every
second room has its markers in one plane.  The filter is an error-state EKF on the same data.
"""

from __future__ import annotations

import gtsam
import gtsam_unstable
import numpy as np
from gtsam.symbol_shorthand import M, P, X
from marker_map_worlds import frame_errors, map_error, map_nees, mapped, nees, recorded

from factorlab.graph.factors.inertial import pose3
from factorlab.graph.marker_map import MapState, MarkerMapGraph
from factorlab.marker_map.filter import filter_markers
from measure.figures import Figure, interleaved, say
from sequential.manifold import SE3
from vision3d.markers import marker_corners
from vision3d.rigid import compose, inverse

__all__ = ["figures"]

SE = SE3()
SECONDS, SIGMA_PX = 8.0, 0.3
PARTS = {"pose": slice(0, 6), "velocity": slice(6, 9), "accel_bias": slice(9, 12), "gyro_bias": slice(12, 15)}
BAND = 1.3  # what an average of so many runs stays below where it is honest


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Monte Carlo, and the price of the solution beside GTSAM's own optimiser."""
    return monte_carlo(4 if quick else 16) | duration()


def monte_carlo(runs: int) -> dict[str, Figure]:
    """Averages over rooms of squared errors by covariances, and root mean squares."""
    told: dict[str, list[float]] = {}
    for seed in range(runs):
        for name, value in one_room(seed).items():
            told.setdefault(name, []).append(value)
        if seed % 5 == 4:
            say(f"marker_inertial: {seed + 1} of {runs} rooms")
    rows = {name: float(np.mean(values)) for name, values in told.items()}
    reference = f"1 is honest; {runs} rooms of {SECONDS:g} s"
    found = {
        f"marker_inertial_anees_{name}": Figure(rows[name], "x", reference, BAND, BAND)
        for name in ("map", *PARTS)
    }
    found["marker_inertial_anees_pose_filter"] = Figure(
        rows["filter"], "x", f"EKF-SLAM on the same data; the map's {rows['pose']:.2f}"
    )
    fused, alone, filtered = (np.sqrt(rows[k]) for k in ("fused_m2", "alone_m2", "filter_m2"))
    found["marker_inertial_place_mm"] = Figure(
        1e3 * fused, "mm", f"RMSE of the body; camera alone {1e3 * alone:.1f}, filter {1e3 * filtered:.1f}"
    )
    found["marker_inertial_place_over_camera_alone"] = Figure(
        fused / alone, "x", "RMSE with the IMU over without", 1.0, 0.5
    )
    found["marker_inertial_map_mm"] = Figure(
        1e3 * float(np.sqrt(rows["map_m2"])), "mm", "RMSE of a marker's place relative to the reference"
    )
    return found


def one_room(seed: int) -> dict[str, float]:
    """What one recording gives."""
    world, told, markers = recorded(seed, SECONDS, world={"flat": seed % 2 == 1}, sigma_px=SIGMA_PX)
    found, alone = mapped(world, told), mapped(world, told, imu=False)
    error = frame_errors(found, told.truth, markers, world)
    total, free = map_nees(found, markers)
    values = {"map": total / free}
    for name, s in PARTS.items():
        values[name] = float(nees(error[:, s], found.frame_covs[:, s, s]).mean() / (s.stop - s.start))
    values["fused_m2"] = float(np.mean(np.sum(error[:, 3:6] ** 2, axis=1)))
    lonely = frame_errors(alone, told.truth, markers, world)
    values["alone_m2"] = float(np.mean(np.sum(lonely[:, 3:6] ** 2, axis=1)))
    values["map_m2"] = float(np.mean(np.sum(map_error(found, markers)[:, 3:] ** 2, axis=1)))
    row = found.reference
    run = filter_markers(found.sightings, found.inertial, row, markers[row])
    kept = np.isfinite(run.poses[:, 0]) & (run.frames > 45)
    step = SE.local(run.poses[kept], told.truth.poses[run.frames[kept]])
    values["filter"] = float(nees(step, run.covs[kept, :6, :6]).mean() / 6.0)
    values["filter_m2"] = float(np.mean(np.sum(step[:, 3:] ** 2, axis=1)))
    return values


def duration() -> dict[str, Figure]:
    """A map of the camera alone: our chain with a border, GTSAM's native factors in its own optimiser."""
    world, told, markers = recorded(0, SECONDS)
    rng, sightings = np.random.default_rng(0), told.sightings
    camera = compose(told.truth.poses, world.body_T_camera)
    start = MapState(
        SE.retract(camera, 0.02 * rng.standard_normal((len(camera), 6))),
        np.vstack([markers[:1], SE.retract(markers[1:], 0.02 * rng.standard_normal((len(markers) - 1, 6)))]),
    )

    def ours():
        return MarkerMapGraph(sightings, SE.identity(), 0).solve(start)

    times = interleaved(
        {"ours": ours, "gtsam": lambda: by_gtsam(world.camera, sightings, start)},
        rounds=3,
    )
    theirs = by_gtsam(world.camera, sightings, start)
    apart = np.abs(SE.local(ours().state.markers, theirs)).max()
    said = ", ".join(f"{name} {1e3 * value:.0f} ms" for name, value in times.items())
    return {
        "marker_map_time_over_gtsam": Figure(
            times["ours"] / times["gtsam"], "x",
            f"ProjectionFactorPPP and Levenberg-Marquardt in C++: {said}; whole covariances against 2 by 2, "
            f"markers within {apart:.1e}",
        )
    }  # fmt: skip


def by_gtsam(camera, sightings, start):
    """The same sightings as native factors, corner by corner: poses of the markers."""
    fx, fy, cx, cy = camera.intrinsics
    lens = gtsam.Cal3DS2(np.array([fx, fy, 0.0, cx, cy, *camera.distortion]))
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for k, pose in enumerate(start.frames):
        values.insert(X(k), pose3(pose))
    for m, pose in enumerate(start.markers):
        values.insert(M(m), pose3(inverse(pose)))
    for k, corner in enumerate(marker_corners(float(sightings.size_m[0]))):
        values.insert(P(k), corner)
        graph.add(gtsam.PriorFactorPoint3(P(k), corner, gtsam.noiseModel.Isotropic.Sigma(3, 1e-7)))
    held = gtsam.noiseModel.Isotropic.Sigma(6, 1e-7)
    graph.add(gtsam.PriorFactorPose3(M(0), pose3(inverse(start.markers[0])), held))
    noise = gtsam.noiseModel.Isotropic.Sigma(2, float(np.sqrt(sightings.cov[0, 0, 0])))
    make = gtsam_unstable.ProjectionFactorPPPCal3DS2
    for s, (f, m) in enumerate(zip(sightings.frame.tolist(), sightings.marker.tolist(), strict=True)):
        for k in range(4):
            graph.add(make(sightings.corners[s, k], noise, M(m), X(f), P(k), lens))
    solved = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    flat = []
    for m in range(len(start.markers)):
        pose = solved.atPose3(M(m)).inverse()
        turn = pose.rotation().toQuaternion()
        flat.append([turn.w(), turn.x(), turn.y(), turn.z(), *pose.translation()])
    return SE.normalize(np.array(flat))
