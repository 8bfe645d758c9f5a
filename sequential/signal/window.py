"""Windows that slide: which samples each output is made of, and what happens at the ends."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError
from sequential.signal.samples import SignalFilter

__all__ = ["Edges", "Placed", "WindowState", "Windowed"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Edges = Literal["shrink", "nearest", "reflect", "nan"]
EDGES = ("shrink", "nearest", "reflect", "nan")
PAD: dict[str, Literal["edge", "symmetric"]] = {"nearest": "edge", "reflect": "symmetric"}


class Placed(NamedTuple):
    """Output i is made of x[low[i]:high[i]]; `whole` says where the window lies inside the signal."""

    x: Array  # (N + padding, m)
    low: Ints  # (N,)
    high: Ints  # (N,)
    whole: NDArray[np.bool_]  # (N,)


class WindowState(NamedTuple):
    """The last samples in the order they came, and those that are numbers in order of size."""

    arrived: tuple[float, ...] = ()
    ordered: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Windowed(SignalFilter):
    """What the filters of a sliding window have in common.

    Parameters
    ----------
    window : k, samples, odd or even
    centred : use k // 2 samples of the past and (k - 1) // 2 of the future instead of the last k
    edges : at the ends of the signal: `"shrink"`, the part of the window that is there; `"nearest"`, the end
        sample repeated; `"reflect"`, the signal mirrored (centred only, it needs the future); `"nan"`, no
        output

    Raises
    ------
    ModelError
        where one of them cannot be.
    """

    window: int
    centred: bool = False
    edges: Edges = "shrink"

    def __post_init__(self) -> None:
        if isinstance(self.window, bool) or self.window != int(self.window) or self.window < 1:
            raise ModelError(f"a window holds a whole number of samples, 1 or more; got {self.window}")
        if self.edges not in EDGES:
            raise ModelError(f"edges are treated as one of {', '.join(EDGES)}; got {self.edges!r}")
        if self.edges == "reflect" and not self.centred:
            raise ModelError(
                "edges='reflect' mirrors samples that a causal window has not seen yet; use 'shrink', "
                "'nearest' or 'nan', or centred=True"
            )

    @property
    def ahead(self) -> int:
        """Samples of the future that an output needs."""
        return (self.window - 1) // 2 if self.centred else 0

    def place(self, x: Array) -> Placed:
        """Lay the window on every sample of x (N, m)."""
        ahead, count = self.ahead, len(x)
        behind = self.window - 1 - ahead
        first = np.arange(count, dtype=np.int64) - behind
        last = first + self.window
        whole = (first >= 0) & (last <= count)
        if self.edges in PAD:
            padded = np.pad(x, ((behind, ahead), (0, 0)), mode=PAD[self.edges])
            return Placed(padded, first + behind, last + behind, whole)
        return Placed(x, np.maximum(first, 0), np.minimum(last, count), whole)

    def settled(self, y: Array, placed: Placed) -> Array:
        """Without the outputs that `edges="nan"` refuses."""
        if self.edges == "nan":
            y[~placed.whole] = np.nan
        return y

    def start(self) -> WindowState:
        """State before the first sample."""
        return WindowState()

    def push(self, state: WindowState, x: float) -> WindowState:
        """The window one sample later: O(k) to copy, O(log k) comparisons."""
        if self.ahead:
            raise ModelError(
                f"{type(self).__name__}(centred=True) needs {self.ahead} samples of the future; "
                "on line use centred=False"
            )
        if math.isinf(x):
            raise DataError(f"{type(self).__name__} was given {x}; write NaN where a sample is missing")
        arrived, ordered = state.arrived, list(state.ordered)
        if not arrived and self.edges == "nearest":
            arrived, ordered = (x,) * self.window, [] if math.isnan(x) else [x] * self.window
        if len(arrived) == self.window:
            if not math.isnan(arrived[0]):
                del ordered[bisect.bisect_left(ordered, arrived[0])]
            arrived = arrived[1:]
        if not math.isnan(x):
            bisect.insort(ordered, x)
        return WindowState((*arrived, x), tuple(ordered))

    def is_refused(self, state: WindowState) -> bool:
        """Whether there is no output yet."""
        return not state.ordered or (self.edges == "nan" and len(state.arrived) < self.window)
