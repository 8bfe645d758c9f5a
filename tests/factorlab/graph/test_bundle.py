"""Bundle adjustment: GTSAM's factors, our compiled Jacobians and COLMAP's Ceres find one minimum."""

import gtsam
import numpy as np
import pytest
from bundle_worlds import CAMERAS, bundle_world, disturbed, seen_from
from gtsam.symbol_shorthand import K, L, X

from factorlab.graph.bundle import bundle_adjust
from factorlab.graph.bundle_native import native_bundle
from sequential.errors import DataError, ModelError, UnderConstrainedError
from vision3d.sfm import Reconstruction
from vision3d.sfm.bal import read_bal
from vision3d.sfm.bundle_problem import bundle_problem
from vision3d.sfm.bundler import read_bundler
from vision3d.sfm.growing import grow
from vision3d.sfm.losses import LOSSES, loss_of
from vision3d.sfm.seeding import verified_pairs

NATIVE = [
    ("pinhole", False), ("pinhole", True), ("pinhole", ("fx", "fy", "cx", "cy")),
    ("brown1", False), ("brown1", True), ("brown2", False), ("brown2", True), ("brown2", ("f",)),
    ("brown2", ("fx", "fy", "k1", "cx", "cy")),
    ("brown4", False), ("brown4", True), ("fisheye4", False), ("fisheye4", True),
]  # fmt: skip
"""Lenses, and what is free, for which GTSAM has factors."""
COMPILED = [("brown5", True), ("rational8", False), ("thin12", False), ("pinhole", ("f", "cx", "cy"))]


@pytest.mark.parametrize(("lens", "refine"), NATIVE)
def test_both_routes_find_the_same_minimum(lens, refine, rng):
    begin = disturbed(bundle_world(rng, lens=lens, views=5, points=60), rng, share=0.3)
    native, compiled = (
        bundle_adjust(begin, refine_intrinsics=refine, route=route, covariances=False)
        for route in ("native", "compiled")
    )
    assert (native.route, compiled.route) == ("native", "compiled")
    assert native.converged
    assert compiled.converged
    assert native.cost == pytest.approx(compiled.cost, rel=1e-8)
    assert native.initial_cost == pytest.approx(compiled.initial_cost, rel=1e-12)
    for name in ("cameras_T_world", "points"):
        np.testing.assert_allclose(
            getattr(native.reconstruction, name), getattr(compiled.reconstruction, name), rtol=1e-4, atol=1e-4
        )


@pytest.mark.parametrize(("lens", "refine"), NATIVE)
def test_a_native_graph_has_our_cost(lens, refine, rng):
    problem, state = bundle_problem(disturbed(bundle_world(rng, lens=lens, views=4), rng), refine=refine)
    for loss in ("none", "huber", "cauchy"):
        native = native_bundle(problem, state, loss=loss, loss_px=0.7)
        squares = np.sum(problem.residuals(state) ** 2, axis=1)
        ours = 0.5 * loss_of(loss, squares, 0.7)[0].sum()
        assert native.graph.error(native.values) == pytest.approx(ours, rel=1e-9)


@pytest.mark.parametrize(("lens", "refine"), COMPILED)
def test_what_gtsam_lacks_goes_the_compiled_way(lens, refine, rng):
    begin = disturbed(bundle_world(rng, lens=lens), rng, share=0.3)
    assert bundle_adjust(begin, refine_intrinsics=refine, covariances=False).route == "compiled"
    with pytest.raises(ModelError, match=r"no factor.*route='auto'"):
        bundle_adjust(begin, refine_intrinsics=refine, route="native")


