"""What `factorlab firmware emulate` says."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.firmware.build import FLASH
from factorlab.firmware.parity import BAR
from factorlab.firmware.trial import Trial
from factorlab.report.document import Document, Section, Status, Table, Verdict

__all__ = ["trial_document"]

Array = NDArray[np.float64]
# microseconds: what a frame may wait for, by its mode; what the period may depart by
LATENCY_US, JITTER_US = {"q": 500.0, "a": 1000.0, "t": 1000.0, "r": 500.0}, 8.0
QUICK = {"mahony_q", "none"}  # whose latency has a bar
SLOW = "send quaternions, or lower PHASE_UPDATE_US in the port's Makefile"
LATE = "raise PHASE_UPDATE_US in the port's Makefile above the longest update"
APART = BAR[1:]  # degrees from the Python filter, root mean square and largest
ROWS = 200  # of the trajectory in the JSON document
UNIT = {"avr": "cycles", "m4": "instructions"}
NAMES = {"q": "quaternion frames", "a": "angle frames", "t": "text lines", "r": "raw frames"}


def trial_document(trial: Trial, recording: str, *, command: str = "") -> Document:
    """Tell how an image did on a recording."""
    emulation, image = trial.emulation, trial.image
    where = "simavr, to the cycle" if image.target == "avr" else "QEMU, which counts instructions, not cycles"
    lead = (
        f"{image.filter} on {emulation.target}, {len(emulation.frames)} samples of {recording} at 100 Hz, "
        f"{NAMES[emulation.mode]}; emulated by {where}."
    )
    return Document(
        title=f"Firmware on {recording}",
        lead=lead,
        verdicts=tuple(_verdicts(trial)),
        sections=tuple(_sections(trial)),
        numbers=_numbers(trial, recording),
        command=command,
    )


def _verdicts(trial: Trial) -> list[Verdict]:
    emulation, image = trial.emulation, trial.image
    lost, count = emulation.lost + emulation.corrupt, len(emulation.frames)
    status: Status = "PASS" if lost == 0 else "FAIL"
    found = [
        Verdict(
            "frames lost or corrupt", lost, None, status, f"of {count}",
            "" if lost == 0 else "a faster line: BAUD=500000 in the port's Makefile",
        )
    ]  # fmt: skip
    found.append(_same_bits(trial, count))
    if trial.apart is not None:
        rms, worst = float(np.sqrt(np.mean(trial.apart**2))), float(trial.apart.max())
        good = rms <= APART[0] and worst <= APART[1]
        meaning = f"root mean square over the recording; largest {worst:.3f}°"
        status = "PASS" if good else "WARN"
        action = "" if good else "factorlab firmware verify says which module departs"
        found.append(Verdict("from the Python filter", rms, (0.0, APART[0]), status, meaning, action, "°"))
    if (error := _error(trial)) is not None:
        total, heading, inclination = error
        meaning = f"heading {heading:.2f}°, inclination {inclination:.2f}°, mean heading offset off"
        found.append(Verdict("error against the truth", total, None, "INFO", meaning, unit="°"))
    found += _times(trial)
    flash, ram = FLASH[image.board]
    share = f"{image.flash / flash:.0%} of flash; RAM {image.ram} B of {ram}"
    found.append(Verdict("flash", image.flash, None, "INFO", share, unit="B"))
    if emulation.stack is not None:
        free = ram - image.ram - emulation.stack
        status = "PASS" if free > 0 else "FAIL"
        found.append(
            Verdict("stack used at most", emulation.stack, None, status, f"{free} B stay free", unit="B")
        )
    return found


def _same_bits(trial: Trial, count: int) -> Verdict:
    """Fixed point is the same everywhere; so are floats, but for the AVR's, which round on their own."""
    exact = trial.image.target == "m4" or trial.image.filter.endswith("_q")
    same = trial.unlike == 0
    status: Status = "PASS" if same else "FAIL" if exact else "INFO"
    meaning = f"of {count}, beside the same application compiled for this computer"
    action = "" if same or not exact else "python -m pytest tests/firmware/test_agree.py tells the module"
    return Verdict("frames unlike this computer's", trial.unlike, None, status, meaning, action)


