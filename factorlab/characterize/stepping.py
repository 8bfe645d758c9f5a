"""What a step response means: how late a sensor is, and what a filter should do about it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from factorlab.characterize.engine import Study
from factorlab.characterize.words import say
from factorlab.report.document import Verdict
from factorlab.report.words import Language

__all__ = ["of_steps"]


def of_steps(study: Study, lang: Language) -> Iterator[Verdict]:
    """One verdict a channel: the time constant with its interval, and the whole delay."""
    for channel, one in zip(study.channels, study.steps, strict=True):
        metric = say(lang, "step_metric", axis=channel.name)
        if one.order == 1 or one.damping is None:
            what = say(lang, "step_first")
        else:
            what = say(lang, "step_second", zeta=one.damping.value)
        if one.resolved:
            meaning = say(
                lang,
                "step_means",
                what=what,
                tau=1e3 * one.time_constant.value,
                rise=1e3 * one.rise.value,
                hz=one.bandwidth.value,
                over=100.0 * one.overshoot,
            )
        else:
            meaning = say(lang, "step_fast", interval=1e3 * float(np.median(np.diff(one.t))))
        late = one.time_constant.value + (one.latency.value if one.latency else 0.0)
        if one.latency is not None:
            meaning += say(lang, "step_latency", latency=1e3 * one.latency.value)
        low, high = 1e3 * one.time_constant.low, 1e3 * one.time_constant.high
        action = say(lang, "step_do", delay=1e3 * late)
        yield Verdict(metric, 1e3 * one.time_constant.value, (low, high), "INFO", meaning, action, "ms")
