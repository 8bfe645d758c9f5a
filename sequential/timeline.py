"""A log and a model laid out in time: nodes, the steps between them, the readings at them.

Every estimator, recursive or graph, walks the same schedule, so that results can be compared node by node.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.errors import GapError, MissingStreamError, NotFiniteError
from sequential.log import SensorLog, Stream, nanoseconds, seconds
from sequential.model import StateSpace
from sequential.readings import ReadingNoise, gather, noise_of, require_columns

__all__ = ["Problem", "Schedule", "prepare"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MIN_GAP_S = 1.0
GAP_FACTOR = 100.0  # a pause of more than this many median sample intervals is a gap


class Schedule(NamedTuple):
    """Plain arrays that kernels walk.

    Node k is reached from node k-1 by the steps step_ptr[k]:step_ptr[k+1] and then takes the readings
    reading_ptr[k]:reading_ptr[k+1].  Node 0 is the prior's.
    """

    step_ptr: Ints  # (K+1,)
    step_dt: Array  # (S,) s
    step_input: Ints  # (S,) row of `inputs` that drives the step
    inputs: Array  # (N_u, max(1, inputs))
    reading_ptr: Ints  # (K+1,)
    sensor: Ints  # (M,) which sensor of the model
    z: Array  # (M, largest measurement)
    context: Array  # (M, largest context)
    z_flat: Array  # z once more, row after row
    noise_cov: Array  # (T, m, m) distinct noises; a missing component has a unit variance of its own
    noise_row: Ints  # (M,) row of `noise_cov` that holds for a reading
    rows: Ints  # (M,) components of a reading that are not missing; z is NaN at the others


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What an estimator solves: a model, its schedule, and where each reading came from."""

    model: StateSpace
    schedule: Schedule
    t: Ints  # (K,) ns, time of each node
    reading_t: Ints  # (M,) ns
    reading_row: Ints  # (M,) row in the reading's stream
    noise: ReadingNoise
    log_name: str = "log"
    missing: int = 0  # readings that were dropped because all their components were NaN

    def __post_init__(self) -> None:
        # the noises are the model's: a problem that is given another model of its family gets that one's
        noises = sealed(self.noise.table(self.model))
        object.__setattr__(self, "schedule", self.schedule._replace(noise_cov=noises))

    @property
    def plain(self) -> bool:
        """Whether every reading is whole and has the noise of its sensor."""
        return self.noise.given is None and len(self.noise.sensor) == len(self.model.sensors)

    def only(self, kept: NDArray[np.bool_]) -> Problem:
        """The problem with some of its readings, at the same nodes."""
        plan, z = self.schedule, self.schedule.z[kept]
        pointer = np.append(0, np.cumsum(kept))[plan.reading_ptr]
        noise = replace(self.noise, row=self.noise.row[kept], rows=self.noise.rows[kept])
        fewer = plan._replace(
            reading_ptr=sealed(pointer.astype(np.int64)),
            sensor=sealed(plan.sensor[kept]),
            z=sealed(z),
            context=sealed(plan.context[kept]),
            z_flat=sealed(z.ravel()),
            noise_row=sealed(noise.row),
            rows=sealed(noise.rows),
        )
        t, row = self.reading_t[kept], self.reading_row[kept]
        return replace(self, schedule=fewer, reading_t=t, reading_row=row, noise=noise)

    def noises(self, readings: NDArray[Any], dim: int) -> Array:
        """(R, dim, dim) noise covariances of some readings of one sensor."""
        cov: Array = self.schedule.noise_cov[self.schedule.noise_row[readings], :dim, :dim]
        return cov


