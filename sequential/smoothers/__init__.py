"""Smoothers: what the whole log says about each moment of it."""

from sequential.smoothers.backward_simulation import BackwardSimulation
from sequential.smoothers.fixed_lag import FixedLagSmoother
from sequential.smoothers.iterated import IteratedSmoother
from sequential.smoothers.rauch_tung_striebel import RauchTungStriebel

__all__ = ["BackwardSimulation", "FixedLagSmoother", "IteratedSmoother", "RauchTungStriebel"]
