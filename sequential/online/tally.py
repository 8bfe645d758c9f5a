"""What became of the events of a stream: counts, and sentences about what was left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

__all__ = ["Summary", "Tally"]


@dataclass(frozen=True, slots=True)
class Summary:
    """Counts of events by what became of them.

    `used` events went into the estimate, `late` ones of them after a newer event; `replayed` counts what
    was done again.  `rejected` came more than `max_delay` seconds late, the worst of each stream by
    `worst` seconds; `early` readings lie before the start; `missing` ones had no component.
    """

    max_delay: float
    used: int
    late: int
    replayed: int
    missing: int
    rejected: Mapping[str, int]
    early: Mapping[str, int]
    worst: Mapping[str, float]

    @property
    def message(self) -> str:
        """What was left out, and what to do; empty where all was used."""
        said = [
            f"{count} events of {name!r} came more than max_delay={self.max_delay:g} s late and were left "
            f"out, the worst by {self.worst[name]:.3f} s: raise max_delay to that, or go without them"
            for name, count in self.rejected.items()
        ]
        said += [f"{count} readings of {name!r} lie before the start" for name, count in self.early.items()]
        if self.missing:
            said.append(f"{self.missing} readings had no component and said nothing")
        return "; ".join(said)


@dataclass(slots=True)
class Tally:
    """The counts while they grow."""

    max_delay: float
    used: int = 0
    late: int = 0
    replayed: int = 0
    missing: int = 0
    rejected: Counter[str] = field(default_factory=Counter)
    early: Counter[str] = field(default_factory=Counter)
    worst: dict[str, float] = field(default_factory=dict)

    def reject(self, name: str, lateness: float) -> None:
        """Count an event that came too late, by so many seconds."""
        self.rejected[name] += 1
        self.worst[name] = max(lateness, self.worst.get(name, 0.0))

    def summary(self) -> Summary:
        """The counts so far."""
        return Summary(
            self.max_delay,
            self.used,
            self.late,
            self.replayed,
            self.missing,
            dict(self.rejected),
            dict(self.early),
            dict(self.worst),
        )