def prepare(
    model: StateSpace, log: SensorLog, at: NDArray[np.generic] | None = None, max_gap: float | None = None
) -> Problem:
    """Lay out a log for a model.

    Parameters
    ----------
    at : further times at which an estimate is wanted, float seconds or int nanoseconds
    max_gap : longest pause of the input stream in seconds; by default the larger of 1 s and 100 intervals

    Raises
    ------
    MissingStreamError, GapError, ShapeError
    """
    log = log.check()
    start = log.span()[0] if model.start_ns is None else model.start_ns
    found = gather(model, log, start)
    noise, t = noise_of(model, found), found.t
    wanted = [found.stamps, np.array([start])] + ([] if at is None else [nanoseconds(at)])
    nodes = merged(*wanted)
    nodes = nodes[nodes >= start]
    order = np.argsort(t, kind="stable")
    reading_ptr = np.searchsorted(t[order], nodes, side="left")
    reading_ptr = np.append(reading_ptr, len(t)).astype(np.int64)
    steps = _steps(model, log, nodes, max_gap)
    z = found.z[order]
    readings = (found.sensor[order], z, found.context[order], z.ravel(), np.zeros((1, 1, 1)))
    noise = replace(noise, row=noise.row[order], rows=noise.rows[order])
    schedule = Schedule(*map(sealed, (*steps, reading_ptr, *readings, noise.row, noise.rows)))
    return Problem(model, schedule, nodes, t[order], found.row[order], noise, log.name, found.dropped)


def merged(*stamps: Ints) -> Ints:
    """Distinct stamps of several ascending runs, in order; a stable sort merges runs in linear time."""
    together = np.sort(np.concatenate(stamps), kind="stable")
    return together[np.concatenate([[True], np.diff(together) > 0])] if len(together) else together


def sealed(values: NDArray[Any]) -> NDArray[Any]:
    """Contiguous and read-only, as kernels expect."""
    own = np.ascontiguousarray(values)
    own.flags.writeable = False
    return own


def _steps(
    model: StateSpace, log: SensorLog, nodes: Ints, max_gap: float | None
) -> tuple[Ints, Array, Ints, Array]:
    """Steps from node to node, cut at every input stamp."""
    if model.input is None:
        pointer = np.concatenate([[0, 0], np.arange(1, len(nodes))]).astype(np.int64)
        dt = np.diff(nodes) * 1e-9
        return pointer, dt, np.zeros(len(dt), dtype=np.int64), np.zeros((1, 1))
    stream = log[model.input]
    require_columns(model.input, stream, model.process_functions.inputs, 0)
    _require_driven(model.input, stream)
    model.process.require_inputs(stream.values, f"log[{model.input!r}]")
    if not len(stream):
        msg = f"log[{model.input!r}] drives the process and is empty"
        raise MissingStreamError(msg)
    _require_no_gap(model.input, stream, nodes, max_gap)
    inside = stream.t[(stream.t > nodes[0]) & (stream.t < nodes[-1])]
    edges = merged(inside, nodes)
    if stream.covers == "after":
        rows = np.searchsorted(stream.t, edges[:-1], side="right") - 1
    else:
        rows = np.searchsorted(stream.t, edges[1:], side="left")
    rows = np.clip(rows, 0, len(stream) - 1).astype(np.int64)
    pointer = np.searchsorted(edges, nodes).astype(np.int64)
    pointer = np.concatenate([[0], pointer])
    return pointer, np.diff(edges) * 1e-9, rows, np.ascontiguousarray(stream.values)


def _require_driven(name: str, stream: Stream) -> None:
    bad = np.flatnonzero(~np.isfinite(stream.values).all(axis=1))
    if len(bad):
        msg = (
            f"log[{name!r}] drives the process and holds NaN at sample {bad[0]} (and {len(bad) - 1} more); "
            "a sensor may miss a reading, an input may not: drop such samples with log.finite()"
        )
        raise NotFiniteError(msg)


def _require_no_gap(name: str, stream: Stream, nodes: Ints, max_gap: float | None) -> None:
    first, last = nodes[0], nodes[-1]
    inner = stream.t[(stream.t > first) & (stream.t < last)]
    pauses = np.diff(np.concatenate([[first], inner, [last]])) * 1e-9
    usual = float(np.median(np.diff(stream.t))) * 1e-9 if len(stream) > 1 else 0.0
    limit = max(MIN_GAP_S, GAP_FACTOR * usual) if max_gap is None else max_gap
    if len(pauses) and pauses.max() > limit:
        k = int(np.argmax(pauses))
        began = seconds(first if k == 0 else inner[k - 1])
        msg = (
            f"log[{name!r}] drives the process but pauses for {pauses.max():.3f} s after {began:.3f} s "
            f"(usual interval {usual:.4f} s, limit {limit:.3f} s); cut the log there, "
            "or allow it with max_gap=…"
        )
        raise GapError(msg)
