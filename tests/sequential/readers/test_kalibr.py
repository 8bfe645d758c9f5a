"""Kalibr's imu.yaml, as other people write it."""

import math

import pytest

from sequential.errors import DataError, FileFormatError
from sequential.noise import ImuNoise
from sequential.readers import read_kalibr_imu, write_kalibr_imu

GIVEN = """\
%YAML:1.0
---
#Accelerometers
accelerometer_noise_density: 1.86e-03   #Noise density (continuous-time)
accelerometer_random_walk:   4.33e-04   #Bias random walk
gyroscope_noise_density:     1.87e-04
gyroscope_random_walk:       2.66e-05
rostopic:                    /imu0
update_rate:                 200.0      #Hz
T_i_b: [[1, 0], [0, 1]]
"""


def test_a_file_as_it_is_found(tmp_path):
    path = tmp_path / "imu.yaml"
    path.write_text(GIVEN)
    noise, rate, topic = read_kalibr_imu(path)
    assert noise == ImuNoise(1.87e-4, 1.86e-3, 2.66e-5, 4.33e-4)
    assert (rate, topic) == (200.0, "/imu0")


def test_numbers_without_a_point_are_numbers_too(tmp_path):
    path = tmp_path / "imu.yaml"
    lines = [line for line in GIVEN.splitlines() if "update_rate" not in line]
    path.write_text("\n".join(lines).replace("1.86e-03", "2e-3"))
    noise, rate, _ = read_kalibr_imu(path)
    assert noise.accel_density == 2e-3
    assert math.isnan(rate)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("gyroscope_noise_density: 0.1\n", "missing: accelerometer_noise_density"),
        (GIVEN.replace("1.86e-03", "small"), "accelerometer_noise_density is 'small', a number is needed"),
        (GIVEN.replace("1.86e-03", "-1.0"), "a density is a finite number, zero or more"),
        ("- 1\n- 2\n", "holds no entries"),
        ("a: [1\n", "is not YAML"),
    ],
)
def test_bad_files_are_answered_by_a_sentence(text, says, tmp_path):
    path = tmp_path / "imu.yaml"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=says):
        read_kalibr_imu(path)


def test_a_rate_that_is_none_is_refused(tmp_path):
    with pytest.raises(DataError, match="rate of the IMU in Hz, a positive number; got 0"):
        write_kalibr_imu(tmp_path / "imu.yaml", ImuNoise(1, 1, 1, 1), 0.0)
    assert not list(tmp_path.iterdir())
