"""What is kept of one drive: a row a step, its lateral RMS, and how it ended."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower import PERIOD_S, FollowerSettings, Step

__all__ = ["COLUMNS", "SHOWN", "Journey", "row_of"]

COLUMNS = (
    "t_s", "x_m", "y_m", "theta_rad", "x_est_m", "y_est_m", "theta_est_rad", "x_odo_m", "y_odo_m",
    "sigma_along_m", "sigma_left_m", "sigma_theta_rad", "offset_m", "found", "used", "bottom_px", "middle_px",
    "confidence", "v_m_s", "w_rad_s", "lost",
)  # fmt: skip
# what the page draws of a row, in this order
SHOWN = ("t_s", "x_m", "y_m", "x_est_m", "y_est_m", "x_odo_m", "y_odo_m", "offset_m", "w_rad_s")
_SHOWN_AT = tuple(COLUMNS.index(name) for name in SHOWN)


def row_of(step: Step) -> tuple[float, ...]:
    """A step as numbers, in the order of `COLUMNS`; NaN where the line was not found."""
    reading = step.reading
    sigma = (math.sqrt(max(float(step.cov[k, k]), 0.0)) for k in range(3))
    return (
        step.t_s, *map(float, step.pose), *map(float, step.estimate), *map(float, step.odometry[:2]), *sigma,
        float(step.offset_m), float(reading.found), float(reading.used), float(reading.bottom_px),
        float(reading.middle_px), float(reading.confidence), *map(float, step.command), float(step.lost),
    )  # fmt: skip


@dataclass(eq=False)
class Journey:
    """One drive from the start of the line; filled by one thread, read by others.

    Attributes
    ----------
    number : from 1
    settings : those it began with
    rows : a tuple a step, cells as `COLUMNS`
    changes : how many times a setting was changed on the way
    lost_s : when the line was lost for the first time; None while it never was
    arrived : at the end of the line, or of the steps asked for
    unseen_s : how long the estimate has had nothing from the camera
    """

    number: int
    settings: FollowerSettings
    rows: list[tuple[float, ...]] = field(default_factory=list)
    changes: int = 0
    lost_s: float | None = None
    arrived: bool = False
    unseen_s: float = 0.0
    _sum: float = 0.0
    _driven: int = 0

    def add(self, step: Step) -> None:
        """Take note of a step."""
        if not step.lost:
            self._sum += float(step.offset_m) ** 2
            self._driven += 1
        elif self.lost_s is None:
            self.lost_s = step.t_s
        self.unseen_s = 0.0 if step.reading.used else self.unseen_s + PERIOD_S
        self.rows.append(row_of(step))

    @property
    def rms_m(self) -> float | None:
        """Lateral RMS of the steps on which the robot was not lost; None before the first."""
        return math.sqrt(self._sum / self._driven) if self._driven else None

    @property
    def length_m(self) -> float:
        """Way that was driven."""
        if len(self.rows) < 2:
            return 0.0
        table = self.table()
        return float(np.hypot(np.diff(table["x_m"]), np.diff(table["y_m"])).sum())

    def table(self) -> dict[str, NDArray[np.float64]]:
        """Columns (N,) by name."""
        return dict(zip(COLUMNS, np.array(self.rows).reshape(-1, len(COLUMNS)).T, strict=True))

    def shown(self, begin: int, end: int) -> list[list[float]]:
        """Steps for the page, cells as `SHOWN`, to a tenth of a millimetre."""
        return [[round(row[k], 4) for k in _SHOWN_AT] for row in self.rows[begin:end]]

    def to_json(self) -> dict[str, Any]:
        """In a line of a table."""
        return {
            "number": self.number,
            "settings": asdict(self.settings),
            "changes": self.changes,
            "steps": len(self.rows),
            "t_s": self.rows[-1][0] if self.rows else 0.0,
            "rms_m": self.rms_m,
            "lost_s": self.lost_s,
            "arrived": self.arrived,
        }
