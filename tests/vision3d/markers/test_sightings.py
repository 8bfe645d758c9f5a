"""Sightings over frames: order, doubles, sizes, and what keeping some of them keeps."""

import numpy as np
import pytest
from marker_worlds import PINHOLE, SIZE_M, corners_of, tilted

from sequential.errors import DataError, ShapeError, TimeOrderError
from vision3d.markers import Marker, MarkerSightings


def markers(rng, *numbers):
    return [Marker(number, corners_of(PINHOLE, tilted(60.0, 35.0, rng)), np.array(0.2)) for number in numbers]


@pytest.fixture
def three(rng):
    return MarkerSightings.from_frames(
        PINHOLE, SIZE_M, [(0, markers(rng, 9, 4)), (50, []), (100, markers(rng, 4, 12))]
    )


def test_rows_name_frames_and_markers(three):
    assert three.ids.tolist() == [4, 9, 12]
    assert three.frame.tolist() == [0, 0, 2, 2]
    assert three.marker.tolist() == [0, 1, 0, 2]
    assert three.counts.tolist() == [2, 1, 1]
    assert three.points.shape == (4, 4, 3)
    assert not three.corners.flags.writeable


def test_each_marker_may_have_its_size(rng):
    frames = [(0, markers(rng, 4, 9))]
    told = MarkerSightings.from_frames(PINHOLE, {4: 0.2, -1: 0.1}, frames)
    assert told.size_m.tolist() == [0.2, 0.1]
    np.testing.assert_allclose(np.ptp(told.points[:, :, 0], axis=1), [0.2, 0.1])
    with pytest.raises(DataError, match="marker 9 has no size"):
        MarkerSightings.from_frames(PINHOLE, {4: 0.2}, frames)


def test_what_is_kept_keeps_its_poses(three):
    whole = three.poses
    kept = np.array([True, False, True, False])
    fewer = three.keep(kept)
    assert fewer.poses == (whole[0], whole[2])
    assert fewer.ids.tolist() == three.ids.tolist()
    assert three.shifted(1.5).poses is whole
    assert three.shifted(1.5).t.tolist() == [1_500_000_000, 1_500_000_050, 1_500_000_100]
    assert three.wider(1.0) is three
    np.testing.assert_allclose(three.wider(4.0).cov, 4.0 * three.cov)


def test_frames_out_of_order_and_wrong_shapes_are_refused(three, rng):
    with pytest.raises(TimeOrderError, match="frame 1 is at"):
        MarkerSightings.from_frames(PINHOLE, SIZE_M, [(100, markers(rng, 1)), (50, markers(rng, 1))])
    with pytest.raises(ShapeError, match=r"corners \(4, 4, 2\)"):
        MarkerSightings(
            PINHOLE, three.t, three.ids, three.size_m, three.frame, three.marker, three.corners[:2],
            three.cov, three.doubles,
        )  # fmt: skip
