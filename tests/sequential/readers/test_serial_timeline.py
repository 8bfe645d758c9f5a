"""Stamps and losses over the wraps of the sequence number and of the clock, pauses and restarts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sequential.readers.serial import BootFrame, RawFrame, Status
from sequential.readers.serial_timeline import Timeline

COUNTS = (0, 0, 4096, 0, 0, 0, 0)
FACTS = ((1, 0, 0), "atmega328p", "mahony_q", "MPU-6050", 100, 0, 2000, 8)


def sample(number, start_us=0, period_us=10_000, jitter_us=0):
    t = start_us + number * period_us + jitter_us
    return RawFrame(number % 65536, t % 2**32, COUNTS, Status(0))


@given(
    st.integers(0, 2**18),
    st.integers(0, 2**33),
    st.lists(st.integers(1, 90), min_size=2, max_size=60),
    st.integers(0, 2**16),
)
def test_losses_are_counted_through_every_wrap(first, start, steps, seed):
    """From anywhere in both cycles, with jitter of 1 % and up to 89 frames lost in a row."""
    numbers = first + np.concatenate([[0, 1], 1 + np.cumsum(steps)])
    jitter = np.random.default_rng(seed).integers(-100, 101, len(numbers))
    timeline = Timeline()
    stamps = [
        timeline.place(sample(int(n), start, jitter_us=int(j) + 100))
        for n, j in zip(numbers, jitter, strict=True)
    ]
    assert timeline.lost == numbers[-1] - numbers[0] + 1 - len(numbers)
    assert timeline.restarts == timeline.repeated == 0
    truth = (start + numbers * 10_000 + jitter + 100) * 1000
    assert np.array_equal(np.array(stamps) - stamps[0], truth - truth[0])


@pytest.mark.parametrize("pause", [65_535, 65_536, 65_537, 150_000, 200_000])
def test_a_gap_of_several_rounds_of_numbers_is_counted_whole(pause):
    timeline = Timeline()
    for number in (*range(10), 9 + pause):
        timeline.place(sample(number, jitter_us=7 * (number % 3)))
    assert timeline.lost == pause - 1


@pytest.mark.parametrize("boot", [True, False])
def test_a_restart_is_no_loss_and_lasts_as_long_as_this_computer_says(boot):
    timeline = Timeline()
    frames = [sample(number, 5_000_000) for number in range(100, 110)]
    again = [BootFrame(0, 40_000, *FACTS)] if boot else []
    again += [sample(number, 40_000) for number in range(1, 10)]
    for k, frame in enumerate(frames):
        last = timeline.place(frame, k * 10_000_000)
    stamps = [timeline.place(frame, (k + 200) * 10_000_000) for k, frame in enumerate(again)]
    assert (timeline.lost, timeline.restarts, timeline.repeated) == (0, 1, 0)
    assert stamps[0] - last == (200 - 9) * 10_000_000
    assert (np.diff(stamps) == 10_000_000).all()


def test_a_boot_frame_asked_for_is_no_restart_whatever_its_number():
    timeline = Timeline()
    stamps = []
    for number in range(65_530, 65_545):
        frame = sample(number)
        if number == 65_536:
            frame = BootFrame(0, (number * 10_000 - 4_000) % 2**32, *FACTS)
        stamps.append(timeline.place(frame))
    assert (timeline.lost, timeline.restarts) == (0, 0)
    assert (np.diff(stamps) > 0).all()


def test_a_frame_that_came_already_gets_no_stamp():
    timeline = Timeline()
    assert timeline.place(sample(3)) == 30_000_000
    assert timeline.place(sample(3)) is None
    assert timeline.place(sample(4)) == 40_000_000
    assert (timeline.repeated, timeline.lost) == (1, 0)
