"""The noise of an IMU as other programs read it."""

from __future__ import annotations

import tempfile
from pathlib import Path

from factorlab.characterize.engine import Study
from factorlab.characterize.words import say
from factorlab.report.words import Language
from sequential.readers import write_kalibr_imu

__all__ = ["kalibr_file"]


def kalibr_file(study: Study, lang: Language) -> dict[str, str]:
    """`imu.yaml` by name, where accelerometer and gyro were both characterised in SI units; else nothing."""
    slow = study.slow
    if slow.noise is None:
        return {}
    duration = study.axes[0].timing.duration
    comment = say(lang, "yaml_comment", name=study.name, duration=duration, rate=slow.rate)
    if slow.bounds:
        comment += "\n" + say(lang, "yaml_bounds", names=", ".join(slow.bounds))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "imu.yaml"
        write_kalibr_imu(path, slow.noise, slow.rate, comment=comment)
        return {path.name: path.read_text(encoding="utf-8")}
