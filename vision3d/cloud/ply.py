"""Point clouds and meshes as PLY, the format that every viewer of clouds opens.

    write_ply("cloud.ply", points, colors=colors, scalars={"std_m": std})
    cloud = read_ply("cloud.ply")

Written in binary, little endian, coordinates as float32.  Read in ASCII and in both byte orders, with
whatever properties a file has: positions, normals, colours, faces; other numbers at the points become
scalars.  Source: G. Turk, "The PLY Polygon File Format", 1994.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from vision3d.cloud.arrays import Array, beside, checked_points
from vision3d.cloud.ply_parsing import parse

__all__ = ["Ply", "read_ply", "write_ply"]

POSITION, NORMAL, COLOUR = ("x", "y", "z"), ("nx", "ny", "nz"), ("red", "green", "blue")


@dataclass(frozen=True, slots=True)
class Ply:
    """What a PLY file holds.

    Parameters
    ----------
    points : (N, 3)
    colors : (N, 3) uint8 RGB, or None
    normals : (N, 3), or None
    scalars : other numbers at the points, by name, each (N,)
    faces : (F, 3) int64, polygons cut into triangles, or None
    """

    points: Array
    colors: NDArray[np.uint8] | None = None
    normals: Array | None = None
    scalars: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    faces: NDArray[np.int64] | None = None


def write_ply(
    path: str | os.PathLike[str],
    points: ArrayLike,
    *,
    colors: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    scalars: Mapping[str, ArrayLike] | None = None,
    faces: ArrayLike | None = None,
    comment: str = "",
) -> Path:
    """Write points, with what is known about each, and faces where there are some.

    Parameters
    ----------
    points : (N, 3) in metres
    colors : (N, 3) uint8, red green blue
    normals : (N, 3)
    scalars : further columns (N,), written as float32 under their names
    faces : (F, 3) corners of triangles, numbers of points
    comment : a line for the header

    Raises
    ------
    ShapeError
        where the arrays do not belong together.
    DataError
        where a point is not finite (viewers crash on those), or a face names no point.
    """
    place = checked_points(points)
    table = np.empty(len(place), [(name, "<f4") for name in POSITION] + _extra(colors, normals, scalars))
    columns: dict[str, ArrayLike] = dict(zip(POSITION, place.T, strict=True))
    if normals is not None:
        columns |= dict(zip(NORMAL, beside(normals, (len(place), 3), "normals").T, strict=True))
    if colors is not None:
        columns |= dict(zip(COLOUR, beside(colors, (len(place), 3), "colors").T, strict=True))
    for name, values in (scalars or {}).items():
        columns[name] = beside(values, (len(place),), f"scalars[{name!r}]")
    for name, column in columns.items():
        table[name] = column
    corners = None if faces is None else _faces(faces, len(place))
    target = Path(path)
    target.write_bytes(_header(table, corners, comment) + table.tobytes() + _packed(corners))
    return target


def read_ply(path: str | os.PathLike[str]) -> Ply:
    """Read a PLY file.

    Raises
    ------
    DataError
        where there is no such file.
    FileFormatError
        where it is none, or cut off.
    """
    source = Path(path)
    if not source.is_file():
        raise DataError(f"{source}: no such file; expected a point cloud (.ply)")
    columns, faces = parse(source)
    points = np.stack([columns[name] for name in POSITION], axis=1).astype(np.float64)
    normals = _stacked(columns, NORMAL)
    colors = _stacked(columns, COLOUR)
    if colors is not None and colors.max(initial=0.0) <= 1.0 and columns["red"].dtype.kind == "f":
        colors = 255.0 * colors
    named = {*POSITION, *(NORMAL if normals is not None else ()), *(COLOUR if colors is not None else ())}
    scalars = {name: column for name, column in columns.items() if name not in named}
    coloured = None if colors is None else np.rint(colors).astype(np.uint8)
    return Ply(points, coloured, normals, scalars, faces)


def _extra(colors: object, normals: object, scalars: Mapping[str, ArrayLike] | None) -> list[tuple[str, str]]:
    """Columns beyond the position: name and type of each."""
    fields = [(name, "<f4") for name in NORMAL] if normals is not None else []
    fields += [(name, "u1") for name in COLOUR] if colors is not None else []
    taken = {*POSITION, *(name for name, _ in fields)}
    for name in scalars or {}:
        if name in taken or not name or any(mark.isspace() for mark in name):
            raise DataError(f"scalars: {name!r} cannot name a column of a PLY file; one word, not in {taken}")
        fields.append((name, "<f4"))
    return fields


def _faces(faces: ArrayLike, count: int) -> NDArray[np.int64]:
    corners = np.asarray(faces, dtype=np.int64)
    if corners.ndim != 2 or corners.shape[1] != 3:
        raise ShapeError(f"faces: expected (F, 3) numbers of points, got {corners.shape}")
    if corners.size and not (corners.min() >= 0 and corners.max() < count):
        raise DataError(f"faces: they name points {corners.min()} to {corners.max()}, there are {count}")
    return corners


def _header(table: NDArray[Any], faces: NDArray[np.int64] | None, comment: str) -> bytes:
    kinds = {"<f4": "float", "|u1": "uchar"}
    lines = ["ply", "format binary_little_endian 1.0"]
    lines += [f"comment {line}" for line in comment.splitlines()]
    lines.append(f"element vertex {len(table)}")
    lines += [f"property {kinds[table.dtype[name].str]} {name}" for name in table.dtype.names or ()]
    if faces is not None:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    return ("\n".join([*lines, "end_header"]) + "\n").encode("ascii", "replace")


def _packed(faces: NDArray[np.int64] | None) -> bytes:
    if faces is None:
        return b""
    rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", (3,))])
    rows["count"], rows["corners"] = 3, faces
    return rows.tobytes()


def _stacked(columns: Mapping[str, NDArray[Any]], names: tuple[str, ...]) -> Array | None:
    if not all(name in columns for name in names):
        return None
    return np.stack([columns[name] for name in names], axis=1).astype(np.float64)
