"""The chain of the attitude smoother: algebra against least squares, model against differences."""

import numpy as np
import pytest
from attitude_worlds import seen, swinging

from sequential.attitude import AttitudeModel, AttitudeSmoother, attitude_from_angles
from sequential.attitude.smoother_cut import attitude_chain
from sequential.attitude.smoother_rows_kernel import MOVING, ROWS, STATIC, move, whitened_rows


@pytest.fixture(scope="module", params=[True, False], ids=["field", "no field"])
def chain(request):
    t, angles = swinging(12.0)
    recording = seen(t, attitude_from_angles(angles), bias=(0.01, 0.0, -0.01), rng=np.random.default_rng(7))
    return attitude_chain(recording, AttitudeModel(), field=request.param)


@pytest.fixture(scope="module")
def solution(chain):
    return AttitudeSmoother().solve(chain, chain.solve(covariance=False))


def rows(chain, rotation, state, weight):
    """Whitened rows (K + 1, 17, …) about a trajectory, and the right side."""
    count = len(chain.nodes) + 1
    before, here = np.empty((2, count, ROWS, MOVING))
    static, right = np.empty((count, ROWS, STATIC)), np.empty((count, ROWS))
    whitened_rows(
        chain.nodes, chain.rest, weight, chain.settings, chain.field, rotation, state, before, here,
        static, right,
    )  # fmt: skip
    return before, here, static, right


def dense(chain, rotation, state, weight):
    """The same problem as one matrix, with the prior: A δ = b over nodes, then constants."""
    from sequential.attitude.smoother_steps_kernel import difference

    before, here, static, right = rows(chain, rotation, state, weight)
    count = len(right)
    matrix = np.zeros((count * ROWS, count * MOVING + STATIC))
    for k in range(count):
        own = slice(k * ROWS, (k + 1) * ROWS)
        matrix[own, k * MOVING : (k + 1) * MOVING] = here[k]
        if k:
            matrix[own, (k - 1) * MOVING : k * MOVING] = before[k]
        matrix[own, -STATIC:] = static[k]
    sigma = np.sqrt(np.diag(chain.model.prior(heading=chain.field)))
    turn, mean = np.empty(3), np.zeros(23)
    difference(chain.beginning(rotation[0], field=chain.field), rotation[0], turn)
    mean[3:6] = chain.bias
    mean -= state[0]
    mean[:3] = turn
    prior = np.zeros((23, matrix.shape[1]))
    prior[np.arange(10), np.arange(10)] = prior[np.arange(10, 23), np.arange(-STATIC, 0)] = 1.0
    known = sigma > 0
    prior, mean, fixed = (
        prior / np.where(known, sigma, 1.0)[:, None],
        mean / np.where(known, sigma, 1.0),
        ~known,
    )
    # what is known for certain is no unknown
    columns = np.ones(matrix.shape[1], dtype=bool)
    columns[np.flatnonzero(prior[fixed].any(axis=0))] = False
    return np.vstack([matrix, prior[known]])[:, columns], np.append(right.ravel(), mean[known]), columns


def test_smoothing_is_least_squares(chain, solution):
    weight = chain.weights(solution) if chain.field else np.zeros(len(chain.nodes))
    rotation, state = solution.rotation.copy(), solution.state.copy()
    state[:, 3:6] += 1e-3  # away from the optimum, so that there is a step to compare
    shifted = solution._replace(rotation=rotation, state=state)
    matrix, right, columns = dense(chain, rotation, state, weight)
    step = np.zeros(len(columns))
    step[columns] = np.linalg.lstsq(matrix, right, rcond=None)[0]
    information = matrix.T @ matrix
    cov = np.zeros((len(columns), len(columns)))
    cov[np.ix_(columns, columns)] = np.linalg.inv(information)
    found = chain.solve(shifted, weight=weight)
    move(rotation, state, step[:-STATIC].reshape(-1, MOVING), step[-STATIC:])
    np.testing.assert_allclose(found.rotation, rotation, atol=1e-9)
    np.testing.assert_allclose(found.state, state, atol=1e-9)
    for k in (0, 1, len(chain.nodes) // 2, len(chain.nodes)):
        block = cov[k * MOVING : k * MOVING + 6, k * MOVING : k * MOVING + 6]
        np.testing.assert_allclose(found.cov[k], block, rtol=1e-5, atol=1e-8 * np.abs(block).max())


def test_the_last_state_is_the_filter_s(chain, solution):
    again = chain.solve(solution, weight=chain.weights(solution) if chain.field else None)
    np.testing.assert_allclose(again.cov[-1], again.filtered[-1, :6, :6], rtol=1e-9)


def test_hindsight_never_knows_less(chain, solution):
    gain = solution.filtered[:, :6, :6] - solution.cov
    scale = np.sqrt(np.einsum("kii->ki", solution.filtered[:, :6, :6]))
    scaled = gain / scale[:, :, None] / scale[:, None, :]
    assert np.linalg.eigvalsh(scaled).min() > -1e-8
    assert np.linalg.eigvalsh(solution.cov).min() > 0


def test_rows_are_differences_of_the_model(chain, solution):
    weight = np.ones(len(chain.nodes))
    rotation, state = solution.rotation.copy(), solution.state.copy()
    before, here, static, _ = rows(chain, rotation, state, weight)
    rng = np.random.default_rng(0)
    scale = np.concatenate([np.full(3, 1e-4), np.full(3, 1e-4), np.full(3, 1e-3), [1e-3]])
    deviation = scale * rng.normal(size=(len(state), MOVING))
    constants = 1e-4 * rng.normal(size=STATIC)
    sides = []
    for sign in (1.0, -1.0):
        r, x = rotation.copy(), state.copy()
        move(r, x, sign * deviation, sign * constants)
        sides.append(rows(chain, r, x, weight)[3])
    predicted = np.einsum("krm,km->kr", here, deviation) + static @ constants
    predicted[1:] += np.einsum("krm,km->kr", before[1:], deviation[:-1])
    actual = 0.5 * (sides[1] - sides[0])
    # the turn left over between nodes is small, so its logarithm is taken to be linear
    np.testing.assert_allclose(actual, predicted, atol=2e-3 * np.abs(predicted).max(axis=0).max())


def test_passes_settle(chain):
    some = AttitudeSmoother(iterations=3).solve(chain, chain.solve(covariance=False))
    many = AttitudeSmoother(iterations=6).solve(chain, chain.solve(covariance=False))
    np.testing.assert_allclose(some.rotation, many.rotation, atol=1e-4)
