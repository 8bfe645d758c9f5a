"""What the readings of a log can show of the state, and which directions they leave open, by name.

The information that readings hold about the state at the start is that of the noise-free model,
Σ Φₖᵀ Hₖᵀ R⁻¹ Hₖ Φₖ (the local observability Gramian; Krener and Ide 2009, Measures of unobservability), along
the path that the process and its inputs make from there.  A path of estimates would not do: it jumps at every
update, and the jumps would look like information about what no reading shows (Huang, Mourikis, Roumeliotis
2010, Observability-based rules for designing consistent EKF SLAM estimators).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.directions import in_words
from sequential.errors import DataError, ModelError
from sequential.evaluate.symmetries import pivoted, symmetries, turning_point
from sequential.history import Run
from sequential.log import SensorLog, seconds
from sequential.model import StateSpace
from sequential.timeline import Problem, prepare

__all__ = ["NamedDirection", "Observability", "observability"]

Array = NDArray[np.float64]

DECLARED, DIFFERENCED = 1e-9, 1e-6  # relative size below which a singular value is rounding
INSIDE = 1e-4  # share of a named direction that may stick out of a space for it to count as inside
WEAK = 1.0  # information in units of the prior's: below this the readings say less than the prior did


@dataclass(frozen=True, slots=True, eq=False)
class NamedDirection:
    """A tangent direction at the start, (d,) in the state's own units.

    `information` is what the readings say about it in units of the prior's information: with 1 they halve its
    variance, with 0 they say nothing.
    """

    words: str
    vector: Array
    information: float


@dataclass(frozen=True, slots=True, eq=False)
class Observability:
    """What readings show of the state at the start of a log, or of a part of it.

    `information` holds the eigenvalues of the Gramian in units of the prior, largest first: no choice of
    units changes them, nor the rank.  `reduction` is σ after over σ before the readings, component by
    component, were the process without noise.
    """

    t: int  # ns, where the state is meant
    mean: Array  # (n,) about which the model was linearised
    rank: int
    dim: int
    information: Array  # (d,)
    gramian: Array  # (d, d) in the units of the tangent
    reduction: Array  # (d,)
    unobservable: tuple[NamedDirection, ...]
    weak: tuple[NamedDirection, ...]

    @property
    def observable(self) -> bool:
        """Whether every direction shows in the readings."""
        return self.rank == self.dim

    def __str__(self) -> str:
        """One line for the whole, one for each direction that is open or weak."""
        lines = [f"{self.rank} of {self.dim} directions show in the readings"]
        lines += [f"never seen: {one.words}" for one in self.unobservable]
        lines += [f"hardly seen: {one.words} ({one.information:.2g} of the prior's)" for one in self.weak]
        return "\n".join(lines)


def observability(
    model: StateSpace,
    log: SensorLog,
    run: Run | None = None,
    *,
    between: tuple[float, float] | None = None,
    max_gap: float | None = None,
) -> Observability:
    """Say which directions of the state the readings of a log show.

    Parameters
    ----------
    run : an estimate; the path begins where it says, best from a smoother.  Without it: at the prior's mean
    between : only the readings between two times, s, and the state at the first of them; needs a run
    max_gap : longest pause of the input that is bridged, s

    Raises
    ------
    ModelError
        where `between` is given without a run.
    DataError
        where there is no reading in between, or the path is not finite.

    Notes
    -----
    Rank is decided on columns of equal length, so that it depends on neither units nor prior.  What is
    unobservable is named by the first of these that fits: a component, a turn or a move of a pose, a mixture
    of few components, in standard deviations of the prior.
    """
    return show(prepare(model, log, max_gap=max_gap), run, between)


def show(
    problem: Problem, run: Run | None = None, between: tuple[float, float] | None = None
) -> Observability:
    """What the readings of a problem show: `observability` for a log that is laid out already."""
    model = problem.model
    first, last = _span(problem, run, between)
    start = model.prior.mean if run is None else run.mean[run.index(problem.t[[first]])[0]]
    rows = _rows(problem, start, first, last)
    if not np.isfinite(rows).all():
        raise DataError(
            "the path from the start is not finite without the readings; take a shorter piece with between=…"
        )
    return _analyse(model, int(problem.t[first]), start, rows)


def _span(problem: Problem, run: Run | None, between: tuple[float, float] | None) -> tuple[int, int]:
    """First and last node."""
    if between is None:
        return 0, len(problem.t) - 1
    if run is None:
        raise ModelError("between=… needs a run that says where the state was then")
    t = seconds(problem.t)
    inside = np.flatnonzero((t >= between[0]) & (t <= between[1]))
    if len(inside) < 2:
        raise DataError(
            f"there are {len(inside)} moments with readings between {between[0]} s and {between[1]} s; the "
            f"log runs from {t[0]:.3f} s to {t[-1]:.3f} s"
        )
    return int(inside[0]), int(inside[-1])


def _rows(problem: Problem, start: Array, first: int, last: int) -> Array:
    """Whitened rows (r, d): every reading as a function of the state at the start."""
    from sequential.smoothers.online import dead_reckoning, look_back

    path, transition = dead_reckoning(problem, start, first, last)
    d = problem.model.manifold.dim
    flow = [np.eye(d)]
    for step in transition[1:]:
        flow.append(step @ flow[-1])
    states = np.tile(start, (len(problem.t), 1))
    states[first : last + 1] = path
    _, jacobian, node_of = look_back(problem, states)
    gathered, to_start = [np.zeros((0, d))], np.stack(flow)
    for index, sensor in enumerate(problem.model.sensors.values()):
        m = sensor.manifold.dim
        taken = np.flatnonzero((problem.schedule.sensor == index) & (node_of >= first) & (node_of <= last))
        seen = jacobian[taken, :m] @ to_start[node_of[taken] - first]
        white = np.linalg.solve(np.linalg.cholesky(problem.noises(taken, m)), seen)
        gathered.append(white.reshape(-1, d))
    return np.concatenate(gathered)


def _analyse(model: StateSpace, t: int, start: Array, rows: Array) -> Observability:
    d = model.manifold.dim
    units = np.sqrt(np.diag(model.prior.cov))
    root = np.zeros((d, d))
    if len(rows):
        factor = np.linalg.qr(rows, mode="r")
        root[: len(factor)] = factor
    scaled = root * units
    hidden = _null_space(scaled, DECLARED if _declared(model) else DIFFERENCED)
    shown = np.linalg.svd(hidden.T, full_matrices=True)[2][hidden.shape[1] :].T  # what is orthogonal to it
    sizes, turned = np.zeros(0), np.zeros((0, shown.shape[1]))
    if shown.shape[1]:
        _, sizes, turned = np.linalg.svd(scaled @ shown, full_matrices=False)
    information = np.concatenate([sizes**2, np.zeros(hidden.shape[1])])
    weak = [(shown @ turned[k], float(sizes[k] ** 2)) for k in np.flatnonzero(sizes**2 < WEAK)]
    posterior = np.linalg.inv(np.eye(d) + scaled.T @ scaled) if d else np.zeros((0, 0))
    return Observability(
        t,
        np.array(start),
        d - hidden.shape[1],
        d,
        information,
        root.T @ root,
        np.sqrt(np.clip(np.diag(posterior), 0.0, None)),
        tuple(_named(model, start, units, hidden)),
        tuple(NamedDirection(_words(model, start, v, units), v * units, size) for v, size in weak),
    )


def _declared(model: StateSpace) -> bool:
    """Whether no Jacobian has to be differenced."""
    functions = (model.process_functions, *model.sensor_functions.values())
    return all(f.jacobian is not None for f in functions)


def _null_space(scaled: Array, tolerance: float) -> Array:
    """Orthonormal basis (d, k), in units of the prior, of what the rows map to rounding."""
    lengths = np.linalg.norm(scaled, axis=0)
    longest = float(lengths.max(initial=0.0))
    if longest == 0.0:
        return np.eye(scaled.shape[1])
    lengths = np.maximum(lengths, tolerance * longest)
    _, sizes, turned = np.linalg.svd(scaled / lengths)
    lost = turned[sizes <= tolerance * sizes[0]].T / lengths[:, None]
    return np.linalg.qr(lost)[0] if lost.shape[1] else lost


def _named(model: StateSpace, start: Array, units: Array, hidden: Array) -> list[NamedDirection]:
    """Names for a space (d, k) of directions in units of the prior: symmetries first, then what is left."""
    found: list[NamedDirection] = []
    left = hidden
    for symmetry in symmetries(model, start):
        if not left.shape[1]:
            break
        own = symmetry.direction / units
        own = own / np.linalg.norm(own)
        inside = hidden @ (hidden.T @ own)
        fresh = left @ (left.T @ own)
        if np.linalg.norm(own - inside) < INSIDE and np.linalg.norm(fresh) > INSIDE:
            found.append(NamedDirection(symmetry.words, symmetry.direction, 0.0))
            left = _without(left, fresh)
    if left.shape[1]:
        found += [_open(model, start, one, units) for one in pivoted(left).T]
    return found


def _open(model: StateSpace, start: Array, vector: Array, units: Array) -> NamedDirection:
    return NamedDirection(_words(model, start, vector, units), vector * units, 0.0)


def _without(basis: Array, direction: Array) -> Array:
    """A basis of one dimension less, orthogonal to a direction inside it."""
    inside = basis.T @ (direction / np.linalg.norm(direction))
    return np.asarray(basis @ np.linalg.svd(inside[None, :])[2][1:].T)


def _words(model: StateSpace, start: Array, vector: Array, units: Array) -> str:
    """What a direction in units of the prior is called."""
    for symmetry in symmetries(model, start):
        own = symmetry.direction / units
        if abs(own @ vector) > (1.0 - INSIDE) * np.linalg.norm(own) * np.linalg.norm(vector):
            return symmetry.words
    words = in_words(model.manifold, vector)
    about = turning_point(model, start, vector * units)
    if about is not None:
        return f"{about}: {words}"
    return f"{words} (in standard deviations of the prior)" if " " in words else words
