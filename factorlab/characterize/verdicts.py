"""What the numbers of a study mean, sensor by sensor, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from factorlab.characterize.engine import Study
from factorlab.characterize.level_verdicts import estimated, of_drift, of_heat, of_level, worst
from factorlab.characterize.words import group_name, largest_of, say
from factorlab.report.document import Status, Verdict
from factorlab.report.words import Language, number
from sequential.sensors import Characteristics
from sequential.sensors.characterize_timing import Timing

__all__ = ["at_rest"]

Axes = list[Characteristics]
LOUD = 0.02  # share of the noise power in a line that is worth a warning
RARE, FAR_OUT = 1e-4, 15.0  # share of outliers, and σ of a typical one, below which nobody minds
FEWEST_BITS = 4.0
LATE = 0.05  # jitter over the interval


def at_rest(study: Study, lang: Language) -> Iterator[Verdict]:
    """Noise, bias, drift, resolution, distribution, outliers, timing and lines of each sensor."""
    for group, rows in study.groups().items():
        axes = [study.axes[k] for k in rows]
        if stuck := [one for one in axes if one.stuck]:
            yield from (_stuck(one, lang) for one in stuck)
            axes = [one for one in axes if not one.stuck]
        if axes:
            yield from _moving(axes, lang)
            yield _sigma(axes, group, lang)
            yield from of_level(axes, group, lang)
            for about in (of_drift, of_heat, _resolution, _normal):
                yield from about(axes, lang)
            yield _outliers(axes, group, lang)
            yield from _line(axes, lang)
    for groups, seen in _clocks(study):
        yield _timing(seen, ", ".join(group_name(group, lang) for group in groups), lang)


def _clocks(study: Study) -> Iterator[tuple[list[str], Timing]]:
    """Sensors that share their stamps, and when those came."""
    found: list[tuple[list[str], int]] = []
    for group, rows in study.groups().items():
        own = study.channels[rows[0]].t
        same = next((g for g, k in found if np.array_equal(study.channels[k].t, own)), None)
        if same is None:
            found.append(([group], rows[0]))
        else:
            same.append(group)
    yield from ((groups, study.axes[k].timing) for groups, k in found)


def _stuck(one: Characteristics, lang: Language) -> Verdict:
    words = say(lang, "stuck"), say(lang, "stuck_do")
    return Verdict(say(lang, "sigma", axis=one.name), 0.0, None, "FAIL", *words, unit=one.unit)


def _moving(axes: Axes, lang: Language) -> Iterator[Verdict]:
    """Readings that go much farther than they differ from one to the next are no noise."""
    one = worst(axes, lambda axis: axis.noise.sigma.value / max(axis.noise.step_sigma, 1e-300))
    if one.noise.moving:
        times = one.noise.sigma.value / one.noise.step_sigma
        words = say(lang, "moving_means", x=times), say(lang, "moving_do")
        yield Verdict(say(lang, "moving", axis=one.name), times, None, "WARN", *words)


def _sigma(axes: Axes, group: str, lang: Language) -> Verdict:
    one = worst(axes, lambda axis: axis.noise.sigma.value)
    noise = one.noise
    key = "sigma_white" if noise.white else "sigma_coloured"
    meaning = say(
        lang,
        key,
        which=largest_of(group, one.name, lang),
        corr=noise.correlation,
        r=noise.sigma.value**2,
        unit=one.unit,
        n=noise.n,
        eff=round(noise.n_effective),
    )
    status: Status = "PASS" if noise.white else "WARN"
    action = "" if noise.white else say(lang, "sigma_coloured_do")
    return estimated(say(lang, "sigma", axis=one.name), noise.sigma, status, meaning, action, one.unit)


def _resolution(axes: Axes, lang: Language) -> Iterator[Verdict]:
    """The axis whose noise covers the fewest steps."""
    # a step far below the noise is that of the file's digits, not of a converter
    gridded = [one for one in axes if one.resolution.effective_bits > FEWEST_BITS]
    if not gridded:
        yield Verdict(say(lang, "lsb", axis=axes[0].name), None, None, "INFO", say(lang, "lsb_none"))
        return
    one = min(gridded, key=lambda axis: axis.noise.sigma.value / axis.resolution.lsb)
    lsb, sigma, gain = one.resolution.lsb, one.noise.sigma.value, one.oversampling
    metric = say(lang, "lsb", axis=one.name)
    if sigma < 0.5 * lsb:
        meaning = say(lang, "lsb_coarse", sigma=sigma, unit=one.unit)
        yield Verdict(metric, lsb, None, "WARN", meaning, say(lang, "lsb_coarse_do"), one.unit)
        return
    k = min(3, len(gain.factor) - 1)
    meaning = say(
        lang,
        "lsb_noisy",
        steps=sigma / lsb,
        effective=one.resolution.effective_bits,
        bits=one.resolution.bits,
        factor=int(gain.factor[k]),
        gained=float(gain.bits[k]),
        expected=float(gain.expected[k]),
    )
    yield Verdict(metric, lsb, None, "PASS", meaning, "", one.unit)


def _normal(axes: Axes, lang: Language) -> Iterator[Verdict]:
    """The axis farthest from a normal distribution."""
    one = worst(axes, lambda axis: axis.distribution.distance)
    seen, n = one.distribution, one.noise.n
    near = seen.nearly_normal
    doubtful = seen.p < 0.05
    which = ("p_small" if doubtful else "p_large") if near else ("p_sure" if doubtful else "p_unsure")
    p = "p < 10⁻¹⁰" if seen.p < 1e-10 else f"p = {number(seen.p, lang, 2)}"
    meaning = say(
        lang,
        "normal_fits" if near else "normal_off",
        percent=100.0 * seen.distance,
        kurtosis=seen.kurtosis.value,
        skewness=seen.skewness.value,
        test=say(lang, which, p=p, n=n),
    )
    status: Status = "PASS" if near else "WARN"
    metric, action = say(lang, "normal", axis=one.name), "" if near else say(lang, "normal_do")
    if not near and seen.uneven_steps:
        meaning, status, action = say(lang, "normal_teeth", percent=100.0 * seen.distance), "INFO", ""
    yield Verdict(metric, seen.distance, None, status, meaning, action)


def _outliers(axes: Axes, group: str, lang: Language) -> Verdict:
    one = worst(axes, lambda axis: axis.outliers.count)
    seen, metric = one.outliers, say(lang, "outliers", group=group_name(group, lang))
    share = seen.share.low, seen.share.high
    if not seen.count:
        meaning = say(lang, "outliers_none", n=one.noise.n, one_in=round(1.0 / seen.share.high))
        return Verdict(metric, 0.0, share, "PASS", meaning)
    meaning = say(
        lang,
        "outliers_some",
        axis=one.name,
        count=seen.count,
        n=one.noise.n + seen.count,
        hour=seen.per_hour,
        size=seen.typical,
        unit=one.unit,
        sigmas=seen.typical_sigmas,
        largest=seen.largest,
    )
    status: Status = "WARN" if seen.share.low > RARE or seen.typical_sigmas > FAR_OUT else "INFO"
    return Verdict(metric, seen.share.value, share, status, meaning, say(lang, "outliers_do"))


def _timing(seen: Timing, names: str, lang: Language) -> Verdict:
    metric = say(lang, "timing", group=names)
    if seen.computed:
        return Verdict(metric, None, None, "INFO", say(lang, "timing_even", rate=seen.rate))
    share = seen.jitter * seen.rate
    told = say(lang, "timing_means", rate=seen.rate, percent=100.0 * share, worst=1e3 * seen.worst)
    bad = share > LATE or len(seen.gaps) > 0
    if len(seen.gaps):
        at, longest = seen.gaps[np.argmax(seen.gaps[:, 1])]
        told += say(
            lang,
            "timing_gaps",
            count=len(seen.gaps),
            missing=seen.missing,
            longest=float(longest),
            at=float(at),
        )
    action = say(lang, "timing_do") if bad else ""
    return Verdict(metric, 1e3 * seen.jitter, None, "WARN" if bad else "PASS", told, action, "ms")


def _line(axes: Axes, lang: Language) -> Iterator[Verdict]:
    """The strongest line of any axis."""
    humming = [one for one in axes if one.spectrum.lines]
    loud = [(one.spectrum.lines[0][1] / max(one.noise.sigma.value, 1e-300), one) for one in humming]
    if not loud:
        return
    share, one = max(loud, key=lambda pair: pair[0])
    hz, sigma = one.spectrum.lines[0]
    meaning = say(lang, "line_means", hz=hz, sigma=sigma, unit=one.unit, percent=100.0 * share**2)
    status: Status = "WARN" if share**2 > LOUD else "INFO"
    yield Verdict(say(lang, "line", axis=one.name), hz, None, status, meaning, say(lang, "line_do"), "Hz")
