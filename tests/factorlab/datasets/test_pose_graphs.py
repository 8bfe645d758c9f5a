"""Pose graphs that everybody quotes: their counts, where they end, what their truth says of their weights."""

from dataclasses import replace

import numpy as np
import pytest

from factorlab.datasets import load_slam
from factorlab.datasets.city10000 import choose_readings
from factorlab.datasets.pose_graphs import load_graph_file
from factorlab.graph.slam import BatchSlam, GncSlam
from factorlab.graph.slam.rows import Rows
from sequential.errors import DataError
from sequential.manifold import SE2
from sequential.slam.files import CityGraph
from sequential.slam.initial import initial_poses
from sequential.slam.models.groups import between


def solved(dataset, **options):
    """The batch from the dataset's own start."""
    return BatchSlam(**{**dataset.graph_options, "covariance": False, **options}).solve(dataset.problem)


def group(dataset, name):
    """The measurements of that name."""
    return next(one for one in dataset.problem.factors if one.name == name)


@pytest.mark.parametrize(
    ("name", "poses", "loops", "chi2"), [("intel", 1728, 785, 45.0042), ("mit", 808, 20, 41.2069)]
)
def test_final_cost(name, poses, loops, chi2, data_dir):
    (dataset,) = load_slam(name, data=data_dir / "pose_graph")
    assert len(dataset.problem.indices("x")) == poses
    assert len(group(dataset, "loop")) == loops
    assert solved(dataset).report.details["chi2"] == pytest.approx(chi2, rel=1e-5)


def test_mit_has_a_worse_minimum_beside_the_odometry(data_dir):
    (dataset,) = load_slam("mit", data=data_dir / "pose_graph")
    found = solved(dataset, initial="odometry", method="levenberg_marquardt", check=False)
    assert found.report.details["chi2"] == pytest.approx(770.239, rel=1e-5)
    for initial in ("chordal", "tree"):
        assert solved(dataset, initial=initial).report.details["chi2"] == pytest.approx(41.2069, rel=1e-5)


def test_intel_with_false_loops(data_dir):
    """30 % of the loop closures are false; their poses never met."""
    rng = np.random.default_rng(2)
    (dataset,) = load_slam("intel", data=data_dir / "pose_graph")
    problem, loop = dataset.problem, group(dataset, "loop")
    pairs = np.sort(rng.integers(0, 1728, (400, 2)), axis=1)
    pairs = pairs[pairs[:, 1] - pairs[:, 0] > 1][:336]
    z = SE2().random(rng, shape=(336,))
    false = replace(
        loop, index=pairs, z=z, noise_cov=loop.covs()[rng.integers(0, len(loop), 336)], name="false"
    )
    result = GncSlam(covariance=False).solve_weighted(replace(problem, factors=(*problem.factors, false)))
    clean = solved(dataset).values.rows["x"]
    off = np.hypot(*(result.run.values.rows["x"] - clean)[:, :2].T)
    assert (result.weights[-1] == 0).all()
    assert sum((weights < 1).sum() for weights in result.weights[:-1]) <= 5
    assert np.sqrt(np.mean(off**2)) < 0.02  # the odometry alone is a metre off


def test_sphere_is_weighed_as_isam_wrote_it():
    """Errors at the truth are what square roots of information say; GTSAM takes them for something else."""
    as_gtsam, as_isam = load_slam("sphere2500")
    assert (as_gtsam.name, as_isam.name) == ("sphere2500", "sphere2500_isam")
    manifold = as_isam.problem.kinds["x"]
    poses = np.hstack([as_isam.truth.quaternion, as_isam.truth.position])
    for name in ("odometry", "loop"):
        edges = group(as_isam, name)
        exact = between(manifold, *(poses[column] for column in edges.index.T))
        error = manifold.local(exact, edges.z)
        np.testing.assert_allclose(error.std(axis=0), np.sqrt(np.diag(edges.covs()[0])), rtol=0.06)
    found = np.diag(np.linalg.inv(group(as_gtsam, "loop").covs()[0]))
    np.testing.assert_allclose(found, [10, 10, 10, 100, 100, 25])


def test_w10000_begins_next_to_its_end():
    (dataset,) = load_slam("w10000")
    start = initial_poses(dataset.problem, "lago")
    assert len(group(dataset, "loop")) == 54312
    index = {"x": dataset.problem.indices("x")}
    assert 2.0 * Rows(dataset.problem, index).cost(start) < 1.001 * 289.735


def test_city_and_its_truth():
    (dataset,) = load_slam("city10000")
    assert dataset.notes[0] == "200 steps have two readings; loop closures alone tell 200 of them apart."
    truth = np.column_stack([dataset.truth.position, dataset.truth.heading])
    for edges in dataset.problem.factors[1:]:
        exact = between(SE2(), *(truth[column] for column in edges.index.T))
        error = SE2().local(exact, edges.z)
        np.testing.assert_allclose(error.std(axis=0), np.sqrt(np.diag(edges.covs()[0])), rtol=0.03)
        assert np.abs(error).max() < 0.1


def small_city():
    """A square walked twice, with two doubtful steps through a pose that nothing else sees."""
    corner = np.array([1.0, 0.0, np.pi / 2])
    ids = [(k, k + 1) for k in range(9)] + [(k, k + 4) for k in (0, 1, 3, 4, 5)]
    z = np.array([corner] * 9 + [[0.0, 0.0, 0.0]] * 5)
    wrong = np.array([[5.0, 2.0, 1.0]])
    return np.array(ids), z, {1: wrong, 2: corner[None], 6: wrong}


def test_readings_are_told_by_where_they_lead():
    ids, z, others = small_city()
    ids, z = np.delete(ids, 10, axis=0), np.delete(z, 10, axis=0)  # nothing sees pose 2 but its two steps
    z[2] = [5.0, 2.0, 1.0]
    chosen, told = choose_readings(CityGraph(ids, z, others))
    np.testing.assert_allclose(chosen[[1, 2, 6]], np.tile([1.0, 0.0, np.pi / 2], (3, 1)))
    assert told == 3
    keep = np.r_[0:9, 9:12]
    with pytest.raises(DataError, match="pose 9 has only edges with several readings"):
        choose_readings(CityGraph(ids[keep], z[keep], {8: others[1]}))


def test_a_file_of_ones_own(tmp_path):
    path = tmp_path / "mine.g2o"
    path.write_text(
        "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nVERTEX_SE2 2 2 0 0\nVERTEX_XY 9 1 1\nCAM 7\n"
        "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\nEDGE_SE2 0 2 2 0 0.1 1 0 0 1 0 1\n"
        "EDGE_SE2_XY 0 9 1 1 1 0 1\n",
        encoding="utf-8",
    )
    dataset = load_graph_file(path)
    assert dataset.title == "mine: a graph file; 3 poses, 1 landmarks, 1 loop closures"
    assert "CAM (1)" in dataset.notes[1]
    assert dataset.problem.start is None
    run = solved(dataset)
    assert len(run.values.rows["l"]) == 1
    with pytest.raises(DataError, match=r"there is no file .*mine.g2p; did you mean"):
        load_graph_file(tmp_path / "mine.g2p")


def test_missing_files_say_where_they_come_from(tmp_path):
    with pytest.raises(DataError, match="SE-Sync"):
        load_slam("intel", data=tmp_path)
    with pytest.raises(DataError, match="gtsam wheel"):
        load_slam("city10000", data=tmp_path)
