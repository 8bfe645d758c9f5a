"""A drive past one landmark in three visits."""

import numpy as np

from sequential.manifold import SE2, Vector
from sequential.slam import Factors, SlamProblem, Values
from sequential.slam.models import Between, Displacement

LANDMARK = np.array([3.0, 1.0])
SEEN = (0, 1, 2, 200, 201, 500)


def round_trip(noise=0.0, rng=None):
    """Six sightings of one landmark in three visits, from true poses."""
    x = np.zeros((501, 3))
    x[:, 0] = np.linspace(0.0, 1.0, 501)
    index = np.column_stack([SEEN, np.zeros(len(SEEN), dtype=int)])
    z = Displacement().expected(x[list(SEEN)], np.tile(LANDMARK, (len(SEEN), 1)))
    if rng is not None:
        z = z + noise * rng.standard_normal(z.shape)
    steps = np.column_stack([np.arange(500), np.arange(1, 501)])
    driven = Factors(Between(SE2()), ("x", "x"), steps, Between(SE2()).expected(x[:-1], x[1:]), 1e-4)
    seen = Factors(Displacement(), ("x", "l"), index, z, 0.01, name="laser")
    problem = SlamProblem({"x": SE2(), "l": Vector(2)}, (driven, seen))
    return problem, Values({"x": np.arange(501)}, {"x": x})
