"""What a file of OpenCV's FileStorage holds, read without OpenCV: damaged files make its own reader crash."""

from __future__ import annotations

import json
import re
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import yaml

from sequential.errors import FileFormatError

__all__ = ["is_storage", "storage_content"]

MATRIX = "opencv-matrix"
HEADER = re.compile(r"\A\s*%YAML[:\s][^\n]*\n")
"""OpenCV's first line, `%YAML:1.0`, is no directive of YAML."""


def is_storage(text: str) -> bool:
    """Whether a text that is not JSON looks like OpenCV's YAML or XML."""
    begin = text.lstrip()[:200]
    return begin.startswith(("%YAML:1.", "<?xml", "<opencv_storage")) or f"!!{MATRIX}" in text


def storage_content(text: str, where: str) -> dict[str, Any]:
    """Entries of the top level: matrices as arrays (rows, cols), numbers, texts and lists as they are.

    Parameters
    ----------
    text : of the file: YAML, XML or JSON
    where : its name

    Raises
    ------
    FileFormatError
        where it is damaged.
    """
    begin = text.lstrip()[:1]
    try:
        found = _xml(text) if begin == "<" else json.loads(text) if begin == "{" else _yaml(text)
    except (ET.ParseError, yaml.YAMLError, ValueError, RecursionError) as error:
        raise FileFormatError(f"{where} is damaged: {_place(error)}") from error
    if not isinstance(found, dict):
        return {}
    return {str(key): _matrix(value, str(key), where) for key, value in found.items()}


# YAML whose tags are those of OpenCV; made by `type` because PyYAML has no types to derive from
_Loader: Any = type("_Loader", (yaml.SafeLoader,), {})


def _tagged(loader: yaml.SafeLoader, suffix: str, node: yaml.Node) -> Any:
    if not isinstance(node, yaml.MappingNode):
        return None
    return {**loader.construct_mapping(node, deep=True), "type_id": f"opencv-{suffix}"}


_Loader.add_multi_constructor("tag:yaml.org,2002:opencv-", _tagged)


def _yaml(text: str) -> Any:
    return yaml.load(HEADER.sub("", text), Loader=_Loader)  # noqa: S506 - derived from the safe one


def _xml(text: str) -> dict[str, Any]:
    root = ET.fromstring(text)  # noqa: S314 - expat bounds the growth of entities
    return {child.tag: _element(child) for child in root}


def _element(element: ET.Element) -> Any:
    if element.get("type_id"):
        parts = {child.tag: (child.text or "").strip() for child in element}
        data = parts.get("data", "").split()
        return {**parts, "data": data, "type_id": element.get("type_id")}
    if len(element):
        return {child.tag: _element(child) for child in element}
    words = (element.text or "").split()
    values = [_value(word) for word in words]
    if len(values) == 1:
        return values[0]
    return " ".join(words) if any(isinstance(value, str) for value in values) else values


def _value(word: str) -> float | str:
    try:
        return float(word)
    except ValueError:
        return word.strip('"')


def _matrix(value: Any, key: str, where: str) -> Any:
    """An array where an entry is a matrix, the entry itself otherwise."""
    if not isinstance(value, dict) or value.get("type_id") != MATRIX:
        return value
    try:
        rows, columns = int(value["rows"]), int(value["cols"])
        data = np.array([float(one) for one in value["data"]], dtype=np.float64)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise FileFormatError(f"{where} is damaged: {key} is no matrix with rows, cols and data") from error
    if rows < 1 or columns < 1 or rows * columns != data.size:
        raise FileFormatError(f"{where} is damaged: {key} has {data.size} numbers for {rows}x{columns}")
    return data.reshape(rows, columns)


def _place(error: Exception) -> str:
    """Where a parser stopped, if it says so."""
    mark = getattr(error, "problem_mark", None)
    line = mark.line + 1 if mark is not None else getattr(error, "lineno", None)
    if line is None and hasattr(error, "position"):
        line = error.position[0]
    return f"line {line} cannot be read" if line is not None else "it cannot be read"
