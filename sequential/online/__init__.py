"""Filters fed sample by sample, with late readings."""

from sequential.online.arrivals import Arrivals, Event, arrivals
from sequential.online.belief import Belief, Innovation
from sequential.online.online import Online
from sequential.online.replay import Estimate, Replay
from sequential.online.stream import Estimates, stream
from sequential.online.tally import Summary

__all__ = [
    "Arrivals",
    "Belief",
    "Estimate",
    "Estimates",
    "Event",
    "Innovation",
    "Online",
    "Replay",
    "Summary",
    "arrivals",
    "stream",
]
