"""Tables and figures of a study, section by section."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from factorlab.characterize.engine import Study
from factorlab.characterize.words import say
from factorlab.report.document import Cell, Section, Table
from factorlab.report.words import Language, interval, number
from sequential.sensors import Characteristics, Estimate
from sequential.sensors.noise_fit import Term

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["sections_at_rest", "sections_of_steps"]

Column = tuple[str, Callable[[Characteristics], Cell]]
FACTORS = (4, 16, 64)


def sections_at_rest(study: Study, lang: Language) -> Iterator[Section]:
    """Overview, noise, histogram, drift, resolution, spectrum, outliers and timing."""
    yield Section("Axes" if lang == "en" else "Axes de mesure", table=_table(study, lang, OVERVIEW))
    for name, columns, figure in (
        ("noise", _noise(lang), ""),
        ("histogram", NORMALITY, "histograms"),
        ("drift", _levels(lang), "drift"),
        ("resolution", RESOLUTION, "oversampling"),
        ("spectrum", (), "spectra"),
        ("allan", _terms(study, lang), "allan"),
        ("timing", TIMING, ""),
    ):
        yield Section(
            say(lang, f"section_{name}"),
            say(lang, f"section_{name}_text") if name != "timing" else "",
            table=_table(study, lang, columns, name) if columns else None,
            figure=_drawn(study, lang, figure) if figure else None,
            page_only=True,
        )


def _drawn(study: Study, lang: Language, name: str) -> Callable[[], Figure | None]:
    def draw() -> Figure | None:
        from factorlab.report import sensor_figures

        made: Figure = getattr(sensor_figures, name)(study, lang)()
        return made

    return draw


def _table(study: Study, lang: Language, columns: tuple[Column, ...], name: str = "") -> Table:
    rows = tuple(
        (
            one.name,
            one.unit,
            *(cell(one) for _, cell in columns),
            *(_gains(one) if name == "resolution" else ()),
        )
        for one in study.axes
    )
    heads = [say(lang, f"h_{key}") for key in ("axis", "unit", *(key for key, _ in columns))]
    if name == "resolution":
        heads += [say(lang, "h_gain", factor=factor) for factor in FACTORS]
    return Table(tuple(heads), rows)


def _terms(study: Study, lang: Language) -> tuple[Column, ...]:
    """N, B and K of each axis, an upper bound where one is not visible."""

    def cell(term: Term) -> Callable[[Characteristics], Cell]:
        def written(one: Characteristics) -> Cell:
            fit = study.slow.fits.get(one.name)
            if fit is None:
                return None
            return fit[term].value if fit[term].visible else f"< {number(fit[term].high, lang, 2)}"

        return written

    def ends(term: Term) -> Callable[[Characteristics], Cell]:
        def written(one: Characteristics) -> Cell:
            fit = study.slow.fits.get(one.name)
            seen = fit is not None and fit[term].visible
            return interval((fit[term].low, fit[term].high) if fit is not None and seen else None, lang)

        return written

    terms: tuple[Term, ...] = ("N", "B", "K")
    pairs = [((f"term_{term.lower()}", cell(term)), ("interval", ends(term))) for term in terms]
    return tuple(column for pair in pairs for column in pair)


def _gains(one: Characteristics) -> tuple[Cell, ...]:
    """Bits gained by the factors of the table, where the recording is long enough for them."""
    found = dict(zip(one.oversampling.factor.tolist(), one.oversampling.bits.tolist(), strict=True))
    return tuple(found.get(factor) for factor in FACTORS)


def _lsb(one: Characteristics) -> float | None:
    return one.resolution.lsb if _effective(one) is not None else None


def _effective(one: Characteristics) -> float | None:
    """Effective bits; None where the step is that of the file's digits."""
    return one.resolution.effective_bits if one.resolution.effective_bits > 0.0 else None


OVERVIEW: tuple[Column, ...] = (
    ("sigma", lambda one: one.noise.sigma.value),
    ("bias", lambda one: one.bias.value),
    ("drift", lambda one: one.drift.value * 3600.0),
    ("lsb", _lsb),
    ("effective", _effective),
    ("outliers", lambda one: one.outliers.count),
    ("density", lambda one: one.spectrum.noise_density),
)
NORMALITY: tuple[Column, ...] = (
    ("skewness", lambda one: one.distribution.skewness.value),
    ("kurtosis", lambda one: one.distribution.kurtosis.value),
    ("distance", lambda one: one.distribution.distance),
    ("p", lambda one: one.distribution.p),
)
RESOLUTION: tuple[Column, ...] = (
    ("lsb", _lsb),
    ("noise_bits", lambda one: one.resolution.noise_bits),
    ("effective", _effective),
)
TIMING: tuple[Column, ...] = (
    ("outliers", lambda one: one.outliers.count),
    ("hour", lambda one: one.outliers.per_hour),
    ("typical", lambda one: one.outliers.typical),
    ("largest", lambda one: one.outliers.largest),
    ("rate", lambda one: one.timing.rate),
    ("jitter", lambda one: 1e3 * one.timing.jitter),
    ("gaps", lambda one: len(one.timing.gaps)),
    ("missing", lambda one: one.timing.missing),
)


def _ends(of: Estimate | None, lang: Language) -> str:
    return interval(None if of is None else (of.low, of.high), lang)


def _noise(lang: Language) -> tuple[Column, ...]:
    return (
        ("sigma", lambda one: one.noise.sigma.value),
        ("interval", lambda one: _ends(one.noise.sigma, lang)),
        ("step_sigma", lambda one: one.noise.step_sigma),
        ("correlation", lambda one: one.noise.correlation),
        ("n", lambda one: one.noise.n),
        ("effective_n", lambda one: round(one.noise.n_effective)),
        ("density", lambda one: one.spectrum.noise_density),
    )


def _levels(lang: Language) -> tuple[Column, ...]:
    return (
        ("bias", lambda one: one.bias.value),
        ("interval", lambda one: _ends(one.bias, lang)),
        ("drift", lambda one: one.drift.value * 3600.0),
        ("interval", lambda one: _ends(one.drift.scaled(3600.0), lang)),
        ("heat", lambda one: None if one.per_degree is None else one.per_degree.value),
        ("interval", lambda one: _ends(one.per_degree, lang)),
    )


def sections_of_steps(study: Study, lang: Language) -> Iterator[Section]:
    """One table and one figure of every step."""
    keys = ("axis", "unit", "order", "size", "latency", "tau", "rise", "bandwidth", "overshoot")
    rows = tuple(
        (
            channel.name,
            channel.unit,
            one.order,
            one.size.value,
            None if one.latency is None else 1e3 * one.latency.value,
            1e3 * one.time_constant.value,
            1e3 * one.rise.value,
            one.bandwidth.value,
            100.0 * one.overshoot,
        )
        for channel, one in zip(study.channels, study.steps, strict=True)
    )

    def draw() -> Figure | None:
        from factorlab.report.sensor_figures import steps

        return steps(study, lang)()

    yield Section(
        say(lang, "section_step"),
        say(lang, "section_step_text"),
        Table(tuple(say(lang, f"h_{key}") for key in keys), rows),
        draw,
    )
