"""The line that a robot follows: how far beside it the robot is, and where the line leads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from factorlab.live.camera.reading import Column, Dots, Label, Line, Mark, Number, Reading, Table
from factorlab.live.camera.task import Action, Task
from sequential.errors import DataError
from vision3d.frames import Frame
from vision3d.lines import GroundHomography, GroundReading, LineReading, LineSettings, find_line

__all__ = ["LineTask"]

POLARITIES = {"auto": "Dark or light", "dark": "Dark line", "light": "Light line"}
SURE = 0.8


def nowhere() -> GroundHomography | None:
    """No ground is known."""
    return None


class LineTask(Task):
    """Finds the line on the ground in every frame.

    Parameters
    ----------
    settings : where to look, and for what
    ground : gives the map to the ground as it is known by now, or None: pixels only
    """

    name: ClassVar = "line"
    columns: ClassVar = (
        "found", "offset", "offset_sigma", "heading_deg", "heading_sigma_deg", "confidence",
        "bottom_x_px", "bottom_y_px", "middle_x_px", "middle_y_px", "width_px",
        "left_m", "left_sigma_m", "ground_heading_deg", "ground_heading_sigma_deg",
    )  # fmt: skip

    def __init__(
        self, settings: LineSettings | None = None, ground: Callable[[], GroundHomography | None] = nowhere
    ) -> None:
        self._settings, self._ask, self._ground = settings or LineSettings(), ground, ground()
        self._frames = self._found = 0

    @property
    def actions(self) -> tuple[Action, ...]:
        """One button a polarity."""
        return tuple(one for one in POLARITIES.items() if one[0] != self._settings.polarity)

    def prepare(self) -> None:
        """Load what looks for lines."""
        find_line(np.zeros((48, 64), np.uint8), self._settings)

    def read(self, frame: Frame) -> Reading:
        """The line in this frame, or why there is none."""
        found = find_line(np.asarray(frame.grey), self._settings)
        self._frames += 1
        self._found += found.found
        sigmas = spread(found, frame.image.shape[1])
        place = self._place(found)
        angle = np.degrees(found.heading_rad)
        return Reading(
            _headline(found),
            "idle" if not found.found else "good" if found.confidence >= SURE else "warn",
            numbers=(
                *_metres(place),
                Number("offset in the image", finite(100 * found.offset), "%", 1, finite(100 * sigmas[0])),
                Number("to the right in it", finite(angle), "°", 1, finite(np.degrees(sigmas[1]))),
                Number("confidence", found.confidence, "", 2),
                Number("width", finite(found.width_px), "px", 1),
                Number("seen in", 100.0 * self._found / self._frames, "% of the frames", 0),
            ),
            tables=(_reasons(found),) if found.parts else (),
            traces={"offset, %": finite(100 * found.offset), "to the right, °": finite(angle)},
            marks=_marks(found, frame.image.shape),
            notes=(found.reason,) if found.reason else (),
            rows=(self._row(found, sigmas, place),),
        )

    def act(self, action: str) -> str:
        """Change what is looked for."""
        if action not in POLARITIES:
            raise DataError(f"a line is {', '.join(POLARITIES)}; got {action!r}")
        self._settings = replace(self._settings, polarity=action)  # type: ignore[arg-type]
        return f"looking for: {POLARITIES[action].lower()}"

    def restart(self) -> None:
        """Count frames anew; take the ground that is known now."""
        self._ground = self._ask()
        self._frames = self._found = 0

    def summary(self) -> dict[str, object]:
        """In how many frames there was a line."""
        return {"frames": self._frames, "found": self._found}

    def _place(self, found: LineReading) -> GroundReading | None:
        """The line on the ground; None where it is not known, or the far row shows the horizon."""
        if self._ground is None or not found.found:
            return None
        try:
            return self._ground.read(found)
        except DataError:
            return None

    def _row(
        self, found: LineReading, sigmas: tuple[float, float], place: GroundReading | None
    ) -> dict[str, Any]:
        values = (
            int(found.found), found.offset, sigmas[0], *np.degrees([found.heading_rad, sigmas[1]]).tolist(),
            found.confidence, *found.bottom_px, *found.middle_px, found.width_px,
        )  # fmt: skip
        row: dict[str, Any] = dict(zip(self.columns, values, strict=False))
        if place is not None:
            left, turn = np.sqrt(np.diag(place.cov)).tolist()
            row |= {"left_m": place.offset_m, "left_sigma_m": left}
            row |= {
                "ground_heading_deg": float(np.degrees(place.heading_rad)),
                "ground_heading_sigma_deg": float(np.degrees(turn)),
            }
        return row


def _metres(place: GroundReading | None) -> tuple[Number, ...]:
    """Where the line is on the ground."""
    if place is None:
        return ()
    left, turn = np.sqrt(np.diag(place.cov)).tolist()
    heading = float(np.degrees(place.heading_rad))
    return (
        Number("line on the left by", 1e3 * place.offset_m, "mm", 1, 1e3 * left),
        Number("leading left by", heading, "°", 1, float(np.degrees(turn))),
    )


def spread(found: LineReading, width: int) -> tuple[float, float]:
    """Standard deviations of offset and heading (rad), from the covariance of the two middles."""
    if not found.found:
        return float("nan"), float("nan")
    cov, rise = found.cov_px, found.bottom_px[1] - found.middle_px[1]
    across = found.middle_px[0] - found.bottom_px[0]
    slope_var = cov[0, 0] + cov[1, 1] - 2.0 * cov[0, 1]
    return float(np.sqrt(cov[0, 0]) / (0.5 * width)), float(np.sqrt(slope_var) * rise / (rise**2 + across**2))


def finite(value: float) -> float | None:
    """The number, or None where it is none."""
    return float(value) if np.isfinite(value) else None


def _headline(found: LineReading) -> str:
    if not found.found:
        return "no line"
    side = "left" if found.offset < 0 else "right"
    degrees = np.degrees(found.heading_rad)
    leads = "straight on" if abs(degrees) < 3 else f"bears {'right' if degrees > 0 else 'left'}"
    where = "in the middle" if abs(found.offset) < 0.05 else f"{100 * abs(found.offset):.0f} % {side}"
    return f"line {where}, {leads}"


def _reasons(found: LineReading) -> Table:
    rows = tuple((name, float(share)) for name, share in found.parts.items())
    return Table("What speaks for it, 0 to 1", (Column("mark"), Column("share", "", 2)), rows)


def _marks(found: LineReading, shape: tuple[int, ...]) -> tuple[Mark, ...]:
    height, width = shape[:2]
    centre = 0.5 * (width - 1)
    upright: NDArray[np.float64] = np.array([[centre, height - 1.0], [centre, 0.85 * height]])
    marks: list[Mark] = [Line(upright, "soft", width=1)]
    if not found.found:
        return tuple(marks)
    y, left, right = found.edges_px.T
    middle = np.column_stack([0.5 * (left + right), y])
    marks += [Line(np.column_stack([x, y]), "accent", width=1) for x in (left, right)]
    ends = np.array([found.bottom_px, found.middle_px])
    marks += [
        Line(middle, "good", width=2),
        Line(ends, "warn", width=2),
        Dots(ends, "warn", 5),
        Label(ends[1] + (10.0, -6.0), f"{np.degrees(found.heading_rad):+.0f} deg", "warn"),
    ]
    return tuple(marks)
