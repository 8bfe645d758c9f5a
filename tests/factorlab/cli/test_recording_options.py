"""Opening a recording for a command: what stops it, what is only said, and the options of the file."""

from dataclasses import replace

import click
import numpy as np
import pytest
from click.testing import CliRunner

from factorlab.cli.faults import in_one_sentence
from factorlab.cli.recording import opened, recording_options
from sequential.noise import ImuNoise
from sequential.readers import write_imu
from sequential.sensors import ImuErrors, simulate_imu, tumble


@pytest.fixture
def recording(rng):
    errors = ImuErrors(ImuNoise(2e-4, 2e-3, 0.0, 0.0), gyro_bias=(0.01, 0.0, 0.0), mag_sigma=0.3)
    return simulate_imu(tumble(30.0, rng, rest=3.0), rng, errors=errors).recording


def command(**settings):
    @click.command()
    @click.argument("source")
    @recording_options
    @in_one_sentence
    def run(source, **options):
        found, findings = opened(source, **settings, **options)
        click.echo(
            f"{len(found.recording)} samples of {', '.join(found.recording.sensors)}; {len(findings)} said"
        )
        return 0

    return lambda *arguments: CliRunner().invoke(run, [*map(str, arguments)])


def test_a_sound_recording(tmp_path, recording):
    write_imu(recording, tmp_path / "x.csv")
    done = command()(tmp_path / "x.csv")
    assert done.exit_code == 0
    assert done.stdout == "3001 samples of accel, gyro, mag; 0 said\n"


def test_a_failure_stops_the_command(tmp_path, recording):
    write_imu(replace(recording, accel=recording.accel / 9.80665), tmp_path / "x.csv")
    done = command()(tmp_path / "x.csv")
    assert done.exit_code == 1
    assert "so it is in g, not in m/s²" in done.stderr
    assert command()(tmp_path / "x.csv", "--units", "accel=g").exit_code == 0
    write_imu(replace(recording, gyro=-recording.gyro), tmp_path / "y.csv")
    done = command()(tmp_path / "y.csv")
    assert done.exit_code == 1
    assert done.stderr.startswith("error: y cannot be used: the gyro turns gravity the wrong way")
    assert command(usable=False)(tmp_path / "y.csv").exit_code == 0


def test_sensors_that_do_not_count_stop_nothing(tmp_path, recording):
    dead = replace(recording, mag=np.tile([1.0, 2.0, 3.0], (len(recording), 1)))
    write_imu(dead, tmp_path / "x.csv")
    assert "--no-mag" in command()(tmp_path / "x.csv").stderr
    done = command(only=("accel", "gyro"))(tmp_path / "x.csv")
    assert done.exit_code == 0
    assert done.stdout.endswith("of accel, gyro, mag; 0 said\n")


def test_warnings_go_to_stderr(tmp_path, recording):
    write_imu(recording.slice(10.0, 17.0), tmp_path / "x.csv")
    done = command()(tmp_path / "x.csv")
    assert done.exit_code == 0
    assert "warn: the recording lasts 7 s" in done.stderr
    assert "warn" not in done.stdout


def test_options_reach_the_reader(tmp_path, recording):
    table = np.hstack([recording.accel / 9.80665, np.rad2deg(recording.gyro)])
    np.savetxt(tmp_path / "x.csv", table, delimiter=",", header="a,b,c,d,e,f", comments="")
    given = ("--columns", "ax=a,ay=b,az=c,gx=d,gy=e,gz=f", "--units", "accel=g,gyro=deg/s", "--rate", "100")
    done = command()(tmp_path / "x.csv", *given)
    assert done.exit_code == 0, done.output
    assert "3001 samples of accel, gyro" in done.stdout
    assert command()(tmp_path / "x.csv", "--kind", "mpu").exit_code == 1
    assert command()(tmp_path / "x.csv", "--rate", "0").exit_code == 2
