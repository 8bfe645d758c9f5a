"""One thing that is worth knowing about a recording, as a sentence that a person can act on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sequential.errors import ModelError

__all__ = ["Finding", "Severity"]

Severity = Literal["note", "warn", "fail"]
SEVERITIES = ("note", "warn", "fail")


@dataclass(frozen=True, slots=True)
class Finding:
    """What was found, where in the recording, and what to do about it.

    Parameters
    ----------
    severity : `"note"` (said, nothing to do), `"warn"` (results are worse for it), `"fail"` (results
        would be wrong)
    what : the fact, with its number and unit
    where : axis and times; empty where it is the whole recording
    do : the remedy; empty where none is needed
    """

    severity: Severity
    what: str
    where: str = ""
    do: str = ""

    def __post_init__(self) -> None:
        if self.severity not in SEVERITIES:
            msg = f"a finding is one of {', '.join(SEVERITIES)}, got {self.severity!r}"
            raise ModelError(msg)

    def __str__(self) -> str:
        place = f" ({self.where})" if self.where else ""
        remedy = f": {self.do}" if self.do else ""
        return f"{self.what}{place}{remedy}"
