"""Logs as NumPy archives: arrays NAME_t and NAME, optionally NAME_context and NAME_covers."""

from __future__ import annotations

import os
import zipfile
from typing import Any

import numpy as np

from sequential.errors import DataError, FileFormatError, MissingStreamError
from sequential.log import SensorLog, Stream
from sequential.readers.files import replacing

__all__ = ["read_arrays", "read_npz", "write_npz"]


def read_npz(path: str | os.PathLike[str]) -> dict[str, Stream]:
    """Read the streams of an archive; arrays that belong to no stream are left alone.

    Raises
    ------
    FileFormatError, MissingStreamError
        naming the array.
    """
    name = os.fspath(path)
    arrays = read_arrays(name)
    streams = {}
    for key in arrays:
        stream = key.removesuffix("_t")
        if key == stream or not stream:
            continue
        if stream not in arrays:
            raise FileFormatError(f"{name}: the array {key!r} needs its readings in an array {stream!r}")
        streams[stream] = _stream(name, stream, arrays)
    if not streams:
        raise FileFormatError(
            f"{name}: no stream found; a stream is two arrays, its stamps 'gps_t' and its readings 'gps'. "
            f"The file holds {', '.join(sorted(arrays)) or 'nothing'}"
        )
    return streams


def read_arrays(name: str) -> dict[str, Any]:
    """Every array of an archive; raises `FileFormatError` where it is none."""
    try:
        with np.load(name, allow_pickle=False) as archive:
            return {key: archive[key] for key in archive.files}
    except (ValueError, OSError, EOFError, AttributeError, zipfile.BadZipFile) as fault:
        reason = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
        raise FileFormatError(
            f"{name} is not an archive of numeric arrays as numpy.savez writes it ({reason})"
        ) from None


def _stream(name: str, stream: str, arrays: dict[str, Any]) -> Stream:
    t, values, context = arrays[f"{stream}_t"], arrays[stream], arrays.get(f"{stream}_context")
    for key, array in ((f"{stream}_t", t), (stream, values), (f"{stream}_context", context)):
        if array is not None and not (
            np.issubdtype(array.dtype, np.integer) or np.issubdtype(array.dtype, np.floating)
        ):
            raise FileFormatError(f"{name}: the array {key!r} holds {array.dtype}, numbers are needed")
    if not t.size:
        raise MissingStreamError(
            f"{name}: the stream {stream!r} has not one reading; leave it out or mend the log"
        )
    covers = str(arrays.get(f"{stream}_covers", "after"))
    if covers not in {"after", "before"}:
        raise FileFormatError(
            f"{name}: the array '{stream}_covers' is {covers!r}; it says 'after' or 'before'"
        )
    try:
        return Stream(t, values, context, covers, arrays.get(f"{stream}_noise_cov"))  # type: ignore[arg-type]
    except DataError as fault:
        raise type(fault)(f"{name}: stream {stream!r}: {fault}") from None


def write_npz(path: str | os.PathLike[str], log: SensorLog) -> None:
    """Write a log, stamps as int64 nanoseconds."""
    arrays: dict[str, Any] = {}
    for name, stream in log.items():
        arrays[f"{name}_t"], arrays[name] = stream.t, stream.values
        arrays[f"{name}_covers"] = np.array(stream.covers)
        if stream.context is not None:
            arrays[f"{name}_context"] = stream.context
        if stream.noise_cov is not None:
            arrays[f"{name}_noise_cov"] = stream.noise_cov
    with replacing(path, "wb") as file:
        np.savez(file, **arrays)