def test_covariances_are_gtsams_marginals(rng):
    begin = disturbed(bundle_world(rng, views=4, points=40), rng, share=0.3)
    result = bundle_adjust(begin, sigma_px=1.0)
    problem, state = bundle_problem(result.reconstruction)
    native = native_bundle(problem, state)
    # the weights of the gauge's two priors do not touch what does not depend on the gauge
    marginals = gtsam.Marginals(native.graph, native.values)
    np.testing.assert_allclose(marginals.marginalCovariance(K(0)), result.intrinsics_covs[0], rtol=1e-6)
    graph = gtsam.NonlinearFactorGraph()
    for at in range(native.graph.size()):
        factor = native.graph.at(at)
        if len(factor.keys()) == 3:
            graph.add(factor)
    tight = 1e-6
    graph.add(
        gtsam.PriorFactorPose3(X(0), native.values.atPose3(X(0)), gtsam.noiseModel.Isotropic.Sigma(6, tight))
    )
    last = int(
        np.argmax(np.linalg.norm(result.reconstruction.centres - result.reconstruction.centres[0], axis=1))
    )
    distance = native.values.atPose3(X(0)).range(native.values.atPose3(X(last)))
    graph.add(gtsam.RangeFactorPose3(X(0), X(last), distance, gtsam.noiseModel.Isotropic.Sigma(1, tight)))
    marginals = gtsam.Marginals(graph, native.values)
    for i in range(1, 4):
        told = marginals.marginalCovariance(X(i))
        np.testing.assert_allclose(result.centre_covs[i], told, rtol=1e-3, atol=1e-5 * np.abs(told).max())
    for j in (0, 7, 31):
        told = marginals.marginalCovariance(L(j))
        np.testing.assert_allclose(result.point_covs[j], told, rtol=1e-3, atol=1e-5 * np.abs(told).max())


@pytest.mark.parametrize("loss", LOSSES)
def test_a_robust_loss_survives_outliers(loss, rng):
    truth = bundle_world(rng, views=6, points=150, sigma_px=0.3)
    pixels = np.array(truth.pixels)
    bad = rng.random(len(pixels)) < 0.08
    pixels[bad] += rng.uniform(-60, 60, (bad.sum(), 2))
    found = bundle_adjust(truth.replaced(pixels=pixels), loss=loss, covariances=False)
    far = abs(found.reconstruction.cameras[0].intrinsics[0] - 520.0)
    assert found.converged
    # soft_l1 weighs an outlier by the inverse of its size, cauchy by that of its square
    assert far > {"none": 6.0}.get(loss, 0.0)
    assert far < {"none": 200.0, "cauchy": 3.0}.get(loss, 10.0)


def test_images_of_several_cameras_have_intrinsics_of_their_own(rng):
    truth = bundle_world(rng, views=8, points=150, cameras=2)
    found = bundle_adjust(disturbed(truth, rng, share=0.3))
    for camera, known, cov in zip(
        found.reconstruction.cameras, truth.cameras, found.intrinsics_covs, strict=True
    ):
        off = np.delete(camera.parameters - known.parameters, [1, 2, 3])
        assert off @ np.linalg.solve(cov, off) < 25.0


def test_the_gauge_of_the_result_is_the_starts(rng):
    begin = disturbed(bundle_world(rng), rng)
    for route in ("native", "compiled"):
        found = bundle_adjust(begin, route=route, covariances=False).reconstruction
        np.testing.assert_allclose(found.cameras_T_world[0], begin.cameras_T_world[0], atol=1e-12)
        far = int(np.argmax(np.linalg.norm(begin.centres - begin.centres[0], axis=1)))
        apart = [np.linalg.norm(one.centres[far] - one.centres[0]) for one in (begin, found)]
        assert apart[1] == pytest.approx(apart[0], rel=1e-9)


@pytest.mark.parametrize("route", ["native", "compiled"])
def test_fixed_poses_stay(route, rng):
    truth = bundle_world(rng)
    begin = disturbed(truth, rng, share=0.3)
    poses = np.array(begin.cameras_T_world)
    poses[[1, 4]] = truth.cameras_T_world[[1, 4]]
    found = bundle_adjust(begin.replaced(cameras_T_world=poses), fixed=(1, 4), route=route)
    np.testing.assert_array_equal(found.reconstruction.cameras_T_world[[1, 4]], poses[[1, 4]])
    assert (found.pose_covs[[1, 4]] == 0.0).all()
    assert (np.diagonal(found.pose_covs[2]) > 0.0).all()
    assert found.converged


