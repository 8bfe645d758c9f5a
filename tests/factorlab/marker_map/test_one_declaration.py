"""The same sightings declared for the general solvers of SLAM problems end in the same map."""

import numpy as np
from marker_map_worlds import mapped, recorded

from factorlab.graph.slam import BatchSlam
from sequential.manifold import SE3
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import MarkerCorners, Prior
from vision3d.rigid import compose

SE = SE3()


def test_the_general_batch_ends_in_the_same_map():
    """Whole covariances of corners, any lens: `MarkerCorners` by the batched route."""
    world, told, _ = recorded(0, 2.0, sigma_px=0.2)
    found = mapped(world, told, imu=False)
    sightings = told.sightings
    corners = Factors(
        MarkerCorners(world.camera, world.size_m), ("x", "m"),
        np.column_stack([sightings.frame, sightings.marker]), sightings.corners.reshape(-1, 8), sightings.cov,
        name="corners",
    )  # fmt: skip
    row = found.reference
    held = Factors(Prior(SE), ("m",), [[row]], found.poses[row : row + 1], 1e-14 * np.eye(6))
    near = SE.retract(found.trajectory, 1e-3 * np.ones((len(found.frames), 6)))
    start = Values(
        {"x": found.frames, "m": np.arange(len(found.poses))}, {"x": near, "m": found.poses.copy()}
    )
    run = BatchSlam(initial="given").solve(SlamProblem({"x": SE, "m": SE}, (corners, held), start=start))
    np.testing.assert_allclose(SE.local(found.poses, run.values.rows["m"]), 0.0, atol=1e-5)
    np.testing.assert_allclose(SE.local(found.trajectory, run.values.rows["x"]), 0.0, atol=1e-4)
    spread = np.array([run.covs["m"][k] for k in range(len(found.poses)) if k != row])
    own = np.delete(found.marker_covs, row, axis=0)
    np.testing.assert_allclose(spread, own, atol=2e-3 * np.abs(own).max())


def test_the_placing_of_the_model_is_that_of_the_modes():
    """A frame is placed by a marker, and the marker by the frame, where the map has them."""
    world, told, _ = recorded(1, 1.0, sigma_px=0.05)
    found = mapped(world, told, imu=False)
    model, sightings = MarkerCorners(world.camera, world.size_m), told.sightings
    rows = np.flatnonzero([pose is not None and pose.odds > 1e3 for pose in sightings.poses])[:10]
    z = sightings.corners[rows].reshape(-1, 8)
    frames = found.trajectory[np.searchsorted(found.frames, sightings.frame[rows])]
    placed = model.place(1, z, frames, None)
    apart = SE.local(found.poses[sightings.marker[rows]], placed)
    assert np.abs(apart[:, 3:]).max() < 0.05
    np.testing.assert_allclose(
        compose(model.place(0, z, None, placed), np.array([1.0, 0, 0, 0, 0, 0, 0])), frames, atol=1e-3
    )
