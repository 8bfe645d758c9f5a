"""A delivery robot on line: odometry at 20 Hz at once, radio ranges that arrive up to half a second late.

Three ways to live with lateness: leave late readings out, take them in as if they were new, or put them where
they belong.  The last one costs a few microseconds a reading and gives what the sorted log gives.
"""

import numpy as np

import sequential as sq

BEACONS = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 20.0], [0.0, 20.0]])
MODEL = sq.StateSpace(
    manifold=sq.SE2(),
    prior=sq.Gaussian([15.0, 4.0, 0.0], sq.diagonal([0.3, 0.3, 0.05])),
    process=sq.Unicycle(along=0.1, across=0.05, heading=0.05),
    sensors={"range": sq.Range(BEACONS, 0.15**2)},
    input="odometry",
    start=0.0,
)


def record(rng, duration_s=60.0, rate_hz=20.0):
    """Two laps: the log, and the true states at its stamps."""
    t = np.arange(int(duration_s * rate_hz) + 1) / rate_hz
    speed_and_turn = np.column_stack([1.5 + 0.3 * np.sin(0.5 * t), 0.2 + 0.05 * np.cos(0.3 * t)])
    heard = np.arange(1, len(t), 3)
    beacon = rng.integers(0, len(BEACONS), (len(heard), 1))
    return sq.simulate(
        MODEL, t, rng, inputs=speed_and_turn, readings={"range": heard}, contexts={"range": beacon}
    )


def as_if_new(events):
    """What a filter does that stamps readings when they come."""
    at = np.maximum.accumulate([event.t for event in events]).tolist()
    return [event._replace(t=t) for event, t in zip(events, at, strict=True)]


def follow(name, drawn, events, max_delay):
    """The estimates at the odometry's stamps against the truth there, and the newest belief."""
    estimates = sq.stream(sq.ExtendedKalmanFilter(), MODEL, events, max_delay=max_delay)
    made = [estimate for estimate in estimates if estimate.name == "odometry"]
    truth = drawn.truth[np.searchsorted(drawn.t, [estimate.t for estimate in made])]
    off = np.array([estimate.belief.mean[:2] for estimate in made]) - truth[:, :2]
    rmse = float(np.sqrt((off**2).sum(axis=1).mean()))
    print(f"late ranges {name:18} RMSE {rmse:.3f} m")
    if estimates.summary.message:
        print(f"    {estimates.summary.message}")
    return rmse, estimates.belief


def main():
    rng = np.random.default_rng(3)
    drawn = record(rng)
    events = sq.arrivals(drawn.log, {"range": lambda rng, n: rng.uniform(0.0, 0.5, n)}, rng)
    left_out, _ = follow("left out", drawn, events, 0.0)
    as_new, _ = follow("as if new", drawn, as_if_new(events), 0.0)
    placed, belief = follow("where they belong", drawn, events, events.lateness)
    assert placed < 0.8 * min(left_out, as_new)
    whole = sq.run(sq.ExtendedKalmanFilter(), MODEL, drawn.log, at=np.array([belief.t]))
    assert np.abs(belief.mean - whole.mean[-1]).max() < 1e-12, "late or not, the end is that of the whole log"


if __name__ == "__main__":
    main()
