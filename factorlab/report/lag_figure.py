"""What waiting is worth: error, honesty and price of a fixed-lag smoother against its lag."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from factorlab.compare.lag_sweep import Lag
from factorlab.report.style import blank, legend_below

__all__ = ["lag_figure"]

FILTER, SMOOTHER, DELAYED, NEWEST = "#D55E00", "#000000", "#0072B2", "#E69F00"
Level = tuple[str, float | None]  # an estimator's title and its figure, drawn as a level line


def lag_figure(
    lags: Sequence[Lag],
    *,
    rmse: Sequence[Level] = (),
    honesty: Sequence[Level] = (),
    unit: str = "m",
    lag_unit: str = "s",
) -> Figure | None:
    """Three panels over the lag: RMSE, normalised error per degree of freedom, time of a reading.

    Parameters
    ----------
    rmse, honesty : levels to draw beside, first the filter's, then the smoother's
    """
    solved = [lag for lag in lags if not lag.message and lag.rmse is not None]
    if len(solved) < 2:
        return None
    drawing, axes = blank(3.3, 1, 3)
    x = [lag.lag_s for lag in solved]
    first, second, third = axes[0]
    first.plot(x, [lag.rmse for lag in solved], "o-", color=DELAYED, label="as it leaves the window")
    first.plot(x, [lag.online_rmse for lag in solved], "s--", color=NEWEST, label="the window's newest")
    _levels(first, rmse)
    first.set(ylabel=f"RMSE, {unit}", ylim=(0, None))
    first.set_title("error")
    second.plot(x, [lag.anees_per_dof for lag in solved], "o-", color=DELAYED)
    second.plot(x, [lag.online_anees_per_dof for lag in solved], "s--", color=NEWEST)
    second.axhline(1.0, color="#009E73", linewidth=2.5, alpha=0.5, label="consistent")
    _levels(second, honesty)
    second.set(ylabel="normalised error / d.o.f.", ylim=(0, None))
    second.set_title("honesty: 1 is expected")
    third.plot(x, [lag.us_per_measurement for lag in solved], "o-", color="#444444")
    third.set(ylabel="time of a reading, µs", ylim=(0, None))
    third.set_title("price")
    for one in axes[0]:
        _lag_axis(one, x)
        one.set_xlabel(f"lag, {lag_unit}")
    legend_below(drawing, first)
    return drawing


def _levels(axes: Axes, levels: Sequence[Level]) -> None:
    for (title, value), color in zip(levels, (FILTER, SMOOTHER), strict=False):
        if value is not None:
            axes.axhline(value, color=color, linewidth=1.0, linestyle=":", label=title)


def _lag_axis(axes: Axes, x: list[float]) -> None:
    """Linear up to the first lag above zero, logarithmic beyond; a tick at each lag."""
    least = min((lag for lag in x if lag > 0), default=1.0)
    axes.set_xscale("symlog", linthresh=least, linscale=0.5)
    axes.set_xticks(x, [f"{lag:g}" for lag in x])
    axes.minorticks_off()
    axes.set_xlim(-0.2 * least, 1.3 * max(x))
