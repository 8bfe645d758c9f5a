"""R from a sensor at rest: what is left once a trend and a few outliers are taken out."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from sequential.history import Innovations
from sequential.log import SensorLog, Stream
from sequential.manifold import Manifold, Vector
from sequential.models import LinearSensor
from sequential.noise import require_covariance
from sequential.tuning.correlation import effective_counts
from sequential.tuning.resting import Resting, at_rest, line_of, resolution
from sequential.tuning.result import Tuning, log_sigma
from sequential.tuning.verdict import Verdict, judge

__all__ = ["noise_from_still"]

Array = NDArray[np.float64]
FEWEST = 10  # readings
STRONG = 0.5  # an effective number below this share of the readings is worth a sentence


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """One axis of a recording at rest."""

    sigma: float
    limits: tuple[float, float]
    notes: tuple[str, ...]
    faults: tuple[str, ...]


def noise_from_still(
    source: Stream | SensorLog,
    name: str | None = None,
    *,
    declared: ArrayLike | None = None,
    lsb: ArrayLike | None = None,
    manifold: Manifold | None = None,
    unit: str = "",
) -> Tuning:
    """Measurement noise of a sensor that did not move: σ of each axis, and the whole covariance.

    A line is fitted robustly and taken out, readings far beyond the noise are left out, and both are told.
    `Tuning.values` are standard deviations by axis, `Tuning.matrices["noise_cov"]` is R (m, m) for a sensor
    model, `Tuning.message` says why the recording may not be what was meant: not still, or correlated.

    Parameters
    ----------
    source : a stream, or a log together with the `name` of a stream
    declared : noise_cov in use so far, for a verdict before and after
    lsb : resolution of each axis, or of all; by default read off the values where they lie on a grid
    manifold : where the readings live, such as `SO2()` for a heading; a plain vector unless given
    unit : of the readings, for tables

    Raises
    ------
    DataError
        where there are fewer than ten readings, or they are all the same and no `lsb` is given.

    Notes
    -----
    An interval is the χ² one of a variance, with the effective number of samples in the place of their
    count (`effective_counts`).  A variance below LSB²/12 is raised to it: rounding alone makes that much.
    """
    began = time.perf_counter()
    name, stream = _stream_of(source, name)
    space = Vector(stream.values.shape[1]) if manifold is None else manifold
    values, t, dropped = _tangent(name, stream, space)
    m = values.shape[1]
    steps = np.broadcast_to(np.asarray(np.nan if lsb is None else lsb, dtype=np.float64), (m,))
    steps = np.array([s if s > 0 else resolution(v) for s, v in zip(steps, values.T, strict=True)])
    labels = [f"v{k}" for k in range(m)] if isinstance(space, Vector) else list(space.labels())
    names = [f"{name} σ"] if m == 1 else [f"{name} {label} σ" for label in labels]
    rest = at_rest(t, values, steps)
    axes = [_axis(label, rest, k, t, steps[k], unit) for k, label in enumerate(names)]
    cov = _covariance(rest, steps)
    notes = [f"{dropped} readings of {name} hold NaN and were left out"] if dropped else []
    notes += rest.notes(name, t)
    before, after = _verdicts(name, rest, t, cov, declared)
    faults = [*rest.faults(name, t), *(fault for axis in axes for fault in axis.faults)]
    own = require_covariance(declared, m, "the declared noise_cov") if declared is not None else None
    limits = {label: axis.limits for label, axis in zip(names, axes, strict=True)}
    return Tuning(
        values={label: axis.sigma for label, axis in zip(names, axes, strict=True)},
        initial={} if own is None else dict(zip(names, np.sqrt(np.diag(own)).tolist(), strict=True)),
        log_likelihood_before=float("nan") if own is None else _log_likelihood(rest, own),
        log_likelihood_after=_log_likelihood(rest, cov),
        evaluations=0,
        seconds=time.perf_counter() - began,
        message="; ".join(faults),
        decades={label: log_sigma(*ends) for label, ends in limits.items()},
        converged=not rest.faults(name, t),
        method="still",
        units=dict.fromkeys(names, unit),
        limits=limits,
        matrices={"noise_cov": cov},
        notes=(*notes, *(note for axis in axes for note in axis.notes)),
        before=before,
        after=after,
    )


def _stream_of(source: Stream | SensorLog, name: str | None) -> tuple[str, Stream]:
    if isinstance(source, Stream):
        return name or "reading", source
    if name is None:
        if len(source) != 1:
            raise DataError(f"log {source.name!r} has the streams {', '.join(source)}; name one of them")
        name = next(iter(source))
    return name, source[name]


def _tangent(name: str, stream: Stream, space: Manifold) -> tuple[Array, Array, int]:
    """Readings (N, m) about one of them, times (N,) s, and how many were not finite."""
    if stream.values.shape[1] != space.size:
        raise DataError(f"{name!r} has {stream.values.shape[1]} columns, {space} stores {space.size} numbers")
    whole = np.isfinite(stream.values).all(axis=1)
    kept = stream.values[whole]
    if len(kept) < FEWEST:
        raise DataError(
            f"{name!r} has {len(kept)} readings; noise at rest needs {FEWEST} at least, better a thousand"
        )
    values = kept if isinstance(space, Vector) else space.local(kept[len(kept) // 2], kept)
    return np.asarray(values, dtype=np.float64), (stream.t[whole] - stream.t[0]) * 1e-9, int((~whole).sum())


def _axis(label: str, rest: Resting, k: int, t: Array, step: float, unit: str) -> _Axis:
    """σ of one axis with its interval, and what there is to say about it."""
    from scipy.special import chdtri

    own = np.where(rest.kept, rest.residual[:, k], np.nan)
    for_mean, for_variance, lag = effective_counts(own)
    n, floor = int(rest.kept.sum()), step / 12.0**0.5
    freedom = max(for_variance * (1.0 - 2.0 / n), 1.0)
    raw = float(np.sqrt(np.nansum(own**2) / (n - 2)))
    if max(raw, floor) <= 0.0:
        raise DataError(
            f"{label}: every reading is the same, so the noise is below the resolution; give lsb=… (the size "
            "of one step of the sensor) and LSB²/12 will be its variance"
        )
    sigma = max(raw, floor)
    low, high = (raw * (freedom / float(chdtri(freedom, p))) ** 0.5 for p in (0.025, 0.975))
    notes, faults = [], []
    if raw < floor:
        notes.append(
            f"{label}: the scatter {raw:.3g} is below that of rounding to {step:.3g}, which was taken"
        )
    elif step > 0.0 and raw < step:
        notes.append(
            f"{label}: the noise is below one step of the sensor ({step:.3g}); σ is only roughly known"
        )
    if for_variance < STRONG * n:
        faults.append(
            f"the readings behind {label} are correlated ({lag:+.2f} from one to the next; {n} of them are "
            f"worth {for_variance:.0f}): a filter takes noise for white, so raise R, or estimate the slow "
            "part as a state"
        )
    slope = line_of(t, rest.trend[:, k])
    drift, error = slope * float(np.ptp(t)), sigma * (12.0 / for_mean) ** 0.5
    if abs(drift) > 3.0 * error:
        told = f"{drift:+.3g} {unit}".strip()
        notes.append(
            f"{label}: a drift of {told} over {np.ptp(t):.4g} s ({abs(drift) / sigma:.1f} σ) was taken out"
        )
    return _Axis(sigma, (max(low, floor), max(high, floor)), tuple(notes), tuple(faults))


def _covariance(rest: Resting, steps: Array) -> Array:
    """(m, m), variances not below those of rounding."""
    own = rest.residual[rest.kept]
    cov = own.T @ own / (len(own) - 2)
    floor = np.maximum(steps**2 / 12.0, np.diag(cov))
    cov = cov + np.diag(floor - np.diag(cov))
    return np.asarray(cov)


def _log_likelihood(rest: Resting, cov: Array) -> float:
    """Of the readings kept, taken for white and Gaussian."""
    own = rest.residual[rest.kept]
    nis = np.einsum("ni,ij,nj->n", own, np.linalg.inv(cov), own)
    constant = np.linalg.slogdet(2.0 * np.pi * cov)[1]
    return float(-0.5 * np.sum(nis + constant))


def _verdicts(
    name: str, rest: Resting, t: Array, cov: Array, declared: ArrayLike | None
) -> tuple[Verdict | None, Verdict]:
    """Normalised squares and whiteness of the readings about their line, with R as declared and as found."""

    def with_noise(noise: Array) -> Verdict:
        stamps, rows = np.round(t * 1e9).astype(np.int64), np.arange(len(t))
        spread = np.broadcast_to(noise, (len(t), *noise.shape))
        seen: Mapping[str, Innovations] = {name: Innovations(stamps, rows, rest.residual, spread, rest.kept)}
        return judge(seen, {name: LinearSensor(np.eye(len(noise)), noise)})

    before = None
    if declared is not None:
        before = with_noise(np.asarray(require_covariance(declared, len(cov), "the declared noise_cov")))
    return before, with_noise(cov)
