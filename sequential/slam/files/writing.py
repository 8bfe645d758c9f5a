"""Graph files written: what is read from them again is the same to the last digit."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.readers.files import replacing
from sequential.slam.files.graph_file import GraphFile
from sequential.slam.files.weights import ROTATION_FIRST, roll_pitch_yaw

__all__ = ["write_graph"]

Array = NDArray[np.float64]

FORMATS = ("g2o", "toro")
TRANSLATION_FIRST = ROTATION_FIRST  # its own inverse


def write_graph(path: str | os.PathLike[str], graph: GraphFile, *, form: str | None = None) -> None:
    """Write a graph; the file appears whole or not at all.

    Parameters
    ----------
    form : `"g2o"` or `"toro"` (poses against poses only, angles for rotations in space); by default TORO
        where the name ends in `.graph` or `.toro`

    Raises
    ------
    DataError
        where the format cannot say what the graph holds.
    """
    name = os.fspath(path)
    form = form or ("toro" if name.endswith((".graph", ".toro")) else "g2o")
    if form not in FORMATS:
        msg = f"form is one of {', '.join(FORMATS)}, got {form!r}"
        raise DataError(msg)
    if form == "toro" and (len(graph.displacements) or len(graph.sightings)):
        msg = "a TORO file holds poses against poses only, and this graph has landmarks; write it as g2o"
        raise DataError(msg)
    if len(graph.sightings):
        msg = "a g2o file has no edge for range and bearing; make them displacements, or keep the original"
        raise DataError(msg)
    with replacing(path) as file:
        file.writelines(f"{line}\n" for line in _lines(graph, toro=form == "toro"))


def _lines(graph: GraphFile, *, toro: bool) -> Iterator[str]:
    vertex, edge = {
        (2, False): ("VERTEX_SE2", "EDGE_SE2"),
        (3, False): ("VERTEX_SE3:QUAT", "EDGE_SE3:QUAT"),
        (2, True): ("VERTEX2", "EDGE2"),
        (3, True): ("VERTEX3", "EDGE3"),
    }[graph.axes, toro]
    index, rows = graph.vertices.index, graph.vertices.rows
    if "x" in index:
        for i, row in zip(index["x"], _pose_numbers(rows["x"], toro=toro), strict=True):
            yield f"{vertex} {i} {_text(row)}"
    if "l" in index:
        name = "VERTEX_XY" if graph.axes == 2 else "VERTEX_TRACKXYZ"
        for i, row in zip(index["l"], rows["l"], strict=True):
            yield f"{name} {i} {_text(row)}"
    for i in graph.fixed:
        yield f"FIX {i}"
    for ids, z, weights in zip(
        graph.between.ids,
        _pose_numbers(graph.between.z, toro=toro),
        _weights(graph.between.information, toro=toro),
        strict=True,
    ):
        yield f"{edge} {ids[0]} {ids[1]} {_text(z)} {_text(weights)}"
    yield from _displacements(graph)


def _displacements(graph: GraphFile) -> Iterator[str]:
    """Landmarks in the frame of a pose, and in space the parameters that their edges name."""
    seen, number = graph.displacements, np.zeros(len(graph.displacements), dtype=np.int64)
    if graph.axes == 3 and len(seen):
        identity = np.array([[1.0, 0, 0, 0, 0, 0, 0]])
        offsets = identity if graph.body_T_sensor is None else graph.body_T_sensor
        distinct, number = np.unique(offsets, axis=0, return_inverse=True)
        number = np.broadcast_to(number.ravel(), (len(seen),))
        for place, row in enumerate(_pose_numbers(distinct, toro=False)):
            yield f"PARAMS_SE3OFFSET {place} {_text(row)}"
    upper = np.triu_indices(graph.axes)
    for ids, z, information, k in zip(seen.ids, seen.z, seen.information, number, strict=True):
        tag, middle = ("EDGE_SE2_XY", "") if graph.axes == 2 else ("EDGE_SE3_TRACKXYZ", f" {k}")
        yield f"{tag} {ids[0]} {ids[1]}{middle} {_text(z)} {_text(information[upper])}"


def _pose_numbers(rows: Array, *, toro: bool) -> Array:
    if rows.shape[1] == 3:
        return rows
    if toro:
        return np.concatenate([rows[:, 4:], roll_pitch_yaw(rows[:, :4])], axis=1)
    return rows[:, [4, 5, 6, 1, 2, 3, 0]]


def _weights(information: Array, *, toro: bool) -> Array:
    """The upper triangle (N, 6) or (N, 21) in the order of the format."""
    dim = information.shape[-1]
    if dim == 6:
        information = information[:, TRANSLATION_FIRST][:, :, TRANSLATION_FIRST]
    rows = information[:, *np.triu_indices(dim)]
    return rows[:, [0, 1, 3, 5, 2, 4]] if toro and dim == 3 else rows


def _text(row: Array) -> str:
    """Numbers with all their digits."""
    return " ".join(map(repr, row.tolist()))
