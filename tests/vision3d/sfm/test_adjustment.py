"""The compiled bundle adjustment: Jacobians, losses, and the same minimum as a general solver."""

import numpy as np
import pytest
from bundle_worlds import CAMERAS, bundle_world, disturbed
from scipy.optimize import least_squares

from sequential.errors import ModelError, ShapeError, UnderConstrainedError
from vision3d.sfm.adjustment import adjust, cost_of
from vision3d.sfm.bundle_problem import bundle_problem
from vision3d.sfm.gauge import directions
from vision3d.sfm.intrinsics import free_basis, free_names
from vision3d.sfm.losses import LOSSES, loss_of
from vision3d.sfm.rank import check_seen, decrement_of


@pytest.mark.parametrize("lens", CAMERAS)
def test_jacobians_meet_differences(lens, rng):
    everything = ("fx", "fy", "cx", "cy", *CAMERAS[lens].names[4:])
    problem, state = bundle_problem(bundle_world(rng, views=3, points=25, lens=lens), refine=everything)
    linear, h = problem.linearize(state), 1e-6
    none, still = np.zeros(problem.size), np.zeros_like(state.points)
    for place in range(problem.size):
        step = none.copy()
        step[place] = h
        apart = problem.residuals(problem.moved(state, -step, still)) - problem.residuals(
            problem.moved(state, step, still)
        )
        told = np.zeros_like(apart)
        rows, parts = np.nonzero(problem.columns[problem.images] == place)
        told[rows] = linear.by_view[rows, :, parts]
        np.testing.assert_allclose(apart / (2 * h), told, atol=1e-6 * max(1.0, np.abs(told).max()))
    for axis in range(3):
        push = still.copy()
        push[:, axis] = h
        apart = problem.residuals(problem.moved(state, none, -push)) - problem.residuals(
            problem.moved(state, none, push)
        )
        np.testing.assert_allclose(apart / (2 * h), linear.by_point[:, :, axis], rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("loss", LOSSES)
def test_losses_meet_scipy_and_their_derivatives(loss):
    squares, h = np.array([0.0, 0.3, 1.9, 2.3, 7.0, 400.0]), 1e-6
    rho, weights = loss_of(loss, squares, 1.5)
    ahead, behind = (loss_of(loss, np.abs(squares + sign * h), 1.5)[0] for sign in (1, -1))
    np.testing.assert_allclose(weights[1:], ((ahead - behind) / (2 * h))[1:], rtol=1e-6)
    assert (rho[0], weights[0]) == (0.0, 1.0)
    # SciPy takes C² ρ(s / C²) of every scalar residual
    solved = least_squares(
        lambda x: np.sqrt(squares) + 0.0 * x, [0.0], loss={"none": "linear"}.get(loss, loss), f_scale=1.5
    )
    assert solved.cost == pytest.approx(0.5 * rho.sum(), rel=1e-12)


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("lens", ["brown2", "rational8"])
def test_a_general_solver_finds_nothing_better(loss, lens, rng):
    truth = bundle_world(rng, views=4, points=30, lens=lens)
    pixels = np.array(truth.pixels)
    pixels[::17] += rng.uniform(-20, 20, pixels[::17].shape)
    refine = ("f", "k1") if lens == "brown2" else False
    problem, start = bundle_problem(disturbed(truth.replaced(pixels=pixels), rng), refine=refine)
    solved = adjust(problem, start, loss=loss)
    assert solved.converged
    assert solved.cost < solved.initial_cost

    def whitened(x):
        moved = problem.moved(solved.state, x[: problem.size], x[problem.size :].reshape(-1, 3))
        squares = np.sum(problem.residuals(moved) ** 2, axis=1)
        return np.sqrt(loss_of(loss, squares, 1.0)[0])

    began = 0.5 * np.sum(whitened(np.zeros(problem.size + solved.state.points.size)) ** 2)
    assert began == pytest.approx(solved.cost, rel=1e-12)
    gradient = np.array([
        (np.sum(whitened(h * e) ** 2) - np.sum(whitened(-h * e) ** 2)) / (4 * h)
        for e in np.eye(problem.size + solved.state.points.size)[:: 7]
        for h in [1e-6]
    ])  # fmt: skip
    # a unit step of a pose is hundreds of pixels
    assert np.abs(gradient).max() < 1e-3 * problem.size
    cost, decrement = decrement_of(problem, solved.state, loss, 1.0)
    assert cost == pytest.approx(solved.cost, rel=1e-12)
    assert decrement < 1e-8 * cost


def test_exact_pixels_give_back_the_truth(rng):
    truth = bundle_world(rng, sigma_px=0.0)
    problem, start = bundle_problem(disturbed(truth, rng))
    solved = adjust(problem, start)
    assert solved.cost < 1e-15 * solved.initial_cost
    np.testing.assert_allclose(solved.state.parameters[0], truth.cameras[0].parameters, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("fixed", [(), (2,), (0, 3)])
def test_gauge_directions_leave_every_pixel_alone(fixed, rng):
    problem, state = bundle_problem(bundle_world(rng), fixed=fixed)
    free = directions(problem, state)
    assert free.count == {0: 7, 1: 1, 2: 0}[len(fixed)]
    linear = problem.linearize(state)
    for k in range(free.count):
        by_views = np.where(problem.columns >= 0, free.views[np.maximum(problem.columns, 0), k], 0.0)
        moved = np.einsum("krm,km->kr", linear.by_view, by_views[problem.images])
        moved += np.einsum("krx,kx->kr", linear.by_point, free.points[problem.tracks, :, k])
        np.testing.assert_allclose(moved, 0.0, atol=1e-9)


def test_points_behind_a_camera_are_brought_back_or_cost_much(rng):
    truth = bundle_world(rng)
    points = np.array(truth.points)
    points[3, 2] = -5.0
    problem, start = bundle_problem(truth.replaced(points=points), refine=False)
    cost, weights = cost_of(problem.residuals(start), "none", 1.0)
    assert cost > 1e7
    assert (weights[problem.tracks == 3] == 0.0).all()
    assert np.isfinite(adjust(problem, start).cost)


def test_what_is_free_is_named(rng):
    camera = CAMERAS["brown2"]
    assert free_names(camera, refine=True) == ("f", "k1", "k2")
    assert free_names(CAMERAS["brown4"], refine=True) == ("fx", "fy", "k1", "k2", "p1", "p2")
    assert free_names(camera, refine=False) == ()
    assert free_names(camera, ("k1", "fx", "p1")) == ("fx", "k1")
    np.testing.assert_array_equal(free_basis(camera, ("f",))[:, 0], [1, 1, 0, 0, 0, 0])
    for names, said in (("focal", "no camera has"), (("f", "fx"), "one focal length")):
        with pytest.raises(ModelError, match=said):
            free_names(camera, names)


def test_what_cannot_be_solved_is_refused(rng):
    truth = bundle_world(rng, views=4)
    lonely = truth.replaced(
        image_index=truth.image_index[:-1], point_index=truth.point_index[:-1], pixels=truth.pixels[:-1]
    )
    once = lonely.replaced(
        points=np.vstack([truth.points, [0, 0, 5]]), colors=np.vstack([truth.colors, [0, 0, 0]])
    )
    with pytest.raises(
        UnderConstrainedError, match=rf"point {len(truth.points)}, seen by 0 images.*two images"
    ):
        check_seen(bundle_problem(once)[0])
    few = truth.selected((truth.image_index != 2) | (truth.point_index < 2))
    with pytest.raises(UnderConstrainedError, match=r"image 2 \(02.png\) sees 2 points"):
        check_seen(bundle_problem(few)[0])
    with pytest.raises(ShapeError, match="fixed names image 9, but there are 4"):
        bundle_problem(truth, fixed=(9,))
    problem, start = bundle_problem(truth)
    for wrong, said in ((("tukey", 1.0), "no loss 'tukey'"), (("huber", 0.0), "positive number of pixels")):
        with pytest.raises(ModelError, match=said):
            adjust(problem, start, loss=wrong[0], loss_px=wrong[1])
