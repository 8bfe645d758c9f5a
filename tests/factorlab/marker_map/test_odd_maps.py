"""Markers seen once, never together, in one plane, twice, under a wrong number; clocks that disagree."""

from dataclasses import replace

import numpy as np
import pytest
from marker_map_worlds import map_error, mapped, recorded

from factorlab.marker_map import Inertial, map_markers
from factorlab.marker_map.job import MapJob, MapSettings
from factorlab.marker_map.verdicts import map_verdicts
from sequential.errors import DataError
from sequential.manifold import SE3
from vision3d.markers import MarkerSightings


def verdicts(found):
    return {one.metric: one for one in map_verdicts(MapJob("v", MapSettings(0.12), found, 10, "4x4_50"))}


def relabelled(sightings, rows, number):
    """The same sightings, those of `rows` read under another number."""
    ids = np.unique(np.append(sightings.ids, number))
    named = sightings.ids[sightings.marker].copy()
    named[rows] = number
    return replace(
        sightings, ids=ids, size_m=np.full(len(ids), sightings.size_m[0]),
        marker=np.searchsorted(ids, named), doubles=np.zeros(len(ids), dtype=np.int64),
    )  # fmt: skip


def test_a_marker_seen_once_is_placed_and_said():
    world, told, markers = recorded(0)
    sightings = told.sightings
    rows = np.flatnonzero(sightings.marker == 2)
    once = sightings.keep(~np.isin(np.arange(len(sightings)), np.delete(rows, 5)))
    found = mapped(world, told, imu=False, sightings=once)
    assert found.placed[2]
    assert np.abs(map_error(found, markers)[2, 3:]).max() < 0.1
    assert found.marker_covs[2, 5, 5] > 4 * found.marker_covs[1, 5, 5]
    assert verdicts(found)["seen once"].verdict == "WARN"
    assert str(sightings.ids[2]) in verdicts(found)["seen once"].meaning


def test_markers_in_one_plane_are_mapped_and_said():
    world, told, markers = recorded(1, world={"flat": True})
    found = mapped(world, told, imu=False)
    assert found.flat
    assert np.abs(map_error(found, markers)[:, 3:]).max() < 8e-3
    assert "one plane" in verdicts(found)
    assert not mapped(*recorded(1)[:2], imu=False).flat


@pytest.mark.parametrize("imu", [True, False])
def test_two_prints_of_one_number_are_rejected_by_name(imu):
    world, told, _ = recorded(2)
    sightings = told.sightings
    wrong, right = 3, 1  # every other frame shows the second print, read under the other's number
    other = sightings.frame % 2 == 0
    rows = np.flatnonzero((sightings.marker == wrong) & other)
    kept = ~(((sightings.marker == right) & other) | ((sightings.marker == wrong) & ~other))
    twice = relabelled(sightings, rows, int(sightings.ids[right])).keep(kept)
    second = np.isin(np.flatnonzero(kept), rows)
    found = mapped(world, told, imu=imu, sightings=twice)
    row = int(np.searchsorted(twice.ids, sightings.ids[right]))
    assert not found.gated.taken[second].any()
    assert not found.gated.sound[row]
    assert verdicts(found)[f"marker {sightings.ids[right]}"].verdict == "WARN"


def test_a_number_read_where_there_is_none_is_rejected():
    world, told, markers = recorded(3)
    sightings = told.sightings
    rng = np.random.default_rng(1)
    rows = rng.choice(np.flatnonzero(sightings.marker == 0), 30, replace=False)
    ghost = relabelled(sightings, rows, 49)  # a number that hops over several places
    moved = ghost.corners.copy()
    moved[rows] += rng.uniform(-60, 60, (len(rows), 1, 2))
    found = mapped(world, told, sightings=replace(ghost, corners=moved))
    row = int(np.flatnonzero(ghost.ids == 49)[0])
    assert not found.placed[row]
    assert not found.gated.sound[row]
    assert "marker 49" in verdicts(found)
    keep = np.delete(np.arange(len(ghost.ids)), row)
    rest = replace(found, placed=found.placed & (np.arange(len(ghost.ids)) != row))
    every = np.insert(markers, row, [1, 0, 0, 0, 0, 0, 0], axis=0)
    assert np.abs(map_error(rest, every)[:, 3:]).max() < 8e-3
    assert found.placed[keep].all()


