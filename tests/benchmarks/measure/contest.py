"""Libraries on the same case in turn, each held to the right answer before it is timed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .figures import say
from .peers import Builder
from .timing import cpu_seconds

__all__ = ["Entry", "contest", "present"]

Entry = tuple[Callable[[], Any], int]  # a piece of work that gives a mean, and how many steps it takes
NEAR = 1e-6  # how far a mean may be from the right one


def present(case: Any, peers: Mapping[str, tuple[Builder, int]]) -> dict[str, Entry]:
    """The peers that are installed; of the others a line on stderr."""
    found: dict[str, Entry] = {}
    for name, (build, steps) in peers.items():
        try:
            found[name] = build(case, steps), steps
        except ImportError as error:
            say(f"  {name} left out: {error}")
    return found


def contest(
    expected: Callable[[int], np.ndarray],
    ours: Mapping[str, Entry],
    peers: Mapping[str, Entry],
    rounds: int = 9,
) -> dict[str, float]:
    """CPU microseconds a step, by name.

    `expected` gives the mean to be found after so many steps.  A wrong result of ours ends the run; a peer
    with one is left out.
    """
    right: dict[str, Entry] = {}
    for name, (work, steps) in (ours | dict(peers)).items():
        error = float(np.abs(np.ravel(work()) - expected(steps)).max())
        if error <= NEAR:
            right[name] = work, steps
        elif name in ours:
            raise SystemExit(f"{name}: after {steps} steps the mean is {error:.1e} from what C has")
        else:
            say(f"  {name} left out: after {steps} steps its mean is {error:.1e} from ours")
    seconds = cpu_seconds({name: work for name, (work, _) in right.items()}, rounds)
    return {name: value / right[name][1] * 1e6 for name, value in seconds.items()}
