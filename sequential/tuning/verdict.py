"""Whether a filter knows how surprised it should be: mean NIS beside its band, and whiteness."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sequential.evaluate.consistency import Consistency, summarise
from sequential.evaluate.whiteness import Whiteness, whiteness
from sequential.history import Innovations
from sequential.model import SensorModel
from sequential.tuning.robust import bounded_nis

__all__ = ["Verdict", "judge"]

SURE = 0.001  # p-value below which correlation counts: several sensors and axes are tested at once
ENOUGH = 30  # readings: with fewer, correlation is not judged


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """Innovations beside what χ² and white noise expect of them, sensor by sensor.

    `nis` holds the mean NIS and its band, NIS bounded where a sensor has a loss or a gate; `white` the test
    for whiteness, absent where there are fewer than thirty readings.
    """

    nis: Mapping[str, Consistency]
    white: Mapping[str, Whiteness] = field(default_factory=dict)
    bounded: Mapping[str, str] = field(default_factory=dict)  # sensors whose NIS is, and by what

    @property
    def consistent(self) -> bool:
        """Whether every mean NIS lies in its 95 % band."""
        return all(one.inside_band for one in self.nis.values())

    @property
    def whitened(self) -> bool:
        """Whether no sensor's innovations are correlated."""
        return all(one.white for one in self.white.values())

    @property
    def sentence(self) -> str:
        """Mean NIS, band, and correlation where there is one, in words."""
        return "; ".join(self._of(name) for name in self.nis)

    def _of(self, name: str) -> str:
        one = self.nis[name]
        if not one.count:
            return f"NIS of {name}: no reading"
        low, high = one.band
        band = f"95 % band {low:.3g}-{high:.3g}"
        by = f" (bounded by its {self.bounded[name]})" if name in self.bounded else ""
        told = f"mean NIS of {name}{by} {one.mean:.3g}, {one.expected:.3g} expected ({band}): {one.verdict}"
        test = self.white.get(name)
        if test is None:
            return told
        if test.white:
            return f"{told}, innovations white"
        lag = float(test.correlation[0][np.argmax(np.abs(test.correlation[0]))])
        if abs(lag) <= test.bound:
            return f"{told}, innovations correlated over several readings"
        return f"{told}, innovations correlated ({lag:+.2f} from one to the next)"

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "consistent": self.consistent,
            "white": self.whitened,
            "sentence": self.sentence,
            "sensors": {name: self._plain(name) for name in self.nis},
        }

    def _plain(self, name: str) -> dict[str, Any]:
        one, test = self.nis[name], self.white.get(name)
        plain: dict[str, Any] = {
            "mean_nis": one.mean,
            "bounded_by": self.bounded.get(name),
            "expected": one.expected,
            "band95": list(one.band),
            "inside": one.inside_band,
            "verdict": one.verdict,
            "fraction_gated": one.fraction_gated,
            "count": one.count,
        }
        if test is not None:
            plain |= {"white": test.white, "whiteness_p_value": test.p_value}
        return plain


def judge(innovations: Mapping[str, Innovations], sensors: Mapping[str, SensorModel]) -> Verdict:
    """The verdict on a filter's innovations.

    Parameters
    ----------
    sensors : of the model, for their gates and losses
    """
    nis, white, bounded = {}, {}, {}
    for name, seen in innovations.items():
        nis[name] = _consistency(seen, sensors[name])
        if sensors[name].loss is not None or sensors[name].gate is not None:
            bounded[name] = "gate" if sensors[name].loss is None else "loss"
        if int(seen.accepted.sum()) >= ENOUGH:
            white[name] = whiteness(seen, level=SURE)
    return Verdict(nis, white, bounded)


def _consistency(seen: Innovations, sensor: SensorModel) -> Consistency:
    """Readings with missing components have fewer degrees of freedom: the mean number is what is expected."""
    values, rows = bounded_nis(seen, sensor), seen.dof()
    if sensor.gate is None:  # with one, a rejected reading counts with the NIS of the gate
        values, rows = values[seen.accepted], rows[seen.accepted]
    found = summarise(values, seen.residual.shape[1], seen.kind)
    gated = float(np.mean(~seen.accepted)) if len(seen.t) else 0.0
    if len(rows) and (rows != rows[0]).any():
        from scipy.special import chdtri

        total = int(rows.sum())
        low, high = (float(chdtri(total, p)) / len(rows) for p in (0.975, 0.025))
        inside, expected = low <= found.mean <= high, total / len(rows)
        found = replace(found, expected=expected, band=(low, high), inside_band=inside)
    return replace(found, fraction_gated=gated)
