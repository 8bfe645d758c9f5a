"""A study in one sentence: σ, bias, Allan deviation, and whether the declared R is right."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from factorlab.characterize.comparing import NEAR, rounded
from factorlab.characterize.engine import Study
from factorlab.characterize.slow_verdicts import best_time, written_span
from factorlab.characterize.words import group_name, say
from factorlab.report.words import Language

__all__ = ["in_short"]


def in_short(study: Study, lang: Language) -> str:
    """The sentence, or nothing where there is no sensor at rest to speak of."""
    parts = [part for group, rows in study.groups().items() for part in _of_sensor(study, group, rows, lang)]
    parts += _of_declared(study, lang)
    between = " ; " if lang == "fr" else "; "
    return say(lang, "short", parts=between.join(parts)) if parts else ""


def _of_sensor(study: Study, group: str, rows: list[int], lang: Language) -> Iterator[str]:
    """σ of the noisiest axis, the largest gyro bias, N, and whether the plateau shows."""
    axes = [study.axes[k] for k in rows if k < len(study.axes) and not study.axes[k].stuck]
    if not axes:
        return
    sigma = max(one.noise.reading_sigma.value for one in axes)
    unit, name = axes[0].unit, group_name(group, lang)
    yield say(lang, "short_sigma", group=name, sigma=sigma, unit=unit, r=sigma**2)
    angular = group == "gyro" and unit == "rad/s"
    if angular:
        yield say(lang, "short_bias", deg=float(np.degrees(max(abs(one.bias.value) for one in axes))))
    fits = [study.slow.fits[one.name] for one in axes if one.name in study.slow.fits]
    white = [fit.N.value for fit in fits if fit.N.visible]
    if not white or group not in {"gyro", *(one.name for one in axes)}:
        return
    n = float(np.degrees(max(white))) if angular else max(white)
    yield say(lang, "short_n", n=n, unit="°/s" if angular else unit)
    seen = [fit for fit in fits if fit.B.visible or fit.K.visible]
    if seen:
        yield say(lang, "short_plateau", tau=written_span(min(best_time(fit) for fit in seen), lang))
    else:
        yield say(lang, "short_no_plateau", duration=written_span(fits[0].duration, lang))


def _of_declared(study: Study, lang: Language) -> Iterator[str]:
    """The declared R that is farthest from right."""
    ratios = {}
    for channel, one in zip(study.channels, study.axes, strict=False):
        declared = study.declared.sigma_of(channel)
        if declared is not None and not one.stuck:
            ratios[channel.name] = (one.noise.reading_sigma.value / declared) ** 2
    if not ratios:
        return
    axis, ratio = max(ratios.items(), key=lambda pair: abs(np.log(pair[1])))
    if ratio > NEAR:
        yield say(lang, "short_r_small", axis=axis, x=rounded(ratio, lang))
    elif ratio < 1.0 / NEAR:
        yield say(lang, "short_r_large", axis=axis, x=rounded(1.0 / ratio, lang))
    else:
        yield say(lang, "short_r_fits")
