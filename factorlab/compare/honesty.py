"""Whether a covariance can be believed: normalised errors and innovations beside what χ² expects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from factorlab.compare.accuracy import Errors
from sequential.errors import NotPositiveDefiniteError
from sequential.evaluate import Consistency, block_bootstrap, chi2_band, nis_summary, summarise
from sequential.evaluate.consistency import chi2_quantile, whole_nis
from sequential.history import Innovations

__all__ = ["Nis", "NormalisedError", "nis_of", "normalised_error_of"]

Band = tuple[float, float]


@dataclass(frozen=True, slots=True)
class NormalisedError:
    """Normalised errors of one run.

    `band95` holds the mean of independent values; `bootstrap_band95` is what resampling whole blocks (gaps
    between used readings) says about the mean that was found, correlation and heavy tails included; None
    where there is but one block.  `tail_share` is the share of values beyond the 95 % quantile of χ².
    """

    mean: float
    median: float
    expected: float
    median_expected: float
    band95: Band
    bootstrap_band95: Band | None
    tail_share: float
    tail_expected: float
    inside: bool
    count: int
    blocks: int
    against: str

    def to_json(self) -> dict[str, Any]:
        """Plain numbers under the names of the fields."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, slots=True)
class Nis:
    """Normalised innovations squared of accepted readings: all sensors together, and each by its name.

    `inside` says whether the mean is inside its band, `share_inside` how many single values are inside
    theirs.  `kind` is "filter" (predicted from the past) or "leave-one-out" (from all other readings).
    """

    mean: float
    median: float
    expected: float
    band95: Band
    inside: bool
    share_inside: float
    kind: str
    count: int
    rejected: int = 0
    sensors: Mapping[str, Nis] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Plain numbers; `sensors` only where there are several."""
        plain = {name: getattr(self, name) for name in self.__slots__ if name != "sensors"}
        if len(self.sensors) > 1:
            plain["sensors"] = {name: nis.to_json() for name, nis in self.sensors.items()}
        return plain


def normalised_error_of(errors: Errors, rng: np.random.Generator) -> NormalisedError | None:
    """Summary of the normalised errors of one run; None where a covariance cannot be a unit of anything."""
    try:
        values = errors.normalised()
    except NotPositiveDefiniteError:
        return None
    held = summarise(values, errors.error.shape[1], errors.against)
    blocks = len(np.unique(errors.block))
    band = None
    if blocks > 1:
        resampled = block_bootstrap(values, errors.block, rng)
        band = (resampled.low, resampled.high)
    return NormalisedError(
        mean=held.mean,
        median=held.median,
        expected=held.expected,
        median_expected=held.expected_median,
        band95=held.band,
        bootstrap_band95=band,
        tail_share=held.tail_share,
        tail_expected=0.05,
        inside=held.inside_band,
        count=held.count,
        blocks=blocks,
        against=errors.against,
    )


def nis_of(innovations: Mapping[str, Innovations]) -> Nis | None:
    """NIS over all sensors; None where there is no innovation."""
    each = {name: taken for name, taken in innovations.items() if taken.accepted.any()}
    if not each:
        return None
    sensors = {name: _one(nis_summary(taken), taken) for name, taken in each.items()}
    if len(sensors) == 1:
        (only,) = sensors.values()
        return only
    return _together(each, sensors)


def _one(found: Consistency, taken: Innovations) -> Nis:
    return Nis(
        found.mean,
        found.median,
        found.expected,
        found.band,
        found.inside_band,
        _share_inside(taken),
        found.kind,
        found.count,
        int((~taken.accepted).sum()),
    )


def _together(each: Mapping[str, Innovations], sensors: Mapping[str, Nis]) -> Nis:
    """Sums of independent χ² values are χ² with the sum of their freedoms."""
    values = np.concatenate([whole_nis(taken)[taken.accepted] for taken in each.values()])
    freedom = round(sum(nis.expected * nis.count for nis in sensors.values()))
    low, high = (edge / len(values) for edge in chi2_band(freedom, 1))
    mean = float(values.mean())
    return Nis(
        mean,
        float(np.median(values)),
        freedom / len(values),
        (low, high),
        low <= mean <= high,
        sum(nis.share_inside * nis.count for nis in sensors.values()) / len(values),
        next(iter(sensors.values())).kind,
        len(values),
        sum(nis.rejected for nis in sensors.values()),
        sensors,
    )


def _share_inside(taken: Innovations) -> float:
    values, m = whole_nis(taken)[taken.accepted], taken.residual.shape[1]
    return float(np.mean((values >= chi2_quantile(0.025, m)) & (values <= chi2_quantile(0.975, m))))
