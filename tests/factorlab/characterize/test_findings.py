"""What readers and checks notice is told in French too."""

import re

import numpy as np
import pytest

from factorlab.characterize.findings import _phrases, in_french, of_findings
from sequential.readers import read_imu
from sequential.sensors import Finding, ImuErrors, ImuRecording, simulate_imu, stationary, tumble
from sequential.sensors.health import inspect

ENGLISH = re.compile(r"\b(?:the|is|are|of|at rest|samples|with|from|recording)\b")


def test_numbers_and_names_go_through():
    assert in_french("gyro x saturates at -4.3657 in 10 samples (0.10%)") == (
        "gyromètre x sature à -4,3657 pour 10 mesures (0,10%)"
    )
    assert in_french("something that nobody has said before") == "something that nobody has said before"


def test_no_phrase_hides_another():
    for k, (_, french) in enumerate(_phrases()):
        assert "{" not in re.sub(r"\{[a-d]\}", "", french), k
    written = [pattern.pattern for pattern, _ in _phrases()]
    assert len(set(written)) == len(written)


def faulty(rng):
    """Recordings with the faults that students meet."""
    sound = simulate_imu(
        tumble(40.0, rng, rest=30.0), rng, errors=ImuErrors(gyro_bias=(0.01, 0, 0)), field=None
    )
    imu = sound.recording
    noise = 0.01 * rng.standard_normal((len(imu), 3))
    accel, gyro = imu.accel + noise, imu.gyro + 0.1 * noise
    stuck = np.where(np.arange(3) == 1, 0.5, gyro)
    pause = np.where(np.arange(len(imu)) > 2000, 3_000_000_000, 0) + imu.t
    still = simulate_imu(stationary(30.0), rng).recording
    constant = np.broadcast_to([20.0, 0.0, -40.0], (len(still), 3))
    return {
        "g": ImuRecording(imu.t, accel / 9.80665, gyro),
        "degrees": ImuRecording(imu.t, accel, np.degrees(gyro)),
        "stuck": ImuRecording(imu.t, accel, stuck),
        "pause": ImuRecording(pause, accel, gyro),
        "short": ImuRecording(imu.t[:300], accel[:300], gyro[:300]),
        "saturated": ImuRecording(imu.t, accel, np.clip(gyro, -0.5, 0.5)),
        "magnet": ImuRecording(still.t, still.accel + 1e-3, still.gyro, constant),
    }


@pytest.mark.parametrize("fault", ["g", "degrees", "stuck", "pause", "short", "saturated", "magnet"])
def test_faults_are_told_in_french(fault, rng):
    findings = inspect(faulty(rng)[fault])
    assert findings
    for verdict in of_findings(findings, "fr"):
        assert not ENGLISH.search(verdict.meaning), verdict.meaning


def test_an_mpu6050_without_units(data_dir):
    findings = inspect(read_imu(data_dir / "imu/mpu6050/imu_static_test.csv"))
    assert len(findings) >= 3
    for verdict in of_findings(findings, "fr"):
        assert not ENGLISH.search(f"{verdict.meaning} {verdict.action}"), verdict


def test_the_same_finding_is_told_once():
    one = Finding("warn", "3 pauses in the recording, the longest of 2.50 s")
    (told,) = of_findings((one, one), "fr")
    assert told.meaning == "3 pauses dans l'enregistrement, la plus longue de 2,50 s"
    assert told.verdict == "WARN"
