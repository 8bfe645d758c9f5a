"""A small world that is quick to estimate: a walker on a plane, seen by two position sensors."""

import textwrap
from pathlib import Path

import numpy as np
import pytest

import sequential as sq
from factorlab.datasets import Dataset, Truth
from sequential.evaluate import Trajectory
from sequential.readers import write_log, write_tum
from sequential.tuning import noise_knobs, scaled

MODEL_FILE = """
    import sequential as sq

    def model(acceleration=0.04, sigma=0.2):
        return sq.StateSpace(
            manifold=sq.Vector(4),
            prior=sq.Gaussian([0.0, 0.0, 1.0, 0.0], [0.25, 0.25, 0.25, 0.25]),
            process=sq.ConstantVelocity(acceleration, axes=2),
            sensors={"gps": sq.Position(sigma**2, axes=2), "tag": sq.Position(0.25, axes=2)},
        )

    def timid():
        return model(sigma=0.02)

    MODEL = model()
    ANSWER = 42

    def needs(an_argument):
        return MODEL
"""


def walk(rng, sensor_sigma=0.2, count=150):
    """A model, its log, and where the walker was: consistent by construction."""
    q, dt = 0.04, 0.2
    transition = np.eye(4)
    transition[:2, 2:] = dt * np.eye(2)
    block = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    noise = np.kron(block, np.eye(2))
    model = sq.StateSpace(
        manifold=sq.Vector(4),
        prior=sq.Gaussian([0.0, 0.0, 1.0, 0.0], [0.25] * 4),
        process=sq.ConstantVelocity(q, axes=2),
        sensors={"gps": sq.Position(sensor_sigma**2, axes=2), "tag": sq.Position(0.25, axes=2)},
    )
    x = model.prior.mean + 0.5 * rng.standard_normal(4)
    states = [x]
    for _ in range(count - 1):
        x = transition @ x + rng.multivariate_normal(np.zeros(4), noise)
        states.append(x)
    states = np.array(states)
    t = dt * np.arange(count)
    log = sq.SensorLog(
        {
            "gps": sq.Stream(t, states[:, :2] + 0.2 * rng.standard_normal((count, 2))),
            "tag": sq.Stream(t[::3], states[::3, :2] + 0.5 * rng.standard_normal((len(t[::3]), 2))),
        },
        "walk",
    )
    return model, log, t, states


@pytest.fixture
def walker(rng):
    """A `Dataset` with a truth."""
    return dataset_of(*walk(rng))


def dataset_of(model, log, t, states):
    return Dataset(
        name="walk",
        title="a walk <in> the park & back",
        log=log,
        model=model,
        held_out=None,
        truth=Truth(sq.log.nanoseconds(t), states[:, :2]),
        axes=2,
        knobs=noise_knobs(model),
        build=lambda values: scaled(model, values),
        notes=("made for a test",),
        default_estimators=("ekf", "ekf_rts", "ieks"),
    )


@pytest.fixture
def files(tmp_path, rng):
    """A folder with `walk.csv`, `truth.tum` and `walker.py`."""
    _model, log, t, states = walk(rng)
    write_log(tmp_path / "walk.csv", log)
    write_tum(tmp_path / "truth.tum", Trajectory(t, states[:, :2]))
    (tmp_path / "walker.py").write_text(textwrap.dedent(MODEL_FILE), encoding="utf-8")
    return Path(tmp_path)
