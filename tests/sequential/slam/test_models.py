"""Laws of every factor: Jacobians meet differences, a placed variable leaves no error, blind pixels wait."""

import numpy as np
import pytest
from factor_family import BENT, FACTORS, PINHOLE, in_view, markers_in_view

from sequential.errors import JacobianMismatchError, ModelError
from sequential.manifold import SE2, SE3, SO3, NavState, Vector
from sequential.slam import check_factor_model
from sequential.slam.models import Between, Displacement, MarkerCorners, Projection, StereoProjection

every_factor = pytest.mark.parametrize("member", FACTORS, ids=lambda member: member.name)


@every_factor
def test_jacobians_meet_differences(member, rng):
    z, values = member.draw(rng, 40)
    check_factor_model(member.model, z, *values)


@every_factor
def test_without_noise_there_is_no_error(member, rng):
    z, values = member.draw(rng, 40, noise=0.0)
    np.testing.assert_allclose(member.model.errors(z, *values), 0.0, atol=1e-9)


@every_factor
def test_the_error_is_in_the_chart_of_the_reading(member, rng):
    """``retract(z, e)`` is what is expected."""
    z, values = member.draw(rng, 20)
    model = member.model
    back = model.measured.retract(z, model.errors(z, *values))
    np.testing.assert_allclose(model.measured.local(back, model.expected(*values)), 0.0, atol=1e-9)


@every_factor
def test_rows_do_not_know_each_other(member, rng):
    z, values = member.draw(rng, 6)
    together = member.model.jacobians(z, *values)
    alone = member.model.jacobians(z[2:3], *(v[2:3] for v in values))
    for a, b in zip(together, alone, strict=True):
        np.testing.assert_allclose(a[2:3], b, rtol=1e-12, atol=1e-12)


@every_factor
def test_a_placed_variable_leaves_no_error(member, rng):
    z, values = member.draw(rng, 30, noise=0.0)
    for missing in member.places:
        known = [None if i == missing else v for i, v in enumerate(values)]
        full = list(values)
        full[missing] = member.model.place(missing, z, *known)
        np.testing.assert_allclose(member.model.errors(z, *full), 0.0, atol=1e-6)


@every_factor
def test_what_is_not_determined_is_refused(member, rng):
    z, values = member.draw(rng, 3)
    for missing in set(range(len(values))) - set(member.places):
        known = [None if i == missing else v for i, v in enumerate(values)]
        with pytest.raises(ModelError, match=f"variable number {missing}"):
            member.model.place(missing, z, *known)


def test_a_marker_is_placed_where_it_is(rng):
    """Not only without error: four corners of a large square fit one pose alone."""
    pose, marker = markers_in_view(rng, 60)
    model = MarkerCorners(BENT, 0.5)
    found = model.place(1, model.expected(pose, marker), pose, None)
    np.testing.assert_allclose(SE3().local(marker, found), 0.0, atol=1e-6)


@pytest.mark.parametrize("model", [Projection(PINHOLE), StereoProjection((500, 480, 320, 240), 0.1)])
def test_a_point_behind_the_camera_stays_out_of_the_way(model, rng):
    pose, point = in_view(rng, 4)
    behind = 2 * pose[:, 4:] - point
    z = np.zeros((4, model.measured.dim))
    assert np.all(model.errors(z, pose, behind) == 1000.0)
    for slope in model.jacobians(z, pose, behind):
        assert not slope.any()


def test_a_wrong_jacobian_is_named(rng):
    class Wrong(Displacement.__base__):
        manifolds = (Vector(2),)
        measured = Vector(2)

        def expected(self, *values):
            return 2.0 * values[0]

        def jacobians(self, z, *values):
            return (np.broadcast_to(np.eye(2), (len(z), 2, 2)),)

    with pytest.raises(JacobianMismatchError, match="Wrong by its variable 0"):
        check_factor_model(Wrong(), np.zeros((2, 2)), rng.standard_normal((2, 2)))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Between(NavState()), "Between is declared on"),
        (lambda: Displacement(SO3()), "read by a pose"),
        (lambda: Displacement(SE2(), (1.0, 2.0, 3.0)), "2 numbers, got 3"),
        (lambda: Projection(PINHOLE, (0.0,) * 7), "seven finite numbers"),
        (lambda: StereoProjection((1.0, 1.0, 0.0, 0.0), 0.0), "positive baseline"),
        (lambda: MarkerCorners(PINHOLE, -1.0), "side of a marker"),
    ],
)
def test_a_declaration_that_cannot_be_is_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()
