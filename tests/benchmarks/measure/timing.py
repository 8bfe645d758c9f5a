"""CPU time of pieces of work, taken in turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import median
from time import process_time

__all__ = ["cpu_seconds"]

SHORTEST = 0.01  # s of CPU in one reading of the clock


def cpu_seconds(works: Mapping[str, Callable[[], object]], rounds: int = 9) -> dict[str, float]:
    """Median CPU seconds of each piece, all threads of this process together.

    After one warm-up each, rounds in turn; what is short is repeated until a reading of the clock covers at
    least SHORTEST.  Wall time would count what other processes of a shared machine do meanwhile.
    """
    repeats = {}
    for name, work in works.items():
        work()
        repeats[name] = max(1, round(SHORTEST / max(_seconds(work, 1), 1e-6) + 0.5))
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            times[name].append(_seconds(work, repeats[name]))
    return {name: median(values) for name, values in times.items()}


def _seconds(work: Callable[[], object], repeats: int) -> float:
    began = process_time()
    for _ in range(repeats):
        work()
    return (process_time() - began) / repeats
