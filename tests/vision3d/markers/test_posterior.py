"""What the posterior claims, by Monte Carlo: rarely wrong when called certain, with honest covariances."""

import numpy as np
import pytest
from marker_worlds import PINHOLE, SIZE_M, corners_of, tilted

from sequential.manifold import SE3
from vision3d.markers import marker_pose

SE = SE3()
SIGMA_PX = 0.3


def trial(side_px, tilt, rng):
    """Whether it was certain, whether it was wrong by three degrees or more, NEES of the nearest branch."""
    truth = tilted(side_px, tilt, rng)
    found = marker_pose(
        PINHOLE, corners_of(PINHOLE, truth) + rng.normal(0.0, SIGMA_PX, (4, 2)), SIZE_M, SIGMA_PX
    )
    steps = [SE.local(mode.camera_T_marker, truth) for mode in found.modes]
    angles = [np.linalg.norm(step[:3]) for step in steps]
    k = int(np.argmin(angles))
    wrong = angles[0] - angles[k] > np.radians(3.0)
    return found.certain, wrong, steps[k] @ np.linalg.solve(found.modes[k].cov, steps[k])


@pytest.mark.slow
@pytest.mark.parametrize("side_px", [30, 60, 120])
@pytest.mark.parametrize("tilt", [5, 20, 60])
def test_branches_and_covariances_are_honest(side_px, tilt, rng, seeds):
    n = 4 * len(seeds)
    certain, wrong, nees = map(np.array, zip(*(trial(side_px, tilt, rng) for _ in range(n)), strict=True))
    assert (certain & wrong).sum() <= 0.01 * n + 3.0 * np.sqrt(0.01 * n)
    spread = 4.0 * np.sqrt(2.0 * 6.0 / n) / 6.0
    assert 0.85 - spread < nees.mean() / 6.0 < 1.15 + spread
    if side_px == 120 and tilt >= 10:
        assert certain.mean() >= 0.95


def test_odds_fall_as_the_marker_turns_to_the_camera(rng):
    """With exact corners: far apart where tilted, one where the two readings meet."""
    odds = [
        marker_pose(PINHOLE, corners_of(PINHOLE, tilted(40.0, tilt, rng)), SIZE_M, 0.5).odds
        for tilt in (50.0, 30.0, 15.0)
    ]
    assert odds[0] > odds[1] > odds[2] > 1.0


def test_merged_modes_are_one_gaussian_with_their_moments(rng):
    corners = corners_of(PINHOLE, tilted(30.0, 20, rng)) + rng.normal(0.0, 0.3, (4, 2))
    found = marker_pose(PINHOLE, corners, SIZE_M, 0.3)
    assert len(found.modes) == 2
    mean, cov = found.merged
    steps = [SE.local(mean, mode.camera_T_marker) for mode in found.modes]
    weights = [mode.probability for mode in found.modes]
    assert np.abs(weights[0] * steps[0] + weights[1] * steps[1]).max() < 1e-4
    assert (
        np.linalg.eigvalsh(cov - sum(w * np.outer(s, s) for w, s in zip(weights, steps, strict=True))).min()
        > 0
    )
