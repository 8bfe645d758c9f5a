"""A number with its 95 % interval."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Estimate"]


class Estimate(NamedTuple):
    """A value and the two ends of its 95 % interval, in one unit."""

    value: float
    low: float
    high: float

    def scaled(self, factor: float) -> Estimate:
        """The same in another unit: all three multiplied."""
        ends = sorted((self.low * factor, self.high * factor))
        return Estimate(self.value * factor, *ends)

    def to_json(self) -> dict[str, float]:
        """Value, low and high by name."""
        return self._asdict()
