"""What an ONNX file says of itself: its inputs, outputs and notes, without a library for the format.

OpenCV runs such a file but does not say what size of image it wants, nor what its classes are called;
exporters write both inside.  The file is a protocol buffer (github.com/onnx/onnx, onnx.proto): fields of a
number, a kind and a content, of which a handful is read here and the weights are skipped.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sequential.errors import FileFormatError

__all__ = ["OnnxFile", "read_onnx"]

Dimension = int | str
# numbers of fields in onnx.proto
GRAPH, NOTES = 7, 14
INITIALIZER, INPUT, OUTPUT = 5, 11, 12
VARINT, EIGHT_BYTES, LENGTH, FOUR_BYTES = 0, 1, 2, 5


@dataclass(frozen=True, slots=True)
class OnnxFile:
    """The outside of a network.

    Attributes
    ----------
    inputs, outputs : by name, the dimensions: numbers, or names of what is left open
    notes : what the exporter wrote, such as names, stride, task
    """

    name: str
    inputs: dict[str, tuple[Dimension, ...]]
    outputs: dict[str, tuple[Dimension, ...]]
    notes: dict[str, str] = field(default_factory=dict)

    @property
    def image_size(self) -> tuple[int, int] | None:
        """(width, height) of the image that the first input wants, or was exported for; None where unsaid."""
        shape = next(iter(self.inputs.values()), ())
        if len(shape) == 4 and all(isinstance(n, int) and n > 0 for n in shape[2:]):
            return int(shape[3]), int(shape[2])
        noted = _literal(self.notes.get("imgsz", ""))  # Ultralytics: height and width
        if isinstance(noted, list | tuple) and len(noted) == 2 and all(isinstance(n, int) for n in noted):
            return (noted[1], noted[0]) if min(noted) > 0 else None
        return None

    @property
    def class_names(self) -> tuple[str, ...]:
        """Names of classes, where the exporter wrote them: a list, or a table by number."""
        found = _literal(self.notes.get("names", ""))
        if isinstance(found, dict) and found and all(isinstance(k, int) and 0 <= k < 100_000 for k in found):
            return tuple(str(found.get(k, f"class {k}")) for k in range(max(found) + 1))
        return tuple(str(one) for one in found) if isinstance(found, list | tuple) else ()


def _literal(text: str) -> Any:
    """A list, table or number written as Python writes it; None where it is not."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None


def read_onnx(path: Path | str) -> OnnxFile:
    """Inputs, outputs and notes of an ONNX file.

    Raises
    ------
    FileFormatError
        where it is none.
    OSError
        where it cannot be read.
    """
    where = Path(path)
    content = where.read_bytes()
    try:
        whole = list(_fields(memoryview(content)))
        graph = next(part for number, part in whole if number == GRAPH)
        parts = list(_fields(graph))
        # weights stand among the inputs of older files
        weights = {_text_of(part, 8) for number, part in parts if number == INITIALIZER}
        inputs = dict(_value(part) for number, part in parts if number == INPUT)
        outputs = dict(_value(part) for number, part in parts if number == OUTPUT)
        notes = {_text_of(part, 1): _text_of(part, 2) for number, part in whole if number == NOTES}
    except (StopIteration, ValueError, IndexError, TypeError, UnicodeDecodeError):
        inputs = outputs = {}
        weights, notes = set(), {}
    inputs = {name: shape for name, shape in inputs.items() if name not in weights}
    if not inputs or not outputs:
        raise FileFormatError(
            f"{where} is no ONNX network ({len(content)} bytes, without a graph that has inputs and outputs);"
            " export the model again, or check the download"
        )
    return OnnxFile(where.name, inputs, outputs, notes)


def _fields(part: Any) -> Iterator[tuple[int, Any]]:
    """Numbers of fields with their content: an integer, or bytes."""
    at = 0
    while at < len(part):
        key, at = _varint(part, at)
        number, kind = key >> 3, key & 7
        if kind == VARINT:
            value, at = _varint(part, at)
            yield number, value
            continue
        if kind == LENGTH:
            length, at = _varint(part, at)
        elif kind in (EIGHT_BYTES, FOUR_BYTES):
            length = 8 if kind == EIGHT_BYTES else 4
        else:
            raise ValueError("a kind of field that there is not")
        if number == 0 or at + length > len(part):
            raise ValueError("a field that runs beyond its end")
        yield number, part[at : at + length]
        at += length


def _varint(part: Any, at: int) -> tuple[int, int]:
    """Seven bits a byte, lowest first, until one without its top bit."""
    value = shift = 0
    while True:
        byte = part[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
        if shift > 63:
            raise ValueError("a number that does not end")


def _text_of(part: Any, number: int) -> str:
    return next((bytes(one).decode() for field_, one in _fields(part) if field_ == number), "")


def _value(part: Any) -> tuple[str, tuple[Dimension, ...]]:
    """Name and dimensions of an input or output: value, its type, its tensor, its shape."""
    inside = part
    for number in (2, 1, 2):
        inside = next((one for field_, one in _fields(inside) if field_ == number), b"")
    shape: list[Dimension] = []
    for field_, dimension in _fields(inside):
        if field_ == 1:
            known = dict(_fields(dimension))
            shape.append(int(known[1]) if 1 in known else bytes(known.get(2, b"?")).decode())
    return _text_of(part, 1), tuple(shape)
