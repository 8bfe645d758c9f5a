"""CPU and wall seconds of this process up to a first result: `python first_call.py import|linear|extended`.

Started by start_up.py; the caches are warm, since it is started once before it counts.
"""

import sys
import time

BEGAN = time.perf_counter()

import sequential as sq  # noqa: E402


def linear() -> None:
    """A Kalman filter of four states over a log of a hundred readings."""
    model = sq.StateSpace(
        sq.Vector(4),
        sq.Gaussian([0.0] * 4, [1.0] * 4),
        sq.ConstantVelocity(0.1, axes=2),
        {"z": sq.LinearSensor([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]], 0.25)},
    )
    t = [0.1 * k for k in range(100)]
    sq.run(sq.KalmanFilter(), model, sq.SensorLog({"z": sq.Stream(t, [(s, -s) for s in t])}))


def extended() -> None:
    """An extended one of a unicycle that sees a landmark a hundred times."""
    model = sq.StateSpace(
        sq.SE2(),
        sq.Gaussian([0.0, 0.0, 0.0], sq.diagonal([0.1, 0.1, 0.1])),
        sq.Unicycle(0.02, 0.02, 0.02, slip=0.02, turn_slip=0.02),
        {"landmark": sq.RangeBearing([[8.0, 1.0]], sq.diagonal([0.1, 0.03]))},
        input="odometry",
    )
    t = [0.1 * k for k in range(100)]
    log = {"odometry": sq.Stream(t, [(0.0, 0.0)] * 100)}
    log["landmark"] = sq.Stream(t, [(8.06, 0.124)] * 100, [(0.0,)] * 100)
    sq.run(sq.ExtendedKalmanFilter(), model, sq.SensorLog(log))


if __name__ == "__main__":
    {"import": lambda: None, "linear": linear, "extended": extended}[sys.argv[1]]()
    sys.stdout.write(f"{time.process_time()} {time.perf_counter() - BEGAN}\n")
