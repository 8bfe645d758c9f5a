"""The line follower of challenge D2, simulated end to end: a line, a camera, a detector, a filter, a PID.

drive = simulate(FollowerSettings(curve="slalom", noise=40.0))       # 500 steps of 50 ms, as arrays
follower = Follower()                                                # or one step at a time
follower.step().offset_m
sweep([80.0, 100.0, 120.0]).noise_limit()                            # up to which noise it keeps the line
"""

from factorlab.l19.follower.curves import CURVES, Track, track
from factorlab.l19.follower.drive import Drive, simulate
from factorlab.l19.follower.eye import BOTTOM, MIDDLE
from factorlab.l19.follower.film import write_film
from factorlab.l19.follower.follower import OFF_M, Follower, Reading, Step
from factorlab.l19.follower.robot import CAMERA, MOUNT, PERIOD_S
from factorlab.l19.follower.settings import DETECTORS, LIMITS, FollowerSettings
from factorlab.l19.follower.sweep import Sweep, sweep

__all__ = [
    "BOTTOM",
    "CAMERA",
    "CURVES",
    "DETECTORS",
    "LIMITS",
    "MIDDLE",
    "MOUNT",
    "OFF_M",
    "PERIOD_S",
    "Drive",
    "Follower",
    "FollowerSettings",
    "Reading",
    "Step",
    "Sweep",
    "Track",
    "simulate",
    "sweep",
    "track",
    "write_film",
]
