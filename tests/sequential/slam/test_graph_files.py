"""Graph files: what is read is what was written, and what is wrong is named with its line."""

import numpy as np
import pytest
from graph_files import BOTH, looped

from sequential.errors import DataError, FileFormatError, NotFiniteError, NotPositiveDefiniteError
from sequential.manifold import SE2, SE3, rotation_matrix
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.files import graph_of, problem_of, read_city, read_graph, write_graph
from sequential.slam.models import Displacement, LandmarkRangeBearing

EYE6 = " ".join(["1" if k in (0, 6, 11, 15, 18, 20) else "0" for k in range(21)])


@pytest.fixture
def written(tmp_path):
    """Write lines to a file and give its path."""

    def write(*lines, name="graph.g2o"):
        path = tmp_path / name
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write


def full(rng, dim):
    """A covariance with all its correlations."""
    root = rng.standard_normal((dim, dim)) + 2 * np.eye(dim)
    return 0.01 * root @ root.T


@pytest.mark.parametrize("manifold", BOTH, ids=["plane", "space"])
@pytest.mark.parametrize("form", ["g2o", "toro"])
def test_what_is_written_is_read_again(manifold, form, rng, tmp_path):
    problem, truth = looped(manifold, rng, noise=full(rng, manifold.dim))
    values = Values({"x": np.arange(len(truth))}, {"x": manifold.normalize(truth)})
    before = graph_of(problem, values)
    write_graph(tmp_path / "graph", before, form=form)
    after = read_graph(tmp_path / "graph")
    np.testing.assert_array_equal(after.between.ids, before.between.ids)
    np.testing.assert_allclose(manifold.local(after.between.z, before.between.z), 0, atol=1e-14)
    np.testing.assert_allclose(after.between.information, before.between.information, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(manifold.local(after.vertices.rows["x"], truth), 0, atol=1e-14)
    assert after.fixed.tolist() == [0]
    again = problem_of(after)
    assert [len(group) for group in again.factors] == [len(group) for group in problem.factors]
    for one, other in zip(again.factors, problem.factors, strict=True):
        residual = other.model.errors(other.z, *(truth[column] for column in other.index.T))
        gap = one.model.errors(one.z, *(truth[column] for column in one.index.T)) - residual
        np.testing.assert_allclose(gap, 0, atol=1e-14)
    np.testing.assert_allclose(again.factors[1].covs(), problem.factors[1].covs(), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("axes", [2, 3])
def test_landmarks_in_the_frame_of_a_pose_are_read_again(axes, rng, tmp_path):
    manifold = BOTH[axes - 2]
    problem, truth = looped(manifold, rng, count=6, loops=0)
    index = np.array([[0, 0], [3, 0], [5, 1]])
    seen = Factors(Displacement(manifold), ("x", "l"), index, rng.normal(size=(3, axes)), full(rng, axes))
    whole = SlamProblem({**problem.kinds, "l": Displacement(manifold).measured}, (*problem.factors, seen))
    points = rng.normal(size=(2, axes))
    values = Values({"x": np.arange(6), "l": np.arange(2)}, {"x": truth, "l": points})
    write_graph(tmp_path / "graph.g2o", graph_of(whole, values))
    after = read_graph(tmp_path / "graph.g2o")
    np.testing.assert_array_equal(after.displacements.z, seen.z)
    np.testing.assert_array_equal(after.vertices.rows["l"], points)
    group = problem_of(after).factors[-1]
    np.testing.assert_array_equal(group.index, index)
    np.testing.assert_allclose(group.covs(), seen.covs(), rtol=1e-12)


def test_a_sensor_that_does_not_stand_in_the_body_is_taken_along(rng, written):
    pose, point = SE3().random(rng), rng.normal(size=3)
    mount = SE3().random(rng)
    information = np.linalg.inv(full(rng, 3))
    in_body = rotation_matrix(pose[:4]).T @ (point - pose[4:])
    seen = rotation_matrix(mount[:4]).T @ (in_body - mount[4:])
    numbers = [np.r_[row[4:], row[1:4], row[0]] for row in (pose, mount)]
    told = [
        " ".join(map(repr, row.tolist())) for row in (*numbers, point, seen, information[np.triu_indices(3)])
    ]
    path = written(
        f"VERTEX_SE3:QUAT 7 {told[0]}",
        f"VERTEX_TRACKXYZ 9 {told[2]}",
        f"PARAMS_SE3OFFSET 1 {told[1]}",
        f"EDGE_SE3_TRACKXYZ 7 9 1 {told[3]} {told[4]}",
    )
    problem = problem_of(read_graph(path))
    group = problem.factors[-1]
    error = group.model.errors(group.z, problem.start.at("x", group.index[:, 0]), point[None])
    np.testing.assert_allclose(error, 0, atol=1e-13)
    turn = rotation_matrix(mount[:4])
    np.testing.assert_allclose(
        turn.T @ group.covs()[0] @ turn, np.linalg.inv(information), rtol=1e-9, atol=1e-15
    )


def test_angles_of_toro_are_roll_pitch_yaw(written):
    path = written("EDGE3 0 1 1 2 3 0.1 0.2 0.3")
    z = read_graph(path).between.z[0]
    c, s = np.cos([0.1, 0.2, 0.3]), np.sin([0.1, 0.2, 0.3])
    Rx = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    Ry = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    Rz = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    np.testing.assert_allclose(rotation_matrix(z[:4]), Rz @ Ry @ Rx, atol=1e-15)
    np.testing.assert_array_equal(z[4:], [1, 2, 3])


def test_orders_of_weights(written):
    toro = read_graph(written("EDGE2 1 0 1 0 0 10 1 20 30 2 3")).between.information[0]
    np.testing.assert_array_equal(toro, [[10, 1, 2], [1, 20, 3], [2, 3, 30]])
    rows = read_graph(written("EDGE2 1 0 1 0 0 3.16 0 0 3.16 0 5")).between.information[0]
    np.testing.assert_array_equal(np.diag(rows), [3.16, 3.16, 5])
    upper = " ".join(str(k) if k in (1, 7, 12, 16, 19, 21) else "0" for k in range(1, 22))
    line = f"EDGE3 0 1 0 0 0 0 0 0 {upper}"
    turned = read_graph(written(line)).between.information[0]
    np.testing.assert_array_equal(np.diag(turned), [16, 19, 21, 1, 7, 12])
    as_gtsam = read_graph(written(line), weights="gtsam").between.information[0]
    np.testing.assert_array_equal(np.diag(as_gtsam), [1, 7, 12, 16, 19, 21])
    squared = read_graph(written(line), weights="square_root").between.information[0]
    np.testing.assert_array_equal(np.diag(squared), np.diag(turned) ** 2)
    cov = read_graph(written("ODOMETRY 0 1 1 0 0 0.01 0 0 0.04 0 0.25")).between.information[0]
    np.testing.assert_allclose(np.diag(cov), [100, 25, 4])


def test_bearing_and_range_of_toro(written):
    path = written("VERTEX2 0 1 1 0", "VERTEX2 1 2 1 0", "EDGE2 0 1 1 0 0", "BR 0 44 0.5 2 0.03 0.1")
    group = problem_of(read_graph(path)).factors[-1]
    assert group.model == LandmarkRangeBearing()
    assert group.z.tolist() == [[2.0, 0.5]]
    np.testing.assert_allclose(np.diag(group.covs()[0]), [0.01, 0.0009])


def test_vertices_may_be_numbered_as_they_like(written):
    path = written(
        "VERTEX_SE2 8646911284551352320 0 0 0",
        "VERTEX_SE2 17 1 0 0",
        "EDGE_SE2 17 8646911284551352320 1 0 0 1 0 0 1 0 1",
        "FIX 17",
    )
    graph = read_graph(path)
    problem = problem_of(graph)
    assert problem.factors[0].index.tolist() == [[0]]
    assert problem.factors[1].index.tolist() == [[0, 1]]
    poses = Values({"x": np.arange(2)}, {"x": np.array([[1.0, 2, 3], [4, 5, 0.6]])})
    moved = graph.with_vertices(poses)
    assert moved.vertices.index["x"].tolist() == [17, 8646911284551352320]


def test_strange_tags_are_counted(written):
    path = written("EDGE2 0 1 1 0 0", "EQUIV 0 1", "EQUIV 1 2", "# a comment", "", "CAM 3 4")
    assert read_graph(path).skipped == {"EQUIV": 2, "CAM": 1}


GOOD = ("VERTEX_SE2 0 0 0 0", "VERTEX_SE2 1 1 0 0")
WRONG = [
    ((*GOOD, "EDGE_SE2 0 1 1 0 x 1 0 0 1 0 1"), FileFormatError, "line 3: 'x' is not a number"),
    ((*GOOD, "EDGE_SE2 0 1 1 0 0 1 0 0 1 0"), FileFormatError, "line 3: EDGE_SE2 is followed by 11 numbers"),
    ((*GOOD, "EDGE_SE2 0 1 1 nan 0 1 0 0 1 0 1"), NotFiniteError, "line 3: a number is not finite"),
    ((*GOOD, "EDGE_SE2 0 7 1 0 0 1 0 0 1 0 1"), DataError, "line 3: .* no vertex 7"),
    ((*GOOD, "EDGE_SE2 0 1.5 1 0 0 1 0 0 1 0 1"), FileFormatError, "line 3: .* whole number, got '1.5'"),
    ((*GOOD, "EDGE_SE2 0 -1 1 0 0 1 0 0 1 0 1"), FileFormatError, "line 3: .* got -1"),
    ((*GOOD, "EDGE_SE2 1 1 1 0 0 1 0 0 1 0 1"), FileFormatError, "line 3: .* vertex 1 to itself"),
    ((*GOOD, "VERTEX_SE2 0 5 5 5"), FileFormatError, "line 3: vertex 0 stands in line 1"),
    ((*GOOD, "EDGE_SE2 0 1 1 0 0 1 0 0 -1 0 1"), NotPositiveDefiniteError, "line 3: .* eigenvalue -1"),
    ((*GOOD, "FIX 5"), DataError, "FIX names 5"),
    ((*GOOD, "1 2 3"), FileFormatError, "line 3: a line begins with a tag"),
    ((*GOOD, f"EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1 {EYE6}"), FileFormatError, "plane or in space"),
    ((f"EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 0 {EYE6}",), FileFormatError, "line 1: the quaternion is zero"),
    (("EDGE_SE3_TRACKXYZ 0 1 4 1 0 0 1 0 0 1 0 1",), DataError, "line 1: the edge names parameter 4"),
    (("ODOMETRY 0 1 1 0 0 0 0 0 0 0 0",), FileFormatError, "line 1: the covariance is not positive"),
    (("BR 0 1 0.1 3 0 1", "EDGE2 0 1 0 0 0"), FileFormatError, "line 1: .* BR must be positive"),
    (GOOD, DataError, "vertices and no edge"),
    (("", "# nothing"), FileFormatError, "no vertex and no edge"),
    (("CAM 1", "POINT 2"), FileFormatError, "it has CAM, POINT"),
]


@pytest.mark.parametrize(("lines", "error", "said"), WRONG, ids=[said[:30] for _, _, said in WRONG])
def test_what_is_wrong_is_named(lines, error, said, written):
    with pytest.raises(error, match=said):
        problem_of(read_graph(written(*lines)))


def test_formats_that_cannot_say_it(rng, tmp_path, written):
    seen = read_graph(written("EDGE2 0 1 1 0 0", "LANDMARK2 0 5 1 1 1 0 1", "BR 0 44 0.5 2 0.03 0.1"))
    with pytest.raises(DataError, match="TORO file holds poses against poses only"):
        write_graph(tmp_path / "a.graph", seen)
    with pytest.raises(DataError, match="no edge for range and bearing"):
        write_graph(tmp_path / "a.g2o", seen)
    problem, _ = looped(SE2(), rng)
    other = SlamProblem({"p": SE2()}, ())
    with pytest.raises(DataError, match="kind 'x'"):
        graph_of(other)
    with pytest.raises(DataError, match="form is one of"):
        write_graph(tmp_path / "a", graph_of(problem), form="json")
    assert list(tmp_path.iterdir()) == [tmp_path / "graph.g2o"]


def test_a_city_offers_two_readings(written):
    path = written("EDGE2 0 1 1 0 1 1 0 0", "EDGE2 1 1 2 0 2 1 0 0 5 6 7 ", name="city.txt")
    city = read_city(path)
    assert city.ids.tolist() == [[0, 1], [1, 2]]
    assert list(city.others) == [1]
    np.testing.assert_allclose(city.others[1], [[5, 6, 7 - 2 * np.pi]])
    for line, said in (
        ("EDGE2 0 1 1 0 2 1 0 0", "promises 2 readings"),
        ("EDGE2 0 1", "a line is"),
        ("", "no edge"),
    ):
        with pytest.raises(FileFormatError, match=said):
            read_city(written(line, name="city.txt"))