def _times(trial: Trial) -> list[Verdict]:
    """Update, latency, jitter."""
    emulation, unit = trial.emulation, UNIT[trial.image.target]
    found = []
    taken = emulation.update_cycles[np.isfinite(emulation.update_cycles)]
    if len(taken):
        clock = 16e6 if trial.image.target == "avr" else 25e6
        said = (
            f"mean {taken.mean():.0f}; {taken.max() / clock * 100:.1%} of the 10 ms at {clock / 1e6:.0f} MHz"
        )
        found.append(Verdict("longest update", float(taken.max()), None, "INFO", said, unit=unit))
    judged = trial.image.target == "avr"  # QEMU has no time of its own
    quick = judged and trial.image.filter in QUICK
    for name, values, bar, action in (
        ("sample to first byte", emulation.latency, LATENCY_US[emulation.mode] if quick else None, SLOW),
        ("departure of the period", emulation.jitter, JITTER_US if judged else None, LATE),
    ):
        known = 1e6 * np.abs(values[np.isfinite(values)])
        if not len(known):
            continue
        longest = float(known.max())
        said = f"longest; mean {known.mean():.1f} µs"
        if bar is None:
            found.append(Verdict(name, longest, None, "INFO", said, unit="µs"))
            continue
        good = longest <= bar
        status: Status = "PASS" if good else "WARN"
        found.append(Verdict(name, longest, (0.0, bar), status, said, "" if good else action, "µs"))
    if emulation.asleep is not None:
        said = "of the time the processor sleeps: no busy waiting"
        found.append(Verdict("asleep", 100 * emulation.asleep, None, "INFO", said, unit="%"))
    return found


def _error(trial: Trial) -> tuple[float, float, float] | None:
    error = trial.solved[0].error if trial.solved else None
    return None if error is None else error.degrees


def _sections(trial: Trial) -> list[Section]:
    from factorlab.report import attitude_figures, firmware_figures

    unit = UNIT[trial.image.target]
    sections = []
    if trial.solved:
        sections.append(
            Section(
                "Roll, pitch and yaw",
                figure=lambda: attitude_figures.angles(trial.solved, None),
                caption="The board beside the Python filter on the same samples.",
            )
        )
        sections.append(
            Section("The board less the Python filter", figure=lambda: firmware_figures.from_model(trial))
        )
    sections.append(
        Section("Length of an update", figure=lambda: firmware_figures.cycles(trial.emulation, unit))
    )
    sections.append(
        Section(
            "When frames leave",
            "Latency counts from the sample in RAM to the first byte of its frame on the line, which leaves "
            "after the update only.",
            figure=lambda: firmware_figures.timing(trial.emulation),
        )
    )
    image = trial.image
    flash, ram = FLASH[image.board]
    rows: tuple[tuple[str | float | None, ...], ...] = (
        ("flash (code and constants)", image.flash, flash),
        ("RAM before the program runs", image.ram, ram),
        ("stack used at most", trial.emulation.stack, None),
    )
    table = Table(("", ("taken", "B"), ("of", "B")), rows, digits=6)
    return [*sections, Section("Memory", table=table)]


def _numbers(trial: Trial, recording: str) -> dict[str, Any]:
    emulation, image, board = trial.emulation, trial.image, trial.board
    rows = np.unique(np.linspace(0, len(board) - 1, min(len(board), ROWS)).astype(int))
    numbers: dict[str, Any] = {
        "recording": recording,
        "target": image.target,
        "board": emulation.target,
        "filter": image.filter,
        "mode": emulation.mode,
        "samples": len(emulation.frames),
        "frames": {"lost": emulation.lost, "corrupt": emulation.corrupt, "unlike_host": trial.unlike},
        f"update_{UNIT[image.target]}": _spread(emulation.update_cycles),
        "latency_us": _spread(1e6 * emulation.latency),
        "jitter_us": _spread(1e6 * emulation.jitter),
        "bytes": {"flash": image.flash, "ram": image.ram, "stack": emulation.stack},
        "asleep": emulation.asleep,
        "final_deg": dict(
            zip(("roll", "pitch", "yaw"), np.degrees(board.roll_pitch_yaw()[-1]).tolist(), strict=True)
        ),
        "trajectory": {
            "t_s": board.seconds[rows].tolist(),
            "world_q_body_wxyz": np.round(board.world_q_body[rows], 6).tolist(),
            "rows": len(board),
        },
    }
    if trial.apart is not None:
        numbers["from_python_deg"] = {
            "rms": float(np.sqrt(np.mean(trial.apart**2))), "max": float(trial.apart.max()),
        }  # fmt: skip
    if (error := _error(trial)) is not None:
        numbers["error_deg"] = dict(zip(("total", "heading", "inclination"), error, strict=True))
    return numbers


def _spread(values: Array) -> dict[str, float] | None:
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    return {"mean": float(known.mean()), "min": float(known.min()), "max": float(known.max())}
