"""What readers and health checks noticed, as verdicts; in French where the phrase is known."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import resources

from factorlab.characterize.words import say
from factorlab.report.document import Status, Verdict
from factorlab.report.words import Language
from sequential.sensors import Finding

__all__ = ["in_french", "of_findings"]

SEVERITY: dict[str, Status] = {"note": "INFO", "warn": "WARN", "fail": "FAIL"}
SENSORS = {"accelerometer": "accéléromètre", "magnetometer": "magnétomètre", "gyro": "gyromètre"}


def of_findings(findings: tuple[Finding, ...], lang: Language) -> Iterator[Verdict]:
    """One verdict a finding, each once."""
    told = in_french if lang == "fr" else str
    for one in dict.fromkeys(findings):
        what = told(one.what) + (f" ({told(one.where)})" if one.where else "")
        yield Verdict(say(lang, "recording"), None, None, SEVERITY[one.severity], what, told(one.do))


@cache
def _phrases() -> tuple[tuple[re.Pattern[str], str], ...]:
    """Patterns of English sentences, and the French ones with fields for what was matched."""
    text = resources.files("factorlab.characterize").joinpath("findings.toml").read_text(encoding="utf-8")
    found = []
    for phrase in tomllib.loads(text)["phrase"]:
        pattern = re.sub(r"\\{(\w)\\}", r"(?P<\1>.+?)", re.escape(phrase["en"]))
        found.append((re.compile(pattern), phrase["fr"]))
    return tuple(found)


def in_french(sentence: str) -> str:
    """The French of a sentence, its numbers with a comma; an unknown sentence as it is."""
    for pattern, french in _phrases():
        if found := pattern.fullmatch(sentence):
            return french.format(**{name: _parts(text) for name, text in found.groupdict().items()})
    return sentence


def _parts(text: str) -> str:
    """A sentence inside a sentence, names of sensors, numbers."""
    if (whole := in_french(text)) != text:
        return whole
    for english, french in SENSORS.items():
        text = text.replace(english, french)
    return re.sub(r"(?<=\d)\.(?=\d)", ",", text)
