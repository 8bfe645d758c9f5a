"""Planar monocular: what the files hold, and what a wrong one is told."""

import numpy as np
import pytest

from factorlab.datasets.planar_monocular import FOLDER, load_planar_monocular
from factorlab.graph.slam import BatchSlam
from sequential.errors import DataError


def test_the_recording_is_read_in_full(data_dir):
    (tour,) = load_planar_monocular(data_dir / FOLDER)
    first, odometry, camera = tour.problem.factors
    assert (len(first), len(odometry)) == (1, 335)
    assert len(tour.landmarks) == 1000
    assert len(camera) > 30_000
    assert "999" not in tour.notes[0]
    assert "points seen under less than 10° are left out" in tour.notes[0]


def test_pixels_are_where_the_truth_puts_them(data_dir):
    (tour,) = load_planar_monocular(data_dir / FOLDER)
    camera = tour.problem.factors[2]
    index = np.asarray(camera.index)
    pose = np.column_stack([tour.truth.position, tour.truth.heading])[index[:, 0]]
    place = np.stack([tour.landmarks[i] for i in index[:, 1].tolist()])
    off = np.abs(camera.model.errors(np.asarray(camera.z), pose, place))
    assert np.median(off) < 0.005
    assert off.max() < 1.0


def test_noise_is_added_on_request_and_said(data_dir):
    (clean,) = load_planar_monocular(data_dir / FOLDER, steps=5)
    (noisy,) = load_planar_monocular(data_dir / FOLDER, steps=5, pixel_noise=1.0, seed=4)
    (again,) = load_planar_monocular(data_dir / FOLDER, steps=5, pixel_noise=1.0, seed=4)
    added = np.asarray(noisy.problem.factors[2].z) - np.asarray(clean.problem.factors[2].z)
    assert added.std() == pytest.approx(1.0, rel=0.15)
    np.testing.assert_array_equal(noisy.problem.factors[2].z, again.problem.factors[2].z)
    assert "noise of 1 px added" in noisy.notes[1]
    assert noisy.problem.factors[2].covs()[0, 0, 0] > 1.0


def test_points_begin_by_parallax_and_the_batch_is_far_better_than_odometry(data_dir):
    (tour,) = load_planar_monocular(data_dir / FOLDER, steps=16)
    run = BatchSlam(**tour.graph_options, covariance=False).solve(tour.problem)
    x = run.values.rows["x"]
    assert np.linalg.norm(x[:, :2] - tour.truth.position, axis=1).max() < 0.1
    known = run.values.index["l"]
    off = np.linalg.norm(run.values.rows["l"] - np.stack([tour.landmarks[i] for i in known]), axis=1)
    assert len(known) == len(tour.problem.indices("l"))
    # One camera tells no scale: over sixteen steps the odometry knows it to 3 %.
    reach = np.linalg.norm(run.values.rows["l"], axis=1)
    assert np.median(off / reach) < 0.06


def write(folder, camera="", picture=""):
    """A recording of three pictures, one of them bad."""
    (folder / "camera.dat").write_text(
        camera
        or "camera matrix:\n180 0 320\n0 180 240\n0 0 1\ncam_transform:\n0 0 1 .2\n-1 0 0 0\n0 -1 0 0\n"
        "0 0 0 1\nz_near: 0\nz_far: 5\nwidth: 640\nheight: 480\n"
    )
    (folder / "world.dat").write_text("0 1 2 3\n")
    for k in range(3):
        text = picture if picture and k == 1 else f"seq: {k}\ngt_pose: {k} 0 0\nodom_pose: {k} 0 0\n"
        (folder / f"meas-{k:05d}.dat").write_text(text)


@pytest.mark.parametrize(
    ("camera", "picture", "said"),
    [
        ("camera matrix:\n180 0\n", "", "'camera matrix:' with 9 numbers"),
        ("", "seq: 1\ngt_pose: 0 0 0\n", "meas-00001.dat needs gt_pose:.*odom_pose"),
        ("", "gt_pose: 0 0 0\nodom_pose: 0 0 0\npoint 0 1 x 2\n", "meas-00001.dat"),
        ("", "", "no picture shows a point"),
    ],
)
def test_a_bad_file_is_named(tmp_path, camera, picture, said):
    write(tmp_path, camera, picture)
    with pytest.raises(DataError, match=said):
        load_planar_monocular(tmp_path)


def test_missing_files_are_told(tmp_path):
    with pytest.raises(DataError, match="FACTORLAB_DATA"):
        load_planar_monocular(tmp_path)
