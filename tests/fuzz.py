"""Random linear models as ill-conditioned as they come, and what the forms of the filter make of them.

`fuzz(1000)` tries a thousand and counts; tests ask for zeros, the benchmark of the filters prints the counts.
"""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count, islice

import numpy as np

import sequential as sq
from sequential.errors import FactorlabError, ModelError, NotPositiveDefiniteError

FORMS = ("joseph", "ud", "sqrt")
STEPS = 25
DECADES = 12.0  # condition numbers reach 10 to this power
INDEFINITE = -1e-9  # lowest eigenvalue of a correlation matrix that may still be called rounding
VANISHED = 1e-290  # variances below it have too few digits left for a correlation


@dataclass
class Tally:
    """Counts by form of what went wrong; `first` holds the seed of the first of each kind."""

    models: int
    not_positive_definite: Counter = field(default_factory=Counter)
    refused: Counter = field(default_factory=Counter)
    negative_variance: Counter = field(default_factory=Counter)
    indefinite: Counter = field(default_factory=Counter)
    not_finite: Counter = field(default_factory=Counter)
    exceptions: Counter = field(default_factory=Counter)
    first: dict = field(default_factory=dict)

    def count(self, what, form, seed):
        getattr(self, what)[form] += 1
        self.first.setdefault((what, form), seed)


def rotation(rng, size):
    return np.linalg.qr(rng.standard_normal((size, size)))[0]


def covariance(rng, size, decades=DECADES):
    """A covariance of a random condition number, of which the door may still say that it is definite."""
    spread = 10.0 ** (-rng.uniform(0.0, decades) * rng.permutation(np.linspace(0.0, 1.0, size)))
    turn = rotation(rng, size)
    cov = 10.0 ** rng.uniform(-3.0, 3.0) * (turn * spread) @ turn.T
    units = 10.0 ** rng.uniform(-3.0, 3.0, size)
    return (cov + cov.T) / 2.0 * np.outer(units, units)


def transition(rng, size):
    """Rotations that shrink or grow, chains of integrators, and matrices that nearly forget a direction."""
    kind = rng.integers(3)
    if kind == 0:
        return rng.uniform(0.5, 1.02) * rotation(rng, size)
    if kind == 1:
        return np.eye(size) + 10.0 ** rng.uniform(-4.0, 0.0) * np.eye(size, k=1)
    shrink = 10.0 ** -rng.uniform(0.0, DECADES, size)
    return rotation(rng, size) * shrink @ rotation(rng, size)


def process_noise(rng, size):
    """Definite, of a low rank, or none."""
    kind = rng.integers(3)
    if kind == 0:
        return covariance(rng, size)
    if kind == 1:
        root = rng.standard_normal((size, rng.integers(1, size + 1))) * 10.0 ** rng.uniform(-6.0, 1.0)
        return root @ root.T
    return np.zeros((size, size))


def matrix(rng, rows, size):
    """What is read: anything, or rows that differ by almost nothing."""
    given = rng.standard_normal((rows, size))
    if rng.random() < 0.3:
        given = given[:1] + 10.0 ** -rng.uniform(0.0, DECADES) * given
    return given * 10.0 ** rng.uniform(-3.0, 3.0)


def random_problem(seed):
    """One model with a log of its own, readings missing here and there."""
    rng = np.random.default_rng(seed)
    size, rows = int(rng.integers(1, 13)), int(rng.integers(1, 5))
    model = sq.StateSpace(
        sq.Vector(size),
        sq.Gaussian(rng.standard_normal(size), covariance(rng, size)),
        sq.LinearProcess(transition(rng, size), process_noise(rng, size)),
        {"z": sq.LinearSensor(matrix(rng, rows, size), covariance(rng, rows))},
        start=0.0,
        check=False,
    )
    z = 10.0 ** rng.uniform(-3.0, 3.0) * rng.standard_normal((STEPS, rows))
    z[rng.random(z.shape) < rng.choice([0.0, 0.3])] = np.nan
    z[0, 0] = 0.0  # at least one component of one reading
    return sq.prepare(model, sq.SensorLog({"z": sq.Stream(0.1 * np.arange(STEPS), z)}))


def problems(seed=0):
    """Random problems without end, with their seeds; what the door refuses is drawn anew.

    It refuses covariances whose definiteness is below rounding.
    """
    for at in count(seed * 1_000_000_000 + 1):
        with suppress(NotPositiveDefiniteError):
            yield at, random_problem(at)


def judge(tally, form, seed, run):
    """What is wrong with a run."""
    finite = [run.mean, run.cov, run.innovations["z"].cov, np.array(run.log_likelihood)]
    if not all(np.isfinite(values).all() for values in finite):
        tally.count("not_finite", form, seed)
        return
    variances = np.diagonal(run.cov, axis1=1, axis2=2)
    if variances.min() < 0.0:
        tally.count("negative_variance", form, seed)
    sigmas = np.sqrt(np.where(variances > VANISHED, variances, 1.0))
    correlation = run.cov / (sigmas[:, :, None] * sigmas[:, None, :])
    if np.linalg.eigvalsh(correlation).min() < INDEFINITE:
        tally.count("indefinite", form, seed)


def fuzz(models, forms=FORMS, seed=0):
    """Run every form on so many random models."""
    tally = Tally(models)
    for at, problem in islice(problems(seed), models):
        for form in forms:
            try:
                run = sq.KalmanFilter(form=form).solve(problem)
            except NotPositiveDefiniteError:
                tally.count("not_positive_definite", form, at)
            except ModelError:
                tally.count("refused", form, at)
            except (FactorlabError, ArithmeticError) as error:
                tally.count("exceptions", form, at)
                tally.first[error.__class__.__name__, form] = at
            else:
                judge(tally, form, at, run)
    return tally