def test_a_marker_that_moved_is_rejected_by_name():
    world, told, _ = recorded(4)
    sightings, number = told.sightings, int(told.sightings.ids[1])
    pose = SE3().retract(world.markers[number], np.array([0.1, 0, 0.2, 0.08, 0.05, 0.0]))
    later = replace(world, markers={number: pose})
    corners = sightings.corners.copy()
    rows = np.flatnonzero((sightings.marker == 1) & (sightings.frame > 40))
    for row in rows:
        exact = dict(later.visible(told.truth.poses[sightings.frame[row]]))
        corners[row] = exact.get(number, corners[row])
    found = mapped(world, told, imu=False, sightings=replace(sightings, corners=corners))
    assert not found.gated.sound[1]
    assert found.gated.share[1] > 0.3
    assert "it was moved" in verdicts(found)[f"marker {number}"].meaning


def apart(sightings, first, second):
    """Frames show either the markers `first` or the markers `second`, in turns of one second."""
    turn = (sightings.t[sightings.frame] * 1e-9 // 1.0) % 2 == 0
    return sightings.keep(np.where(turn, np.isin(sightings.marker, first), np.isin(sightings.marker, second)))


def test_markers_never_seen_together_are_tied_by_the_imu_only():
    world, told, markers = recorded(5, 8.0)
    two = apart(told.sightings, [0, 2, 3], [1, 4, 5, 6, 7])
    alone = mapped(world, told, imu=False, sightings=two)
    assert 0 < alone.placed.sum() < 8
    assert verdicts(alone)["markers placed"].verdict == "WARN"
    fused = mapped(world, told, sightings=two)
    assert fused.placed.all()
    assert np.abs(map_error(fused, markers)[:, 3:]).max() < 0.06
    sigma = np.sqrt(np.trace(fused.marker_covs[:, 3:, 3:], axis1=1, axis2=2))
    assert (np.linalg.norm(map_error(fused, markers)[:, 3:], axis=1) < 4.5 * sigma + 1e-6).all()


def test_no_sighting_and_an_unseen_reference_are_refused():
    _world, told, _ = recorded(6, 1.0)
    none = told.sightings.keep(np.zeros(len(told.sightings), dtype=np.bool_))
    with pytest.raises(DataError, match="no marker was seen"):
        map_markers(none)
    with pytest.raises(DataError, match="marker 11 was not seen"):
        map_markers(told.sightings, reference=11)


def test_the_reference_is_the_one_asked_for():
    _world, told, _ = recorded(6, 2.0)
    found = map_markers(told.sightings, reference=int(told.sightings.ids[2]))
    np.testing.assert_allclose(found.poses[2], [1, 0, 0, 0, 0, 0, 0], atol=1e-12)
    assert not found.marker_covs[2].any()


def test_one_marker_alone_is_a_map():
    world, told, _ = recorded(7, 2.0)
    sightings = told.sightings
    one = sightings.keep(sightings.marker == 1)
    found = mapped(world, told, sightings=one)
    assert found.ids.tolist() == [int(sightings.ids[1])]
    assert found.flat


def test_corners_worse_than_they_claim_widen_the_covariance():
    world, told, _ = recorded(8, 3.0)
    optimistic = replace(told.sightings, cov=told.sightings.cov / 9.0)
    found, honest = (mapped(world, told, imu=False, sightings=one) for one in (optimistic, told.sightings))
    assert found.scale == pytest.approx(9.0, rel=0.15)
    np.testing.assert_allclose(found.joint, honest.joint * found.scale / 9.0, rtol=0.05, atol=1e-8)


def test_a_frame_that_reads_a_number_twice_keeps_the_larger():
    from vision3d.markers import Marker

    world = recorded(0, 0.5)[0]
    small, large = (np.array([[0, 0], [s, 0], [s, s], [0, s]]) + 100.0 for s in (20.0, 40.0))
    markers = [Marker(5, corners, np.array(0.2)) for corners in (small, large)]
    sightings = MarkerSightings.from_frames(world.camera, 0.12, [(0, markers)])
    assert len(sightings) == 1
    np.testing.assert_array_equal(sightings.corners[0], large)
    assert sightings.doubles.tolist() == [1]


def test_an_imu_that_ends_early_carries_what_it_covers():
    world, told, markers = recorded(9)
    imu = told.imu.select(told.imu.t < 3_000_000_000)
    found = map_markers(told.sightings, Inertial(imu, world.body_T_camera))
    assert found.placed.all()
    assert len(found.frames) == len(told.sightings.t)
    assert np.abs(map_error(found, markers)[:, 3:]).max() < 0.02
    assert np.isfinite(found.frame_covs).all()
    assert verdicts(found)["without IMU"].value == pytest.approx(50.0, abs=5.0)