def test_what_cannot_be_adjusted_is_refused(rng):
    empty = Reconstruction(
        (), (), [], np.zeros((0, 7)), np.zeros((0, 3)), np.zeros((0, 3)), [], [], np.zeros((0, 2))
    )
    with pytest.raises(DataError, match="needs images"):
        bundle_adjust(empty)
    truth = bundle_world(rng)
    with pytest.raises(ModelError, match="route is one of auto, native, compiled"):
        bundle_adjust(truth, route="ceres")
    two = bundle_world(rng, views=2, points=7)
    with pytest.raises(UnderConstrainedError, match="of camera 0 free"):
        bundle_adjust(two, refine_intrinsics=("fx", "fy", "cx", "cy", "k1", "k2"))


def test_a_solve_that_is_stopped_says_so(rng):
    begin = disturbed(bundle_world(rng), rng)
    stopped = bundle_adjust(begin, route="compiled", max_iterations=1, covariances=False)
    assert not stopped.converged
    assert "one more step would take off" in stopped.message


def test_results_are_read_only(rng):
    found = bundle_adjust(bundle_world(rng))
    with pytest.raises(ValueError, match="read-only"):
        found.point_covs[0] = 0.0
    assert CAMERAS["brown2"].intrinsics[0] != found.reconstruction.cameras[0].intrinsics[0]


def test_dubrovnik(data_dir):
    for name, cost in (("dubrovnik-3-7-pre", 2.3199139921), ("dubrovnik-3-7-18-pre", 0.1021038232)):
        problem = read_bal(data_dir / "vision" / "balbianello" / f"{name}.txt")
        for route in ("native", "compiled"):
            found = bundle_adjust(problem, refine_intrinsics=False, route=route)
            assert found.cost == pytest.approx(cost, rel=1e-8)
        # 38 equations do not fix 41 unknowns
        with pytest.raises(UnderConstrainedError, match=r"of camera [0-2] free"):
            bundle_adjust(problem)


@pytest.mark.parametrize(
    ("loss", "cost"),
    [(None, 125.169594054), ("soft_l1", 70.282517278), ("cauchy", 49.218663574), ("huber", 77.673464083)],
)
def test_balbianello_ends_where_colmap_ends(loss, cost, data_dir):
    model = read_bundler(data_dir / "vision" / "balbianello" / "Balbianello.out", size=(640, 427))
    found = bundle_adjust(model, loss=loss)
    assert found.route == "native"
    # COLMAP 4.2.1's final cost from this file, one camera for every image
    assert found.cost == pytest.approx(cost, rel=1e-6)
    assert (np.linalg.eigvalsh(found.point_covs) > 0.0).all()


def test_our_mapper_grows_on_gtsam(rng):
    world = bundle_world(rng, views=4, points=80, sigma_px=0.3)
    scene, matches = seen_from(world, rng, calibrate=True)
    routes = []

    def by_gtsam(model, refine):
        result = bundle_adjust(model, refine_intrinsics=refine, loss="huber", covariances=False)
        routes.append(result.route)
        return result.reconstruction

    found = grow(scene, verified_pairs(scene, matches), adjust=by_gtsam)
    assert found.names == world.names
    assert set(routes) == {"native"}
    assert found.rms_px < 0.6
    assert found.cameras[0].intrinsics[0] == pytest.approx(520.0, rel=0.02)


def test_a_camera_without_images_stays(rng):
    truth = bundle_world(rng)
    spare = CAMERAS["brown4"]
    found = bundle_adjust(truth.replaced(cameras=(*truth.cameras, spare)))
    assert found.reconstruction.cameras[1] == spare
    assert found.free[1] == ()
    assert found.intrinsics_covs[1].shape == (0, 0)
    assert found.cost == pytest.approx(bundle_adjust(truth).cost, rel=1e-9)


@pytest.mark.parametrize("route", ["native", "compiled"])
def test_points_alone_may_move(route, rng):
    truth = bundle_world(rng, views=4, points=40)
    points = truth.points + 0.02 * rng.standard_normal(truth.points.shape)
    found = bundle_adjust(
        truth.replaced(points=points), fixed=range(4), refine_intrinsics=False, route=route, sigma_px=0.5
    )
    np.testing.assert_array_equal(found.reconstruction.cameras_T_world, truth.cameras_T_world)
    off = found.reconstruction.points - truth.points
    nees = np.einsum("nx,nxy,ny->n", off, np.linalg.inv(found.point_covs), off) / 3.0
    assert 0.6 < nees.mean() < 1.5
