"""The attitude smoother as a graph: the answer of the chain's own solver, at a cost linear in length."""

import time

import numpy as np
import pytest
from attitude_worlds import seen, swinging

from factorlab.graph.attitude import AttitudeGraph, LinearAttitudeGraph
from sequential.attitude import AttitudeModel, AttitudeSmoother, attitude_from_angles
from sequential.attitude.smoother_cut import attitude_chain


def recording(seconds):
    t, angles = swinging(seconds)
    return seen(t, attitude_from_angles(angles), bias=(0.02, -0.01, 0.0), rng=np.random.default_rng(11))


@pytest.fixture(scope="module")
def piece():
    return recording(20.0)


@pytest.mark.parametrize("magnetometer", [True, False])
@pytest.mark.parametrize("iterations", [1, 3])
def test_graph_and_chain_agree(piece, magnetometer, iterations):
    chain = AttitudeSmoother(iterations=iterations, magnetometer=magnetometer).estimate(piece)
    graph = AttitudeGraph(iterations=iterations, magnetometer=magnetometer).estimate(piece)
    np.testing.assert_allclose(graph.world_q_body, chain.world_q_body, atol=1e-9)
    np.testing.assert_allclose(graph.gyro_bias, chain.gyro_bias, atol=1e-10)
    np.testing.assert_allclose(graph.cov, chain.cov, rtol=1e-2, atol=1e-3 * np.abs(chain.cov).max())


def test_covariances_are_gtsam_s_marginals(piece):
    chain = attitude_chain(piece, AttitudeModel())
    solution = AttitudeSmoother(iterations=3).solve(chain, chain.solve(covariance=False))
    weight = chain.weights(solution)
    own, graph = chain.solve(solution, weight=weight), LinearAttitudeGraph(chain, solution, weight)
    for k in (0, len(chain.nodes) // 3, len(chain.nodes)):
        marginal = graph.marginals(k)
        np.testing.assert_allclose(own.cov[k], marginal, atol=1e-6 * np.abs(marginal).max())


def test_the_cost_is_linear_in_the_length():
    seconds = {}
    for length in (40.0, 160.0):
        chain = attitude_chain(recording(length), AttitudeModel(interval=0.1))
        start = chain.solve(covariance=False)
        AttitudeGraph(iterations=1).solve(chain, start)
        runs = []
        for _ in range(3):
            began = time.process_time()
            AttitudeGraph(iterations=1).solve(chain, start)
            runs.append(time.process_time() - began)
        seconds[length] = min(runs)
    # four times the nodes: quadratic cost would be sixteen times the time
    assert seconds[160.0] < 9.0 * seconds[40.0]
