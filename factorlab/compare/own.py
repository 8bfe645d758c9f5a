"""A user's own log and model, made into the same `Dataset` that the built-in recordings are."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from factorlab.compare.accuracy import position_axes, scored_sensor
from factorlab.compare.declaration import load_declaration
from factorlab.datasets import Dataset, Truth
from sequential.errors import DataError, MissingStreamError, ModelError
from sequential.log import SensorLog, Stream
from sequential.model import StateSpace
from sequential.readers import read_log, read_tum

__all__ = ["own_dataset", "read_truth", "require_log"]

TRUTH_GAP_S = 0.5  # truth is interpolated, but not across a pause of more than twice this


def require_log(source: str, datasets: Sequence[str]) -> Path:
    """The path of a user's log.

    Raises
    ------
    DataError
        where neither a dataset nor a file has that name; the message names the nearest.
    """
    path = Path(source)
    if path.is_file():
        return path
    beside = path.parent.iterdir() if path.parent.is_dir() else ()
    files = [str(path.parent / found.name) for found in beside if found.is_file()]
    near = get_close_matches(source, [*datasets, *files], n=1, cutoff=0.6)
    what = "a folder" if path.is_dir() else "neither a dataset nor a file"
    hint = f"did you mean {near[0]!r}?" if near else f"the datasets are {', '.join(datasets)},"
    end = "A log" if near else "and a log"
    msg = f"{source!r} is {what}; {hint} {end} of your own is a CSV or NPZ file with --model FILE.py:NAME"
    raise DataError(msg)


def own_dataset(path: Path, model: str, truth: Path | None = None, use_every: int = 1) -> Dataset:
    """A log file, a model and, where there is one, a truth.

    Parameters
    ----------
    model : `FILE.py:NAME`, a `StateSpace` or a function that returns one; see `load_declaration`
    truth : trajectory in TUM format
    use_every : 1 holds nothing out; else one reading in this many of the first position sensor (or of the
        first sensor of all) is used and the others score the result

    Raises
    ------
    DataError, ModelError
    """
    given = load_declaration(model)
    declared = given.model
    log = read_log(path)
    _require_streams(path, declared, log)
    held_out: Stream | None = None
    notes = []
    if use_every > 1:
        name = scored_sensor(declared)
        log, held_out = log.hold_out(name, use_every)
        if not len(log[name]):
            msg = f"{path}: {name!r} has only {len(held_out)} readings; one in {use_every} leaves none to use"
            raise DataError(msg)
        notes.append(f"{len(log[name])} readings of {name} used, {len(held_out)} held out")
    real = None if truth is None else read_truth(truth)
    axes = position_axes(declared, real)
    if real is not None and axes is None:
        has = f"it is {declared.manifold}"
        msg = f"{truth}: a truth needs a position in the state, such as a part pose=SE2(); {has}"
        raise ModelError(msg)
    return Dataset(
        name=path.stem,
        title=f"{path.name} with {Path(model.rpartition(':')[0]).name}:{model.rpartition(':')[2]}",
        log=log,
        model=declared,
        held_out=held_out,
        truth=real,
        axes=axes or 2,
        knobs=given.knobs,
        build=given.build,
        notes=tuple(notes),
        default_estimators=("ekf", "iekf", "ukf", "ekf_rts", "ieks", "batch"),
    )


def read_truth(path: Path) -> Truth:
    """A TUM trajectory as truth; of poses with one stamp the first is kept."""
    read = read_tum(path)
    _, first = np.unique(read.t, return_index=True)
    if len(first) < 2:
        msg = f"{path} holds {len(first)} moment; a truth needs two or more to be read in between"
        raise DataError(msg)
    quaternion = None if read.quaternion is None else read.quaternion[first]
    return Truth(read.t[first], read.position[first], None, quaternion, TRUTH_GAP_S)


def _require_streams(path: Path, model: StateSpace, log: SensorLog) -> None:
    wanted = [*model.sensors, *([model.input] if model.input else [])]
    for name in wanted:
        if name not in log:
            near = get_close_matches(name, list(log), n=1, cutoff=0.5)
            hint = f"did you mean {near[0]!r}?" if near else "rename one of the two"
            msg = f"the model names a stream {name!r}, {path} has {', '.join(log)}; {hint}"
            raise MissingStreamError(msg)
