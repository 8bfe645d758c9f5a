"""What `factorlab firmware verify` says."""

from __future__ import annotations

from typing import Any

from factorlab.firmware.parity import BAR, BARS, Parity
from factorlab.firmware.targets import TargetParity
from factorlab.firmware.verify import Verification
from factorlab.report.document import Document, Section, Status, Table, Verdict

__all__ = ["verification_document"]


def verification_document(found: Verification, *, memory: Table | None = None, command: str = "") -> Document:
    """Tell what agrees.

    Parameters
    ----------
    found : what was compared
    memory : flash, state and stack of the filters, where they were measured
    """
    recordings = list(dict.fromkeys(one.recording for one in found.filters))
    failed = sum(not one.passed for one in found.filters) + sum(one.passed is False for one in found.targets)
    boards = "; emulated boards against this computer" if found.targets else ""
    unseen = [one for one in found.targets if one.passed is None]
    conclusion = "every comparison clears its bar" if not failed else f"{failed} comparisons miss their bar"
    if unseen:
        lacking = sorted({package for one in unseen for package in one.lacking})
        conclusion += f"; {len(unseen)} were not made: apt install {' '.join(lacking)}"
    return Document(
        title="Firmware: the same filter everywhere",
        lead=f"C against Python on {', '.join(recordings)}{boards}.",
        verdicts=(*_filters(found.filters), *_targets(found.targets)),
        sections=tuple(_sections(found, memory)),
        numbers=_numbers(found),
        command=command,
        conclusion=f"{conclusion[0].upper()}{conclusion[1:]}.",
    )


def _filters(rows: tuple[Parity, ...]) -> list[Verdict]:
    """One line a filter: its worst recording."""
    found = []
    for name in dict.fromkeys(one.name for one in rows):
        own = [one for one in rows if one.name == name]
        worst = max(own, key=lambda one: one.rms)
        largest, steps = max(one.worst for one in own), [one.step for one in own if one.step is not None]
        said = f"root mean square on {worst.recording}; largest of all {largest:.2g}°"
        if steps:
            said += f"; one step from an equal state {max(steps):.1g}"
        good = all(one.passed for one in own)
        status: Status = "PASS" if good else "FAIL"
        action = "" if good else "look at the figure for where it departs"
        bar = BARS.get(name, BAR)[1]
        found.append(Verdict(f"{name} from Python", worst.rms, (0.0, bar), status, said, action, "°"))
    return found


def _targets(rows: tuple[TargetParity, ...]) -> list[Verdict]:
    found = []
    for one in rows:
        metric = f"{one.filter} on {one.target}: samples that differ"
        if one.passed is None:
            action = f"apt install {' '.join(one.lacking)}"
            found.append(Verdict(metric, None, None, "WARN", "not compared", action))
            continue
        status: Status = "PASS" if one.passed else "FAIL"
        said = f"of {one.samples}, from this computer, bit for bit"
        found.append(Verdict(metric, one.differing, None, status, said))
    return found


def _sections(found: Verification, memory: Table | None) -> list[Section]:
    from factorlab.report import firmware_figures

    heads = (
        "filter", "recording", "", ("root mean square", "°"), ("largest", "°"), "one step", "",
    )  # fmt: skip
    rows = tuple(
        (one.name, one.recording, "9-D" if one.magnetometer else "6-D", one.rms, one.worst, one.step,
         "PASS" if one.passed else "FAIL")
        for one in found.filters
    )  # fmt: skip
    text = (
        "The angle between the C filter and the Python filter on the same samples, and by how much a number "
        "departs after one step from an equal state. Filters in fixed point (-q) run at a board's 100 Hz. Of "
        "the tilt Kalman filter, what counts ends where the pitch passes 75°."
    )
    sections = [
        Section("C against Python", text, Table(heads, rows), page_only=True),
        Section(
            "C less Python over time",
            figure=lambda: firmware_figures.differences(found.filters),
            caption="Whole: single precision. Broken: fixed point.",
        ),
    ]
    if memory is not None:
        sections.append(Section("Memory and length of an update", table=memory))
    return sections


def _numbers(found: Verification) -> dict[str, Any]:
    return {
        "filters": [
            {
                "filter": one.name, "recording": one.recording, "magnetometer": one.magnetometer,
                "rms_deg": one.rms, "max_deg": one.worst, "step": one.step, "passed": one.passed,
            }
            for one in found.filters
        ],
        "targets": [
            {
                "filter": one.filter, "target": one.target, "samples": one.samples,
                "differing": one.differing, "passed": one.passed, "lacking": list(one.lacking),
            }
            for one in found.targets
        ],
    }  # fmt: skip
