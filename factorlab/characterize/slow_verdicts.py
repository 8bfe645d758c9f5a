"""What Allan's deviation says: how long averaging helps, where Q comes from, what is too short to see."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

from factorlab.characterize.comparing import judged_density
from factorlab.characterize.engine import Study
from factorlab.characterize.words import group_name, largest_of, say
from factorlab.report.document import Status, Verdict
from factorlab.report.words import Language
from sequential.noise import ImuNoise
from sequential.sensors import NoiseFit
from sequential.sensors.noise_words import coefficient_unit, span

__all__ = ["best_time", "of_densities", "of_slow_noise", "written_span"]

Fits = dict[str, NoiseFit]
MISFIT = 2.0  # times the power of the fit that is worth a warning


def of_slow_noise(study: Study, lang: Language) -> Iterator[Verdict]:
    """N, B and K of each sensor: the axis where each is largest, or the bound where none shows."""
    for group, rows in study.groups().items():
        names = [study.channels[k].name for k in rows]
        fits = {name: study.slow.fits[name] for name in names if name in study.slow.fits}
        if fits:
            yield from _white(fits, group, lang)
            yield _slower(fits, "B", lang)
            yield _slower(fits, "K", lang)
            yield from _misfit(fits, lang)


def _largest(fits: Fits, of: Callable[[NoiseFit], float]) -> tuple[str, NoiseFit]:
    return max(fits.items(), key=lambda pair: of(pair[1]))


def _white(fits: Fits, group: str, lang: Language) -> Iterator[Verdict]:
    seen = {name: fit for name, fit in fits.items() if fit.N.visible}
    if not seen:
        return
    name, fit = _largest(seen, lambda one: one.N.value)
    unit = coefficient_unit("N", fit.unit)
    meaning = say(lang, "allan_n", which=largest_of(group, name, lang), second=fit.N.value, unit=fit.unit)
    if fit.unit == "rad/s":
        degrees = float(np.degrees(fit.N.value))
        meaning += say(lang, "allan_n_gyro", deg=degrees, hour=60.0 * degrees)
    metric = say(lang, "allan_metric", term="N", axis=name)
    yield Verdict(metric, fit.N.value, (fit.N.low, fit.N.high), "PASS", meaning, "", unit)


def _slower(fits: Fits, term: Literal["B", "K"], lang: Language) -> Verdict:
    seen = {name: fit for name, fit in fits.items() if fit[term].visible}
    if not seen:
        name, fit = _largest(fits, lambda one: one[term].high)
        unit = coefficient_unit(term, fit.unit)
        meaning = say(
            lang,
            f"allan_{term.lower()}_unseen",
            most=fit[term].high,
            unit=unit,
            duration=written_span(fit.duration, lang),
            needed=written_span(fit.seconds_needed(term, 0.5 * fit[term].high), lang),
        )
        return Verdict(say(lang, "allan_metric", term=term, axis=name), None, None, "INFO", meaning)
    name, fit = _largest(seen, lambda one: one[term].value)
    one, unit = fit[term], coefficient_unit(term, fit.unit)
    meaning = say(
        lang,
        f"allan_{term.lower()}_seen",
        tau=written_span(best_time(fit), lang),
        floor=float(fit.deviation([best_time(fit)])[0]),
        own=fit.unit,
        square=one.value**2,
    )
    metric = say(lang, "allan_metric", term=term, axis=name)
    return Verdict(metric, one.value, (one.low, one.high), "PASS", meaning, "", unit)


def best_time(fit: NoiseFit) -> float:
    """Averaging time (s) from which the deviation of a fit is within a tenth of its least."""
    tau = np.geomspace(1.0 / fit.rate, fit.duration, 400)
    deviation = fit.deviation(tau)
    return float(tau[np.argmax(deviation < 1.1 * deviation.min())])


def written_span(seconds: float, lang: Language) -> str:
    """A length of time as one says it."""
    text = span(seconds)
    return text.replace(".", ",").replace("days", "jours") if lang == "fr" else text


def _misfit(fits: Fits, lang: Language) -> Iterator[Verdict]:
    wrong = {name: fit for name, fit in fits.items() if fit.misfit is not None and fit.misfit[2] > MISFIT}
    if wrong:
        name, fit = _largest(wrong, lambda one: one.misfit[2] if one.misfit else 0.0)
        low, high, share = fit.misfit or (0.0, 0.0, 0.0)
        meaning = say(lang, "allan_misfit", low=low, high=high, share=share)
        metric = say(lang, "allan_misfit_metric", axis=name)
        yield Verdict(metric, share, None, "WARN", meaning, say(lang, "allan_misfit_do"))


def of_densities(study: Study, lang: Language) -> Iterator[Verdict]:
    """Declared densities and bias walks beside those of the IMU."""
    declared, measured = study.declared.noise, study.slow.noise
    if declared is None or measured is None:
        return
    for name in ImuNoise.__slots__[:4]:
        group = name.split("_", maxsplit=1)[0]
        what = say(lang, "walk" if name.endswith("walk") else "density")
        unit = coefficient_unit("K" if name.endswith("walk") else "N", "rad/s" if group == "gyro" else "m/s²")
        given, found = float(getattr(declared, name)), float(getattr(measured, name))
        status: Status
        words, status = judged_density(given, found, unit, lang, bound=name in study.slow.bounds)
        metric = say(lang, "declared_density", what=what, group=group_name(group, lang))
        yield Verdict(metric, found / given if given else None, None, status, *words)
