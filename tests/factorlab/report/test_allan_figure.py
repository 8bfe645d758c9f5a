"""The log-log plot: readings where the convention has them, units on both sides, legible with six axes."""

import numpy as np
import pytest
from noise_worlds import still_sensor

from factorlab.report.allan_figure import AllanPanel, accel_panel, allan_figure, gyro_panel
from factorlab.report.style import inline_svg
from sequential.sensors import allan_deviation, fit_noise

RATE = 50.0
TERMS = {"N": 1e-3, "B": 1e-3, "K": 1e-4}


@pytest.fixture
def measured(rng):
    x = np.stack([still_sensor(rng, 60_000, RATE, **TERMS) for _ in range(3)], axis=1)
    return allan_deviation(x, RATE), tuple(fit_noise(x[:, axis], RATE, unit="rad/s") for axis in range(3))


def marks(axes, mark):
    return [line.get_xydata()[0] for line in axes.lines if line.get_marker() == mark]


def test_readings_stand_where_they_are_read(measured):
    deviation, fits = measured
    axes = allan_figure([gyro_panel(deviation, fits)]).axes[0]
    white, flat = marks(axes, "o"), marks(axes, "s")
    assert np.allclose(white, [(1.0, np.degrees(fit.N.value)) for fit in fits], rtol=1e-6)
    assert [y for _, y in flat] == pytest.approx(
        [0.66428 * np.degrees(fit.B.value) for fit in fits], rel=1e-4
    )
    walks = [fit for fit in fits if fit.K.visible]
    assert [tuple(at) for at in marks(axes, "D")] == [
        pytest.approx((3.0, np.degrees(fit.K.value))) for fit in walks
    ]
    low, high = axes.get_ylim()
    for _, y in white + flat + marks(axes, "D"):
        assert low < y < high


def test_six_axes_are_two_panels_with_both_units(measured):
    deviation, fits = measured
    figure = allan_figure([gyro_panel(deviation, fits), accel_panel(deviation, fits)])
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "Allan deviation, deg/s",
        "Allan deviation, mg",
    ]
    assert [axes.child_axes[0].get_ylabel() for axes in figure.axes] == ["rad/s", "m/s²"]
    for axes in figure.axes:
        assert {axes.get_xscale(), axes.get_yscale()} == {"log"}
        colours = [
            line.get_color()
            for line in axes.lines
            if len(line.get_label()) > 1 and line.get_label()[0] != "_"
        ]
        assert len(set(colours)) == 3
        text = " ".join(entry.get_text() for entry in axes.get_legend().get_texts())
        assert all(f"{name}:" in text for name in "xyz")


def test_what_is_not_visible_is_a_bound_and_no_mark(rng):
    x = still_sensor(rng, 3000, RATE, N=1.0)
    axes = allan_figure(
        [AllanPanel("range", allan_deviation(x, RATE), [fit_noise(x, RATE)], ("d",), "m")]
    ).axes[0]
    assert not marks(axes, "s") + marks(axes, "D")
    text = axes.get_legend().get_texts()[0].get_text()
    assert "B < " in text
    assert "K < " in text
    assert axes.get_ylabel() == "Allan deviation, m"


def test_one_axis_without_a_fit_in_french(rng):
    figure = allan_figure(
        [AllanPanel("T", allan_deviation(rng.standard_normal(100), 1.0), names=("T",))], "fr"
    )
    assert figure.axes[0].get_xlabel() == "durée de moyenne τ, s"


def test_a_stuck_axis_is_drawn_too():
    deviation = allan_deviation(np.zeros((100, 3)), 1.0)
    assert inline_svg("stuck", lambda: allan_figure([gyro_panel(deviation)]), "Allan")


def test_it_becomes_an_svg(measured):
    svg = inline_svg("allan", lambda: allan_figure([gyro_panel(*measured)]), "Allan deviation of a gyro")
    assert svg.startswith("<svg")
    assert "averaging time" in svg
    assert len(svg) < 300_000
