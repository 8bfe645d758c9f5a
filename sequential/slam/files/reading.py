"""Graph files read: a bad line and a missing vertex are named with the line, strange tags are counted."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError, NotFiniteError
from sequential.readers.files import read_text
from sequential.slam.estimate import Values
from sequential.slam.files.graph_file import Edges, GraphFile, no_edges
from sequential.slam.files.tags import KNOWN, Tag
from sequential.slam.files.weights import WEIGHTS, pose_rows, weight_matrices

__all__ = ["read_graph"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(slots=True)
class Lines:
    """All lines of one tag."""

    numbers: list[int] = field(default_factory=list)  # where they stand in the file
    ids: list[list[int]] = field(default_factory=list)
    values: list[list[float]] = field(default_factory=list)


def read_graph(path: str | os.PathLike[str], *, weights: str = "auto") -> GraphFile:
    """Read a g2o or TORO graph, in the plane or in space.

    Parameters
    ----------
    weights : what the numbers after a measurement are:
        `"auto"`, information, but a covariance after `ODOMETRY` and `LANDMARK`;
        `"information"`, `"covariance"`, `"square_root"` (iSAM's: R of RᵀR = information) everywhere;
        `"gtsam"`, as `gtsam.load3D` reads `EDGE3`: information, rotation before translation

    Returns
    -------
    GraphFile
        quaternions scalar first, weights in our chart.  A g2o file weighs the vector part of a quaternion;
        it is taken for a rotation vector here, as GTSAM and SE-Sync do.

    Raises
    ------
    DataError, FileFormatError, NotFiniteError
        naming the line.
    """
    if weights not in WEIGHTS:
        msg = f"weights is one of {', '.join(WEIGHTS)}, got {weights!r}"
        raise DataError(msg)
    where = os.fspath(path)
    lines, skipped = _sorted_by_tag(read_text(path), where)
    axes = _axes(lines, where, skipped)
    poses, lines_of_poses = _vertices(lines, "vertex", axes, where)
    points, _ = _vertices(lines, "point", axes, where)
    tables = {
        what: _edges(lines, what, axes, weights, where) for what in ("between", "displacement", "sighting")
    }
    body_T_sensor = _offsets(lines, where) if axes == 3 else None
    graph = GraphFile(
        where=where,
        axes=axes,
        vertices=Values({"x": poses[0], "l": points[0]}, {"x": poses[1], "l": points[1]}),
        between=tables["between"],
        displacements=tables["displacement"],
        sightings=tables["sighting"],
        body_T_sensor=body_T_sensor,
        fixed=np.array([i for (i,) in lines["FIX"].ids] if "FIX" in lines else [], dtype=np.int64),
        skipped=dict(skipped),
    )
    if lines_of_poses:
        _require_vertices(graph, lines)
    return graph


def _sorted_by_tag(text: str, where: str) -> tuple[dict[str, Lines], Counter[str]]:
    """Lines of known tags as numbers; how many there are of the others."""
    lines: dict[str, Lines] = {}
    skipped: Counter[str] = Counter()
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        tag = KNOWN.get(words[0])
        if tag is None:
            if not words[0][0].isalpha():
                msg = f"{where}, line {number}: a line begins with a tag such as EDGE_SE2, got {words[0]!r}"
                raise FileFormatError(msg)
            skipped[words[0]] += 1
            continue
        table = lines.setdefault(words[0], Lines())
        for ids, values in _parsed(tag, words, f"{where}, line {number}"):
            table.numbers.append(number)
            table.ids.append(ids)
            table.values.append(values)
    return lines, skipped


def _parsed(tag: Tag, words: list[str], where: str) -> list[tuple[list[int], list[float]]]:
    """The numbers of one line; more than one entry where `FIX` names several."""
    count = len(words) - 1
    if tag.does == "fix":
        return [([_whole(word, where)], []) for word in words[1:]]
    if count not in tag.lengths():
        expected = " or ".join(map(str, tag.lengths()))
        msg = f"{where}: {words[0]} is followed by {expected} numbers, this line has {count}"
        raise FileFormatError(msg)
    ids = [_whole(word, where) for word in words[1 : 1 + tag.ids]]
    try:
        values = list(map(float, words[1 + tag.ids :]))
    except ValueError:
        bad = next(word for word in words[1 + tag.ids :] if not _is_number(word))
        msg = f"{where}: {bad!r} is not a number"
        raise FileFormatError(msg) from None
    if not np.isfinite(sum(values)):
        msg = f"{where}: a number is not finite; drop the line, or mend what wrote it"
        raise NotFiniteError(msg)
    if tag.does == "between" and ids[0] == ids[1]:
        msg = f"{where}: the edge joins vertex {ids[0]} to itself; drop it"
        raise FileFormatError(msg)
    return [(ids, values)]


def _whole(word: str, where: str) -> int:
    try:
        number = int(word)
    except ValueError:
        msg = f"{where}: a vertex is numbered by a whole number, got {word!r}"
        raise FileFormatError(msg) from None
    if not 0 <= number < 2**63:
        msg = f"{where}: a vertex is numbered from 0 to 2⁶³-1, got {word}"
        raise FileFormatError(msg)
    return number


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _axes(lines: dict[str, Lines], where: str, skipped: Counter[str]) -> int:
    """2 or 3; raises where the file holds both, or neither."""
    found = {KNOWN[name].axes for name in lines} - {0}
    if len(found) == 1:
        return found.pop()
    if found:
        planar = [name for name in lines if KNOWN[name].axes == 2]
        spatial = [name for name in lines if KNOWN[name].axes == 3]
        msg = (
            f"{where} holds both {planar[0]} (line {lines[planar[0]].numbers[0]}) and {spatial[0]} "
            f"(line {lines[spatial[0]].numbers[0]}); a graph is in the plane or in space, split the file"
        )
        raise FileFormatError(msg)
    told = f"; it has {', '.join(list(skipped)[:5])}, which are not understood" if skipped else ""
    msg = f"{where} holds no vertex and no edge of g2o or TORO, such as EDGE_SE2 or EDGE_SE3:QUAT{told}"
    raise FileFormatError(msg)


def _vertices(
    lines: dict[str, Lines], does: str, axes: int, where: str
) -> tuple[tuple[Ints, Array], list[int]]:
    """Ascending indices and rows, and their lines."""
    size = {"vertex": 3 if axes == 2 else 7, "point": axes}[does]
    ids, rows, numbers = [np.zeros(0, np.int64)], [np.zeros((0, size))], []
    for name, table in lines.items():
        if KNOWN[name].does == does:
            values = np.array(table.values)
            ids.append(np.array(table.ids, dtype=np.int64)[:, 0])
            rows.append(pose_rows(values, KNOWN[name], table.numbers, where) if does == "vertex" else values)
            numbers += table.numbers
    index, row = np.concatenate(ids), np.concatenate(rows)
    order = np.argsort(index, kind="stable")
    again = np.flatnonzero(np.diff(index[order]) == 0)
    if len(again):
        one, two = sorted(numbers[k] for k in order[again[0] : again[0] + 2])
        msg = f"{where}, line {two}: vertex {index[order[again[0]]]} stands in line {one} already; keep one"
        raise FileFormatError(msg)
    return (index[order], np.ascontiguousarray(row[order])), numbers


def _edges(lines: dict[str, Lines], does: str, axes: int, weights: str, where: str) -> Edges:
    """All edges that measure one thing, in the order of the file."""
    parts = []
    size = {"between": 3 if axes == 2 else 7, "displacement": axes, "sighting": 2}[does]
    dim = {"between": 3 if axes == 2 else 6, "displacement": axes, "sighting": 2}[does]
    for name, table in lines.items():
        tag = KNOWN[name]
        if tag.does != does:
            continue
        ids = np.array([i[:2] for i in table.ids], dtype=np.int64)
        z = np.array([v[: tag.numbers] for v in table.values])
        if does == "sighting":  # bearing, range and two standard deviations
            sigmas = z[:, [3, 2]]
            if (sigmas <= 0).any():
                line = table.numbers[int(np.flatnonzero((sigmas <= 0).any(axis=1))[0])]
                msg = f"{where}, line {line}: the standard deviations of {name} must be positive"
                raise FileFormatError(msg)
            z, information = z[:, [1, 0]], np.eye(2) / sigmas[:, :, None] ** 2
        else:
            information = weight_matrices(table, tag, name, dim, weights, where)
        if does == "between":
            z = pose_rows(z, tag, table.numbers, where)
        parts.append((ids, z, information, np.array(table.numbers, dtype=np.int64)))
    if not parts:
        return no_edges(size, dim)
    joined = [np.concatenate(columns) for columns in zip(*parts, strict=True)]
    order = np.argsort(joined[3], kind="stable")
    ids, z, information, numbers = (column[order] for column in joined)
    return Edges(ids, z, information, numbers)


def _offsets(lines: dict[str, Lines], where: str) -> Array | None:
    """(N, 7) body_T_sensor of each displacement; None where every sensor stands in the body's origin."""
    told = lines.get("EDGE_SE3_TRACKXYZ")
    if told is None:
        return None
    known = {}
    if (table := lines.get("PARAMS_SE3OFFSET")) is not None:
        rows = pose_rows(np.array(table.values), KNOWN["PARAMS_SE3OFFSET"], table.numbers, where)
        known = {ids[0]: row for ids, row in zip(table.ids, rows, strict=True)}
    for ids, line in zip(told.ids, told.numbers, strict=True):
        if ids[2] not in known:
            msg = f"{where}, line {line}: the edge names parameter {ids[2]}, and no PARAMS_SE3OFFSET does"
            raise DataError(msg)
    offsets = np.array([known[ids[2]] for ids in told.ids])
    return offsets if (offsets != np.array([1.0, 0, 0, 0, 0, 0, 0])).any() else None


def _require_vertices(graph: GraphFile, lines: dict[str, Lines]) -> None:
    """Where a file lists its vertices, an edge may name only those: the others are usually a slip."""
    poses, points = graph.vertices.index["x"], graph.vertices.index["l"]
    strict = "EDGE_SE2_XY" in lines or "EDGE_SE3_TRACKXYZ" in lines or len(points) > 0
    checks = [(graph.between, 0, poses), (graph.between, 1, poses), (graph.displacements, 0, poses)]
    checks += [(graph.sightings, 0, poses)] + ([(graph.displacements, 1, points)] if strict else [])
    for edges, column, known in checks:
        missing = np.flatnonzero(~np.isin(edges.ids[:, column], known))
        if len(missing):
            k = missing[0]
            a, b = edges.ids[k]
            msg = (
                f"{graph.where}, line {edges.line[k]}: the edge joins {a} and {b}, and the file has no "
                f"vertex {edges.ids[k, column]}; add the vertex, or drop the edge"
            )
            raise DataError(msg)
    if len(lost := graph.fixed[~np.isin(graph.fixed, np.concatenate([poses, points]))]):
        msg = f"{graph.where}: FIX names {lost[0]}, and the file has no such vertex"
        raise DataError(msg)
