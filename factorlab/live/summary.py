"""What a recording from a board amounts to: rate, jitter, losses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.live.rows import described
from sequential.readers.serial import BootFrame

__all__ = ["Recorded", "Timing", "timing_of"]

DRIFT_S = 20.0  # below, the delays of USB hide the difference of two clocks


@dataclass(frozen=True, slots=True)
class Timing:
    """Intervals of samples without a loss between them.

    Parameters
    ----------
    rate : by the board's clock, Hz
    period_ms : median interval
    shortest_ms, longest_ms, sigma_us : of the intervals, by the board's clock
    longest_arrival_ms : longest wait of this computer for the next sample
    clock_error : how much faster the board's clock is than this computer's, as a ratio; None where the
        recording is shorter than 20 s, or the board started again
    """

    rate: float
    period_ms: float
    shortest_ms: float
    longest_ms: float
    sigma_us: float
    longest_arrival_ms: float
    clock_error: float | None


@dataclass(frozen=True, slots=True)
class Recorded:
    """A file, and how complete it is.

    Parameters
    ----------
    path, mode : what was written
    samples : rows of the file
    duration_s : from the first to the last, by the board's clock
    lost : frames that never came; the corrupt ones are among them
    corrupt : frames whose check failed
    discarded : bytes that belong to no frame
    missing : samples that the sensor did not give; raw rows of them are left out
    saturated : samples at the end of their range
    dropped : times that the board had to drop frames, the line being too slow
    repeated, restarts : samples that came twice; starts of the board while it was recorded
    board : its boot frame
    timing : None below two samples
    ended : why the recording ended before it was to, or empty
    """

    path: Path
    mode: str
    samples: int
    duration_s: float
    lost: int
    corrupt: int
    discarded: int
    missing: int
    saturated: int
    dropped: int
    repeated: int
    restarts: int
    board: BootFrame | None
    timing: Timing | None
    ended: str = ""

    def lines(self) -> list[str]:
        """The summary as a person reads it."""
        told = [
            f"{self.path}: {self.samples} samples in {self.duration_s:.2f} s",
            f"board   {described(self.board)}",
        ]
        if self.timing is not None:
            told += _timing_lines(self.timing)
        share = self.lost / max(self.lost + self.samples + self.missing, 1)
        told.append(
            f"losses  frames lost: {self.lost} ({100.0 * share:.3f} %), corrupt: {self.corrupt}, bytes of no "
            f"frame: {self.discarded}"
        )
        for count, what in (
            (self.missing, "samples that the sensor did not give; check its wiring"),
            (self.saturated, "samples at the end of their range; choose a larger one"),
            (self.dropped, "times that the board had no room for a frame; the line is too slow"),
            (self.repeated, "samples that came twice, left out"),
            (self.restarts, "restarts of the board; check its supply"),
        ):
            if count:
                told.append(f"warn    {count} x {what}")
        return told

    def to_json(self) -> dict[str, Any]:
        """The same numbers for a program."""
        from dataclasses import asdict

        document = asdict(self)
        document["path"] = str(self.path)
        return {"schema": 1, **document}


def _timing_lines(timing: Timing) -> list[str]:
    clock = ""
    if timing.clock_error is not None:
        faster = "fast" if timing.clock_error > 0 else "slow"
        clock = f", which is {100.0 * abs(timing.clock_error):.3f} % {faster} by this computer's"
    shortest, longest = f"{timing.shortest_ms:.3f}", f"{timing.longest_ms:.3f} ms"
    return [
        f"rate    {timing.rate:.3f} Hz by the board's clock{clock}",
        f"jitter  period {timing.period_ms:.3f} ms, from {shortest} to {longest}, σ {timing.sigma_us:.1f} µs",
        f"arrival longest wait of this computer for a sample: {timing.longest_arrival_ms:.1f} ms",
    ]


def timing_of(stamps: NDArray[np.int64], arrivals: NDArray[np.int64], *, whole: bool) -> Timing | None:
    """Judge the stamps (N,) of the board and the times (N,) at which they came, both ns.

    Parameters
    ----------
    whole : the board did not start again, so that both clocks can be compared
    """
    if len(stamps) < 2:
        return None
    steps = np.diff(stamps)
    period = float(np.median(steps))
    near = steps[steps < 1.5 * period]  # no loss between
    return Timing(
        rate=1e9 / period,
        period_ms=period * 1e-6,
        shortest_ms=float(near.min()) * 1e-6,
        longest_ms=float(near.max()) * 1e-6,
        sigma_us=float(near.std()) * 1e-3,
        longest_arrival_ms=float(np.diff(arrivals).max()) * 1e-6,
        clock_error=_clock_error(stamps, arrivals) if whole else None,
    )


def _clock_error(stamps: NDArray[np.int64], arrivals: NDArray[np.int64]) -> float | None:
    """Slope between the least delayed arrivals of the first and the last fifth."""
    if stamps[-1] - stamps[0] < DRIFT_S * 1e9:
        return None
    delay = (arrivals - stamps).astype(np.float64)
    fifth = max(len(stamps) // 5, 1)
    first, last = int(np.argmin(delay[:fifth])), len(stamps) - fifth + int(np.argmin(delay[-fifth:]))
    return float((stamps[last] - stamps[first]) / (arrivals[last] - arrivals[first]) - 1.0)
