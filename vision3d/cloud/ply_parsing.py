"""What stands in a PLY file: elements with their properties, as text or bytes of either order."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError

__all__ = ["parse"]

TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
LONGEST_HEADER = 65536
Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Property:
    """A number at each element, or a list of numbers (with the type of its length)."""

    name: str
    kind: str
    length: str | None = None


@dataclass(frozen=True, slots=True)
class Element:
    """A table of the file: so many rows of these properties."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


def parse(path: Path) -> tuple[Columns, NDArray[np.int64] | None]:
    """The columns of the vertices, and the triangles.

    Raises
    ------
    FileFormatError
        where the file is no PLY, is cut off, or holds no points.
    """
    content = path.read_bytes()
    order, elements, at = _header(path, content)
    columns: Columns | None = None
    faces: NDArray[np.int64] | None = None
    reader = _Text(path, content, at) if order is None else _Bytes(path, content, at, order)
    for element in elements:
        rows, lists = reader.take(element)
        if element.name == "vertex":
            columns = rows
        elif element.name == "face" and lists:
            faces = _triangles(lists)
    if columns is None or not {"x", "y", "z"} <= columns.keys():
        raise FileFormatError(f"{path}: it holds no points; expected an element vertex with x, y and z")
    if faces is not None and faces.size and not (faces.min() >= 0 and faces.max() < len(columns["x"])):
        raise FileFormatError(f"{path}: a face names point {faces.max()}, there are {len(columns['x'])}")
    return columns, faces


def _header(path: Path, content: bytes) -> tuple[str | None, list[Element], int]:
    """Byte order (None: text), elements, and where the numbers begin."""
    end = content.find(b"end_header", 0, LONGEST_HEADER)
    if not content.startswith(b"ply") or end < 0:
        raise FileFormatError(f"{path}: no PLY file; expected a header from 'ply' to 'end_header'")
    start = content.find(b"\n", end) + 1
    form, elements = "", list[Element]()
    for line in content[:end].decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        try:
            match words:
                case ["format", form, *_]:
                    pass
                case ["element", name, count]:
                    elements.append(Element(name, int(count)))
                case ["property", "list", length, kind, name]:
                    elements[-1].properties.append(Property(name, TYPES[kind], TYPES[length]))
                case ["property", kind, name]:
                    elements[-1].properties.append(Property(name, TYPES[kind]))
                case _:
                    pass
        except (KeyError, ValueError, IndexError) as error:
            raise FileFormatError(f"{path}: header line {line!r} is not understood") from error
    if form not in ORDERS:
        raise FileFormatError(f"{path}: format {form!r} is not known; expected {', '.join(ORDERS)}")
    return ORDERS[form], elements, start


def _triangles(lists: dict[str, list[NDArray[np.int64]]]) -> NDArray[np.int64]:
    """Polygons as fans of triangles."""
    polygons = lists.get("vertex_indices") or lists.get("vertex_index") or []
    if polygons and all(len(polygon) == 3 for polygon in polygons):
        return np.array(polygons, dtype=np.int64)
    fans = [np.stack([np.full(len(p) - 2, p[0]), p[1:-1], p[2:]], axis=1) for p in polygons if len(p) >= 3]
    return np.concatenate(fans).astype(np.int64) if fans else np.empty((0, 3), np.int64)


class _Bytes:
    """Elements one after the other from bytes."""

    def __init__(self, path: Path, content: bytes, at: int, order: str) -> None:
        self._path, self._content, self._at, self._order = path, content, at, order

    def take(self, element: Element) -> tuple[Columns, dict[str, list[NDArray[np.int64]]]]:
        if not any(one.length for one in element.properties):
            kind = np.dtype([(one.name, self._order + one.kind) for one in element.properties])
            table = self._numbers(kind, element.count, element)
            return {name: table[name] for name in kind.names or ()}, {}
        return {}, self._equal(element) or self._uneven(element)

    def _equal(self, element: Element) -> dict[str, list[NDArray[np.int64]]]:
        """One list a row, all as long as the first (a mesh of triangles): read at once, or nothing."""
        one = element.properties[0]
        if len(element.properties) > 1 or not one.length or not element.count:
            return {}
        began = self._at
        length = int(self._numbers(np.dtype(self._order + one.length), 1, element)[0])
        self._at = began
        kind = np.dtype([("n", self._order + one.length), ("of", self._order + one.kind, (length,))])
        if began + kind.itemsize * element.count <= len(self._content):
            rows = self._numbers(kind, element.count, element)
            if (rows["n"] == length).all():
                return {one.name: list(rows["of"])}
            self._at = began
        return {}

    def _uneven(self, element: Element) -> dict[str, list[NDArray[np.int64]]]:
        lists: dict[str, list[NDArray[np.int64]]] = {}
        for _ in range(element.count):
            for one in element.properties:
                count = 1
                if one.length:
                    count = int(self._numbers(np.dtype(self._order + one.length), 1, element)[0])
                values = self._numbers(np.dtype(self._order + one.kind), count, element)
                lists.setdefault(one.name, []).append(values)
        return lists

    def _numbers(self, kind: np.dtype[Any], count: int, element: Element) -> NDArray[Any]:
        size = kind.itemsize * count
        if count < 0 or self._at + size > len(self._content):
            raise FileFormatError(
                f"{self._path}: cut off inside element {element.name} ({element.count} are told)"
            )
        found = np.frombuffer(self._content, kind, count, self._at)
        self._at += size
        return found


class _Text:
    """Elements one after the other from lines."""

    def __init__(self, path: Path, content: bytes, at: int) -> None:
        self._path, self._lines = path, iter(content[at:].decode("ascii", "replace").splitlines())

    def take(self, element: Element) -> tuple[Columns, dict[str, list[NDArray[np.int64]]]]:
        columns: dict[str, list[float]] = {one.name: [] for one in element.properties if not one.length}
        lists: dict[str, list[NDArray[np.int64]]] = {one.name: [] for one in element.properties if one.length}
        for row in range(element.count):
            try:
                words = iter(next(self._lines).split())
                for one in element.properties:
                    if one.length:
                        count = int(next(words))
                        lists[one.name].append(np.array([int(next(words)) for _ in range(count)]))
                    else:
                        columns[one.name].append(float(next(words)))
            except (StopIteration, ValueError) as error:
                raise FileFormatError(
                    f"{self._path}: {element.name} {row + 1} of {element.count} is cut off, or not numbers"
                ) from error
        kinds = {one.name: one.kind for one in element.properties}
        return {name: np.array(values, dtype=kinds[name]) for name, values in columns.items()}, lists
