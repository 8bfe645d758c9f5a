"""Count the instructions of firmware filters on an emulated Cortex-M4F.

    python tests/benchmarks/measure/count_m4.py mahony_f32 error_state_f32 --seconds 60 [--6d]

Prints a table of mean and worst update, and bytes of code; with --map every function's.
"""

import argparse

import numpy as np

from factorlab.datasets.recordings import open_recording
from factorlab.firmware.instructions import count_instructions, imu_f32, imu_q
from sequential.sensors import ImuRecording


def main() -> None:
    """Parse, count, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="+", help="mahony_f32; mahony_q:mahony_q_step_9d names the step")
    parser.add_argument("--recording", default="broad:07")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, help="samples a second the filter is told [of the log]")
    parser.add_argument("--6d", dest="no_mag", action="store_true", help="leave the magnetometer out")
    parser.add_argument("--optimize", default="-O2")
    parser.add_argument("--map", action="store_true", help="bytes of every function")
    given = parser.parse_args()
    recording = open_recording(given.recording).recording.slice(0.0, given.seconds)
    if given.no_mag:
        recording = ImuRecording(recording.t, accel=recording.accel, gyro=recording.gyro)
    rate = given.rate or recording.rate
    print(
        f"{given.recording}, {len(recording)} samples, {'6-D' if given.no_mag else '9-D'}, {given.optimize}"
    )
    print(f"{'':34}{'mean':>9}{'median':>9}{'worst':>9}{'text':>8} B")
    for name in given.modules:
        module, _, step = name.partition(":")
        samples = imu_q(recording) if module.endswith("_q") else imu_f32(recording)
        counts = count_instructions(module, samples, rate=rate, step=step or None, optimize=given.optimize)
        middle = int(np.median(counts.instructions))
        print(f"{name:34}{counts.mean:9.1f}{middle:9d}{counts.worst:9d}{sum(counts.text.values()):8d}")
        for function, size in counts.text.items() if given.map else ():
            print(f"    {function:60}{size:6d}")


if __name__ == "__main__":
    main()
