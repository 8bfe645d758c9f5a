"""The tilt Kalman filter is the library's Kalman filter; the complementary one is the textbook's."""

from dataclasses import replace

import numpy as np
import pytest
from attitude_worlds import RATE, seen, still, swinging

import sequential as sq
from sequential.attitude import (
    ComplementaryAttitude,
    Mahony,
    TiltKalman,
    attitude_from_angles,
    body_rates,
    tilt,
)
from sequential.errors import DataError, MissingStreamError, ModelError, ShapeError
from sequential.evaluate import attitude_nees
from sequential.sensors import ImuRecording
from sequential.signal import Complementary


@pytest.mark.parametrize("channel", ["roll", "pitch"])
@pytest.mark.parametrize("gate", [None, 0.99])
def test_a_channel_is_the_library_s_kalman_filter(channel, gate, rng):
    t, angles = swinging()
    recording = seen(t, attitude_from_angles(angles), bias=[0.01, -0.02, 0.0], rng=rng)
    accel = recording.accel.copy()
    accel[600:620] += [3.0, 4.0, 1.0]
    recording = ImuRecording(recording.t, accel, recording.gyro)
    filt = TiltKalman(tilt_sigma=0.02, gate=gate)
    run = sq.run(sq.KalmanFilter(), *filt.channel(recording, channel))
    own, column = filt.path(recording), ["roll", "pitch"].index(channel)
    np.testing.assert_allclose(own[1:, [column, 3 + column]], run.mean[-(len(t) - 1) :], atol=1e-10)
    np.testing.assert_allclose(own[1:, 6 + column], run.cov[-(len(t) - 1) :, 0, 0], rtol=1e-9)
    np.testing.assert_allclose(own[1:, 9 + column], run.cov[-(len(t) - 1) :, 0, 1], rtol=1e-8)
    np.testing.assert_allclose(own[1:, 12 + column], run.cov[-(len(t) - 1) :, 1, 1], rtol=1e-9)
    assert (run.report.rejected > 5) == (gate is not None)


def test_q_is_tuned_by_nis_on_a_channel(rng):
    t, angles = swinging(60.0)
    recording = seen(t, attitude_from_angles(angles), mag=False, rng=rng)
    shaken = recording.gyro + 0.2 * rng.normal(size=recording.gyro.shape)  # 0.02 rad/s/√Hz at 100 Hz
    recording = ImuRecording(recording.t, recording.accel, shaken)
    filt = TiltKalman(tilt_sigma=0.05 / 9.81, gyro_density=0.005)
    model, log = filt.channel(recording, "roll")
    first = float(model.prior.mean[0])

    def declare(values):
        return replace(replace(filt, gyro_density=values["q"]).model("roll", first), start=model.start)

    found = sq.tune_by_nis(declare, [sq.Knob("q", 1e-2, "rad/s/√Hz")], log)
    assert found.values["q"] == pytest.approx(0.02, rel=0.3)


def test_angles_and_biases_are_found_with_honest_sigmas(rng):
    t, angles = swinging(60.0)
    truth, bias = attitude_from_angles(0.3 * angles), np.array([0.02, -0.01, 0.0])
    recording = seen(t, truth, mag=False, bias=bias, rng=rng)
    filt = TiltKalman(gyro_density=2e-3 / np.sqrt(RATE), bias_walk=1e-5, tilt_sigma=0.05 / 9.81)
    found = filt.estimate(recording)
    np.testing.assert_allclose(found.gyro_bias[-1, :2], bias[:2], atol=3e-3)
    sigmas = found.roll_pitch_yaw_sigmas()
    error = np.abs(found.roll_pitch_yaw() - 0.3 * angles)[1000:, :2]
    assert np.mean(error < 2 * sigmas[1000:, :2]) > 0.75
    assert np.isfinite(attitude_nees(found.world_q_body, found.cov, truth)).all()
    assert np.all(np.diff(sigmas[1000:, 2]) > 0)  # nothing corrects yaw


def test_a_field_that_comes_late_teaches_the_bias(rng):
    """A minute without a field: the first one sets yaw, and says nothing of the drift before it."""
    rows, bias = 12_000, 0.01
    gyro = np.array([0.0, 0.0, bias]) + 1e-3 * rng.normal(size=(rows, 3))
    accel = np.array([0.0, 0.0, 9.81]) + 0.05 * rng.normal(size=(rows, 3))
    mag = np.array([0.0, 20.0, -40.0]) + 0.3 * rng.normal(size=(rows, 3))
    mag[:6000] = np.nan
    found = TiltKalman().estimate(ImuRecording(np.arange(rows) * 10_000_000, accel, gyro, mag))
    assert np.abs(np.degrees(found.roll_pitch_yaw()[6000:, 2])).max() < 2.0
    assert np.abs(found.gyro_bias[:, 2]).max() < 0.02
    assert found.gyro_bias[-1, 2] == pytest.approx(bias, abs=1e-3)


