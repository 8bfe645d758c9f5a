"""Graph files as problems, and problems as graph files."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.manifold import SE2, SE3, Vector, rotate, rotation_matrix
from sequential.slam.estimate import Values
from sequential.slam.files.graph_file import Edges, GraphFile, no_edges
from sequential.slam.problem import Factors, SlamProblem

__all__ = ["graph_of", "problem_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

HELD = 1e-8  # variance of what holds a graph in place, m² and rad²


def problem_of(graph: GraphFile) -> SlamProblem:
    """The problem of a graph file: kinds "x" (poses) and "l" (landmarks), numbered by rank.

    Loop closures stand in a group of their own beside the odometry, so that they can be weighed apart.  Poses
    under `FIX`, or else the first one, are held by a prior of variance 1e-8.

    Raises
    ------
    DataError, NotPositiveDefiniteError
        naming the line.
    """
    from sequential.slam.models import Between, Displacement, LandmarkRangeBearing, Prior

    poses, landmarks = graph.pose_ids(), graph.landmark_ids()
    if not len(graph.between) + len(graph.displacements) + len(graph.sightings):
        msg = f"{graph.where} holds vertices and no edge; there is nothing to estimate"
        raise DataError(msg)
    start = _start(graph, poses, landmarks)
    held = np.searchsorted(poses, graph.fixed[np.isin(graph.fixed, poses)])
    held = np.zeros(1, dtype=np.int64) if not len(held) else held
    known = start is not None and start.has("x", held).all()
    z = start.at("x", held) if start is not None and known else np.tile(graph.pose.identity(), (len(held), 1))
    groups = [Factors(Prior(graph.pose), ("x",), held[:, None], z, HELD, name="prior")]
    ends, cov = np.searchsorted(poses, graph.between.ids), graph.between.covariance(graph.where)
    step = np.abs(ends[:, 1] - ends[:, 0]) == 1
    for name, rows in (("odometry", step), ("loop", ~step)):
        if rows.any():
            noise = cov[rows] if np.ptp(cov[rows], axis=0).any() else cov[rows][0]
            groups.append(
                Factors(Between(graph.pose), ("x", "x"), ends[rows], graph.between.z[rows], noise, name=name)
            )
    seen, kinds = graph.displacements, {"x": graph.pose}
    if len(seen):
        index = np.column_stack(
            [np.searchsorted(poses, seen.ids[:, 0]), np.searchsorted(landmarks, seen.ids[:, 1])]
        )
        z, cov = _in_body(graph)
        groups.append(Factors(Displacement(graph.pose), ("x", "l"), index, z, cov, name="displacement"))
        kinds["l"] = graph.point
    if len(graph.sightings):
        rows = graph.sightings.ids
        index = np.column_stack([np.searchsorted(poses, rows[:, 0]), np.searchsorted(landmarks, rows[:, 1])])
        noise = graph.sightings.covariance(graph.where)
        groups.append(
            Factors(LandmarkRangeBearing(), ("x", "l"), index, graph.sightings.z, noise, name="range bearing")
        )
        kinds["l"] = graph.point
    return SlamProblem(kinds, tuple(groups), start=start)


def _start(graph: GraphFile, poses: Ints, landmarks: Ints) -> Values | None:
    """Vertices by rank, or None where the file has none."""
    ids = {"x": poses, "l": landmarks}
    known = {kind: index for kind, index in graph.vertices.index.items() if len(index)}
    if not known:
        return None
    ranks = {kind: np.searchsorted(ids[kind], index) for kind, index in known.items()}
    return Values(ranks, {kind: graph.vertices.rows[kind] for kind in known})


def _in_body(graph: GraphFile) -> tuple[Array, Array]:
    """Displacements and covariances in the frame of the body: a sensor's mount is known, so turn them."""
    seen, cov = graph.displacements, graph.displacements.covariance(graph.where)
    if graph.body_T_sensor is None:
        return seen.z, cov
    mount = graph.body_T_sensor
    turn = rotation_matrix(mount[:, :4])
    return mount[:, 4:] + rotate(mount[:, :4], seen.z), turn @ cov @ np.swapaxes(turn, 1, 2)


def graph_of(problem: SlamProblem, values: Values | None = None, where: str = "the problem") -> GraphFile:
    """What a file can hold of a problem: poses against poses, landmarks in the frame of a pose.

    Parameters
    ----------
    values : of the vertices; by default those that the problem begins from

    Raises
    ------
    DataError
        naming a group that no tag of g2o can hold.
    """
    from sequential.slam.models import Between, Displacement, LandmarkRangeBearing, Prior

    pose = problem.kinds.get("x")
    if not isinstance(pose, SE2 | SE3):
        msg = f"a graph file holds poses of kind 'x' on SE2 or SE3; {where} has {pose!r}"
        raise DataError(msg)
    axes = 2 if isinstance(pose, SE2) else 3
    between, seen, sightings = no_edges(pose.size, pose.dim), no_edges(axes, axes), no_edges(2, 2)
    fixed: list[int] = []
    for group in problem.factors:
        if isinstance(group.model, Prior) and group.slots == ("x",):
            fixed += np.asarray(group.index)[:, 0].tolist()
        elif isinstance(group.model, Between) and group.slots == ("x", "x"):
            between = _joined(between, group)
        elif isinstance(group.model, Displacement) and not np.any(group.model.body_p_sensor):
            seen = _joined(seen, group)
        elif isinstance(group.model, LandmarkRangeBearing):
            sightings = _joined(sightings, group)
        else:
            name = group.name or type(group.model).__name__
            msg = f"no tag of g2o says what {name!r} ({type(group.model).__name__}) measures"
            raise DataError(msg)
    held = problem.start if values is None else values
    kept = {k: held.index[k] for k in ("x", "l") if k in held.index} if held is not None else {}
    rows = {k: held.rows[k] for k in kept} if held is not None else {}
    point = Vector(axes)
    vertices = Values(
        {"x": kept.get("x", np.zeros(0, np.int64)), "l": kept.get("l", np.zeros(0, np.int64))},
        {"x": rows.get("x", np.zeros((0, pose.size))), "l": rows.get("l", np.zeros((0, point.size)))},
    )
    return GraphFile(where, axes, vertices, between, seen, sightings, None, np.array(sorted(fixed), np.int64))


def _joined(edges: Edges, group: Factors) -> Edges:
    """One group more, in the order of the problem."""
    line = np.arange(len(edges), len(edges) + len(group), dtype=np.int64) + 1
    return Edges(
        np.concatenate([edges.ids, np.asarray(group.index)]),
        np.concatenate([edges.z, np.asarray(group.z)]),
        np.concatenate([edges.information, np.linalg.inv(group.covs())]),
        np.concatenate([edges.line, line]),
    )
