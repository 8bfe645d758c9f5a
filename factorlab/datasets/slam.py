"""A recording made ready for SLAM: the problem, what it is scored against, how it is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets.dataset import Truth
from sequential.slam import SlamProblem

__all__ = ["SlamDataset"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SlamDataset:
    """One problem of variables and factors with what is known about it.

    Parameters
    ----------
    problem : all measurements, and nothing of the truth but where the first pose is
    truth : of the poses, for scoring only; None where there is none
    landmarks : true places by index, {index: (axes,)}, for scoring and the map only
    axes : 2 or 3, of positions
    aligned : "none" (the first pose is known), or "rigid" where the frame is arbitrary
    reference : figures others reached on the same data, by name: {"chi2": 45.0042}
    notes : one sentence each about what a reader of a result should know
    default_estimators : names for a comparison that names none
    isam_every : steps between relinearisations of iSAM2: 1 unless the graph is large
    graph_options : keyword arguments for graph estimators, such as {"initial": "lago"}
    """

    name: str
    title: str
    problem: SlamProblem
    truth: Truth | None = None
    landmarks: Mapping[int, Array] = field(default_factory=dict)
    axes: int = 2
    aligned: str = "none"
    reference: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    default_estimators: tuple[str, ...] = ("ekf_slam", "isam2", "isam2_final", "fixed_lag", "batch")
    isam_every: int = 1
    graph_options: Mapping[str, object] = field(default_factory=dict)
    build: Callable[..., SlamProblem] | None = None
