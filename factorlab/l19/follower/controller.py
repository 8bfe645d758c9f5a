"""A PID from the line's lateral distance to the robot's turn rate."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Pid", "PidMemory"]


@dataclass(frozen=True, slots=True)
class PidMemory:
    """What a PID remembers: the integral of the error (m s), the error before, and its filtered slope."""

    integral: float = 0.0
    error: float | None = None
    slope: float = 0.0


@dataclass(frozen=True, slots=True)
class Pid:
    """u = kp e + ki ∫e dt + kd de/dt, held between -limit and limit.

    Attributes
    ----------
    kp, ki, kd : gains
    limit : largest output; while it is reached the integral does not grow further (anti-windup)
    filter_s : time constant of the low-pass on the slope, which a noisy error would otherwise swamp

    Notes
    -----
    Looking a distance L ahead, a robot of speed v that follows a circle exactly sees the line L²/2R aside:
    kp = 2 v / L² asks for just the turn rate v/R that it needs, without an integral ("pure pursuit").
    """

    kp: float
    ki: float
    kd: float
    limit: float
    filter_s: float = 0.1

    def step(self, memory: PidMemory, error: float, dt: float) -> tuple[PidMemory, float]:
        """The memory after an error, and the output."""
        slope = memory.slope
        if memory.error is not None:
            slope += dt / (self.filter_s + dt) * ((error - memory.error) / dt - slope)
        integral = memory.integral + error * dt
        wanted = self.kp * error + self.ki * integral + self.kd * slope
        output = min(max(wanted, -self.limit), self.limit)
        if wanted != output and (wanted - output) * error > 0.0:
            integral = memory.integral  # it would only wind up
        return PidMemory(integral, error, slope), output