def test_what_is_told_about_the_body_is_told_about_the_angles(rng):
    """Compiled, against the matrices of `body_rates` on angles of every kind."""
    t, angles = swinging(8.0)
    filt = TiltKalman()
    for shift in ([0.0, 0.0, 0.0], [2.5, 0.6, -2.0]):
        recording = seen(t, attitude_from_angles(angles + np.array(shift)), rng=rng)
        found, states = filt.estimate(recording), filt.path(recording)
        body = body_rates(states[:, :3])
        np.testing.assert_allclose(
            np.abs(np.sum(found.world_q_body * attitude_from_angles(states[:, :3]), 1)), 1
        )
        for cov, at in ((found.cov, 6), (found.gyro_bias_cov, 12)):
            expected = np.einsum("nij,nj,nkj->nik", body, states[:, at : at + 3], body)
            np.testing.assert_allclose(cov, expected, rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(found.gyro_bias, np.einsum("nij,nj->ni", body, states[:, 3:6]), atol=1e-12)


def test_about_one_axis_the_complementary_filter_is_the_textbook_s(rng):
    t = np.arange(0, 20, 1 / RATE)
    angles = np.zeros((len(t), 3))
    angles[:, 0] = 0.6 * np.sin(t)
    recording = seen(t, attitude_from_angles(angles), mag=False, rng=rng)
    flat = ImuRecording(recording.t, recording.accel * [0, 1, 1], recording.gyro * [1, 0, 0])
    found = ComplementaryAttitude(time_constant=1.5).estimate(flat).roll_pitch_yaw()[:, 0]
    share, angle, expected = -np.expm1(-1 / RATE / 1.5), None, []
    for rate, measured in zip(flat.gyro[:, 0], tilt(flat.accel)[:, 0], strict=True):
        angle = measured if angle is None else (1 - share) * (angle + rate / RATE) + share * measured
        expected.append(angle)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    library = Complementary(1.5, angle=True)(t, tilt(flat.accel)[:, 0], rate=flat.gyro[:, 0])
    np.testing.assert_allclose(found[100:], library[100:], atol=0.01)


def test_a_pitch_over_the_top_folds_and_is_refused_as_a_channel():
    t = np.arange(0, 4, 1 / RATE)
    angles = np.column_stack([np.zeros_like(t), 0.6 * t, np.zeros_like(t)])
    recording = seen(t, attitude_from_angles(angles), mag=False)
    found = TiltKalman().estimate(recording)
    assert np.isfinite(found.world_q_body).all()
    assert np.abs(found.roll_pitch_yaw()[:, 1]).max() <= np.pi / 2
    with pytest.raises(DataError, match="over 90°"):
        TiltKalman().channel(recording, "pitch")


def test_mistakes_are_told_in_sentences():
    recording = still((0.0, 0.0, 0.0), 1.0)
    with pytest.raises(ModelError, match="gate"):
        TiltKalman(gate=9.0)
    with pytest.raises(ModelError, match="tilt_sigma"):
        TiltKalman(tilt_sigma=0.0)
    with pytest.raises(ModelError, match="'roll' or 'pitch'"):
        TiltKalman().channel(recording, "yaw")
    with pytest.raises(ModelError, match="time_constant"):
        ComplementaryAttitude(time_constant=0.0)
    with pytest.raises(MissingStreamError, match="gyro"):
        Mahony().estimate(ImuRecording(recording.t, recording.accel))
    with pytest.raises(MissingStreamError, match="mag"):
        Mahony(magnetometer=True).estimate(ImuRecording(recording.t, recording.accel, recording.gyro))
    with pytest.raises(ModelError, match="threads"):
        Mahony().estimate_many([recording], threads=0)
    with pytest.raises(ShapeError, match="begin with start"):
        Mahony().step(np.zeros(4), np.zeros(3), np.zeros(3), None, 0.01)
    with pytest.raises(ShapeError, match="gyro of one sample"):
        Mahony().start(np.zeros(4), np.zeros(3))
