"""City10000: a simulated drive through streets, where some steps of the odometry come with two readings.

A line is `EDGE2 i 1 j 0 n` and n times `x y heading`: n = 1 is an ordinary edge, n = 2 offers two of which
one is right.  The file carries no weights.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.manifold import SE2
from sequential.readers.files import read_text

__all__ = ["CityGraph", "read_city"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class CityGraph:
    """Edges with one reading or several.

    Parameters
    ----------
    ids : (N, 2)
    z : (N, 3) the first reading of each
    others : further readings by the place of their edge, {edge: (n - 1, 3)}
    """

    ids: Ints
    z: Array
    others: dict[int, Array]


def read_city(path: str | os.PathLike[str]) -> CityGraph:
    """Read a file with several readings an edge.

    Raises
    ------
    DataError, FileFormatError
        naming the line.
    """
    ids: list[tuple[int, int]] = []
    z: list[Array] = []
    others: dict[int, Array] = {}
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        words = line.split()
        if not words:
            continue
        where = f"{os.fspath(path)}, line {number}"
        try:
            a, b, count = int(words[1]), int(words[3]), int(words[5])
            readings = np.array(words[6:], dtype=np.float64)
        except (IndexError, ValueError):
            msg = f"{where}: a line is 'EDGE2 i 1 j 0 n' and n times 'x y heading', got {line.strip()!r}"
            raise FileFormatError(msg) from None
        if words[0] != "EDGE2" or count < 1 or len(readings) != 3 * count:
            msg = f"{where}: {words[0]} promises {count} readings of 3 numbers, and holds {len(readings)}"
            raise FileFormatError(msg)
        poses = SE2().normalize(readings.reshape(count, 3))
        if count > 1:
            others[len(ids)] = poses[1:]
        ids.append((a, b))
        z.append(poses[0])
    if not ids:
        msg = f"{os.fspath(path)} holds no edge"
        raise FileFormatError(msg)
    return CityGraph(np.array(ids, dtype=np.int64), np.stack(z), others)
