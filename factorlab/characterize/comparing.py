"""Noise as a filter has it declared, beside noise as the sensor shows it."""

from __future__ import annotations

from collections.abc import Iterator

from factorlab.characterize.engine import Study
from factorlab.characterize.words import say
from factorlab.report.document import Status, Verdict
from factorlab.report.words import Language

__all__ = ["NEAR", "against_declared", "judged_density", "rounded"]

NEAR = 1.5  # a ratio of variances up to which R is right enough
DENSITY_NEAR = 1.5
DENSITY_FAR = 4.0
FAR = 4.0  # too small by more than this misleads a filter


def against_declared(study: Study, lang: Language) -> Iterator[Verdict]:
    """One verdict for each channel whose noise was declared: the ratio of measured to declared variance."""
    for channel, one in zip(study.channels, study.axes, strict=True):
        declared = study.declared.sigma_of(channel)
        if declared is None or one.stuck:
            continue
        sigma = one.noise.reading_sigma
        ratio = sigma.scaled(1.0 / declared)
        band = ratio.low**2, ratio.high**2
        words, status = _judged(ratio.value**2, band, channel.name, declared, sigma.value, one.unit, lang)
        meaning = words[0] + (say(lang, "r_fast") if one.noise.moving else "")
        yield Verdict(
            say(lang, "declared", axis=channel.name), ratio.value**2, band, status, meaning, words[1]
        )


def _judged(
    ratio: float,
    band: tuple[float, float],
    axis: str,
    declared: float,
    sigma: float,
    unit: str,
    lang: Language,
) -> tuple[tuple[str, str], Status]:
    """Words and status for a ratio of variances."""
    remedy = say(lang, "r_do", r=sigma**2, sigma=sigma, unit=unit)
    if ratio > NEAR and band[0] > 1.0:
        words = say(lang, "r_small", x=rounded(ratio, lang), axis=axis)
        return (words, remedy), "FAIL" if ratio > FAR else "WARN"
    if ratio < 1.0 / NEAR and band[1] < 1.0:
        words = say(lang, "r_large", x=rounded(1.0 / ratio, lang), axis=axis, nis=ratio)
        return (words, remedy), "WARN"
    return (say(lang, "r_fits", declared=declared, measured=sigma, unit=unit), ""), "PASS"


def rounded(times: float, lang: Language) -> str:
    """A factor as people say it: 8.2, 15, 230."""
    text = f"{times:.2g}" if times < 10.0 else f"{times:.0f}"
    return text.replace(".", ",") if lang == "fr" else text


def judged_density(
    declared: float, measured: float, unit: str, lang: Language, *, bound: bool
) -> tuple[tuple[str, str], Status]:
    """Words and status for a declared density; `bound`: the measured one is an upper bound.

    A bias walk is known within a factor of a few only, and most filters want it larger than the sensor's own.
    """
    numbers: dict[str, float | str] = {"declared": declared, "measured": measured, "unit": unit}
    if bound:
        key = "density_above_bound" if declared > measured else "density_below_bound"
        return (say(lang, key, **numbers), ""), "INFO"
    ratio = measured / declared if declared > 0.0 else float("inf")
    remedy = say(lang, "density_do", measured=measured, unit=unit)
    if ratio > DENSITY_NEAR:
        words = say(lang, "density_small", x=rounded(ratio, lang), **numbers)
        return (words, remedy), "FAIL" if ratio > DENSITY_FAR else "WARN"
    if ratio < 1.0 / DENSITY_FAR:
        return (say(lang, "density_large", x=rounded(1.0 / ratio, lang), **numbers), ""), "INFO"
    return (say(lang, "density_fits", **numbers), ""), "PASS"
