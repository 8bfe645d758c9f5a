"""A study as a document: verdicts, tables, figures, numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from factorlab.characterize.channels import AXES
from factorlab.characterize.comparing import against_declared
from factorlab.characterize.engine import Study
from factorlab.characterize.findings import of_findings
from factorlab.characterize.slow_verdicts import of_densities, of_slow_noise
from factorlab.characterize.stepping import of_steps
from factorlab.characterize.summary import in_short
from factorlab.characterize.tables import sections_at_rest, sections_of_steps
from factorlab.characterize.verdicts import at_rest
from factorlab.characterize.words import say
from factorlab.report.document import Document, Verdict
from factorlab.report.words import Language
from sequential.sensors import Coefficient
from sequential.sensors.noise_fit import TERMS

__all__ = ["document_of"]

ORDER = {"FAIL": 0, "WARN": 1, "PASS": 2, "INFO": 3}


def document_of(study: Study, *, lang: Language = "en", command: str = "") -> Document:
    """Everything that a study has to say, worst verdicts first."""
    told = of_steps(study, lang) if study.steps else _told(study, lang)
    verdicts = [*of_findings(study.findings, lang), *told]
    sections = sections_of_steps(study, lang) if study.steps else sections_at_rest(study, lang)
    return Document(
        title=say(lang, "title", name=study.name),
        lead=_lead(study, lang),
        conclusion=in_short(study, lang),
        verdicts=tuple(sorted(verdicts, key=lambda one: ORDER[one.verdict])),
        sections=tuple(sections),
        numbers=_numbers(study),
        lang=lang,
        command=command,
    )


def _told(study: Study, lang: Language) -> Iterator[Verdict]:
    yield from against_declared(study, lang)
    yield from of_densities(study, lang)
    yield from at_rest(study, lang)
    yield from of_slow_noise(study, lang)


def _lead(study: Study, lang: Language) -> str:
    n = max(len(channel.t) for channel in study.channels)
    if not study.axes:
        return say(lang, "lead_step", n=n)
    rate = study.axes[0].timing.rate
    if study.window is None:
        # of an IMU the detector has said so, of a column the user
        key = "lead_rest" if set(study.groups()) <= set(AXES) else "lead_whole"
        return say(lang, key, n=n, rate=rate, duration=study.duration)
    start, stop = study.window[0], min(study.window[1], study.duration)
    return say(lang, "lead_part", n=n, rate=rate, start=start, stop=stop, duration=stop - start)


def _coefficient(one: Coefficient) -> dict[str, Any]:
    return {key: getattr(one, key) for key in ("value", "low", "high", "visible")}


def _numbers(study: Study) -> dict[str, Any]:
    """What `--json` prints beside the verdicts."""
    plain: dict[str, Any] = {
        "recording": study.name,
        "window": study.window,
        "duration": study.duration,
        "findings": [
            {"severity": one.severity, "what": one.what, "where": one.where, "do": one.do}
            for one in study.findings
        ],
    }
    if study.steps:
        names = [channel.name for channel in study.channels]
        return plain | {"steps": {n: one.to_json() for n, one in zip(names, study.steps, strict=True)}}
    timing = study.axes[0].timing
    plain["timing"] = {
        "rate": timing.rate,
        "mean_rate": timing.mean_rate,
        "jitter": timing.jitter,
        "worst": timing.worst,
        "gaps": timing.gaps.tolist(),
        "missing": timing.missing,
        "repeated": timing.repeated,
        "computed": timing.computed,
    }
    slow = study.slow
    plain["imu_noise"] = (
        None if slow.noise is None else {n: getattr(slow.noise, n) for n in slow.noise.__slots__}
    )
    plain["upper_bounds"] = list(slow.bounds)
    axes = {one.name: one.to_json() for one in study.axes}
    for name, fit in slow.fits.items():
        axes[name]["allan"] = {
            term: {key: getattr(fit[term], key) for key in ("value", "low", "high", "visible")}
            for term in TERMS
        }
    return plain | {"axes": axes}
