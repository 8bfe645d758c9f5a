"""Corners as native factors on inverse marker poses: the same cost and optimum as our own rows."""

from dataclasses import replace

import numpy as np
import pytest
from factor_family import BENT, FISHEYE, MOUNT, PINHOLE
from graph_slam_worlds import spread
from marker_graph_worlds import SIGMA_PX, wall

from factorlab.graph.slam import BatchSlam, IncrementalSlam
from factorlab.graph.slam.batch import native_graph
from factorlab.graph.slam.rows import Rows
from sequential.errors import ModelError
from sequential.manifold import SE3
from sequential.model import Loss
from sequential.slam import Factors
from sequential.slam.models import Between, Prior
from vision3d.camera import Camera


def index_of(problem):
    return {kind: problem.indices(kind) for kind in problem.kinds}


@pytest.mark.parametrize("camera", [PINHOLE, BENT, FISHEYE], ids=lambda camera: camera.lens)
def test_the_native_cost_is_ours(camera, rng):
    """Also with priors of several markers, whose error is turned round twice."""
    problem, _, marker = wall(rng, 3, 5, camera=camera)
    cov = np.diag(rng.uniform(0.5, 2.0, 6)) * 0.1**2
    more = Factors(Prior(SE3()), ("m",), [[1], [2]], marker[1:], cov)
    problem = replace(problem, factors=(*problem.factors, more))
    native, rows = native_graph(problem), Rows(problem, index_of(problem))
    for _ in range(10):
        values = spread(problem, problem.start, rng, 0.1)
        assert native.graph.error(native.insert(values)) == pytest.approx(rows.cost(values), rel=1e-9)


@pytest.mark.parametrize("camera", [PINHOLE, BENT, FISHEYE], ids=lambda camera: camera.lens)
def test_both_ways_end_in_one_place(camera, rng):
    problem, pose, marker = wall(rng, 4, 20, camera=camera)
    native = BatchSlam(route="native").solve(problem)
    batched = BatchSlam(route="batched").solve(problem)
    assert native.report.details["native"] == 1.0
    assert native.report.cost == pytest.approx(batched.report.cost, rel=1e-7)
    for kind, truth in (("x", pose), ("m", marker)):
        apart = SE3().local(native.values.rows[kind], batched.values.rows[kind])
        np.testing.assert_allclose(apart, 0.0, atol=1e-5)
        error = SE3().local(truth, native.values.rows[kind])
        assert np.abs(error).max() < 0.1


def test_the_batch_tells_how_well_markers_are_known(seeds):
    """NEES of markers over seeds, against the 99.9 % band of its mean."""
    nees = []
    for seed in list(seeds)[:20]:
        problem, _, marker = wall(np.random.default_rng(seed), 3, 8)
        run = BatchSlam().solve(problem)
        error = SE3().local(run.values.rows["m"], marker)[1:]
        nees.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(run.covs["m"][1:]), error).mean() / 6)
    assert 0.6 < np.mean(nees) < 1.5


def test_what_has_no_native_form_goes_the_batched_way(rng):
    plain = wall(rng, 2, 4)[0]
    mounted = wall(rng, 2, 4, mount=MOUNT)[0]
    rational = wall(rng, 2, 4, camera=Camera("brown5", (500, 500, 320, 240), (-0.1, 0.02, 0, 0, 0.001)))[0]
    prior, corners = plain.factors
    tied = corners.covs().copy()
    tied[:, 0, 7] = tied[:, 7, 0] = 0.2 * SIGMA_PX**2
    others = {
        "mount": mounted,
        "lens": rational,
        "loss": replace(plain, factors=(prior, replace(corners, loss=Loss("huber", 3.0)))),
        "correlated corners": replace(plain, factors=(prior, replace(corners, noise_cov=tied))),
        "marker beside marker": replace(
            plain,
            factors=(*plain.factors, Factors(Between(SE3()), ("m", "m"), [[0, 1]], prior.z, 0.1)),
        ),
    }
    assert native_graph(plain) is not None
    for name, problem in others.items():
        assert native_graph(problem) is None, name
        assert BatchSlam().solve(problem).report.converged
    with pytest.raises(ModelError, match="without a native GTSAM factor"):
        BatchSlam(route="native").solve(mounted)


def test_a_marker_is_begun_at_its_first_sighting(rng):
    """Large markers close by leave no doubt about which pose is meant."""
    problem, _, _ = wall(rng, 3, 10)
    model = replace(problem.factors[1].model, side_m=1.2)
    exact = model.expected(
        *(problem.start.rows[k][np.asarray(problem.factors[1].index)[:, n]] for n, k in enumerate("xm"))
    )
    corners = Factors(model, ("x", "m"), problem.factors[1].index, exact, SIGMA_PX**2)
    first = Factors(Prior(SE3()), ("m",), [[0]], problem.start.rows["m"][:1], 1e-8)
    unplaced = replace(problem, factors=(first, corners), start=None)
    for estimator in (BatchSlam(), IncrementalSlam()):
        run = estimator.solve(unplaced)
        for kind in "xm":
            apart = SE3().local(problem.start.rows[kind], run.values.rows[kind])
            np.testing.assert_allclose(apart, 0.0, atol=1e-5)
