"""The names that the course prescribes, on whatever a checker may hand them."""

import importlib.util
import inspect
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

COURSE = Path(__file__).resolve().parents[2] / "examples" / "l19"


def load(name):
    """Import a file of the course by its path, without its folder on the path."""
    spec = importlib.util.spec_from_file_location(f"l19_{name}", COURSE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


PRESCRIBED = {
    "31_e1_kalman": ("Kalman.predire", "Kalman.corriger", "nis_moyen"),
    "32_e2_median_et_sauts": ("median_glissant", "detecter_sauts"),
    "33_e3_capteur_ir": ("ajuster", "distance", "incertitude_distance"),
    "34_e4_composantes": ("composantes", "plus_gros_objet"),
    "52_d2_suiveur": ("image_sol",),
    "53_d3_demontrer_et_ukf": ("points_sigma",),
}
PARAMETERS = {
    "Kalman": ("F", "B", "H", "Q", "R", "x0", "P0"),
    "Kalman.predire": ("self", "u"),
    "Kalman.corriger": ("self", "z"),
    "nis_moyen": ("kf", "mesures", "commandes"),
    "median_glissant": ("x", "k"),
    "detecter_sauts": ("x", "k", "seuil"),
    "ajuster": ("d", "v"),
    "distance": ("v",),
    "incertitude_distance": ("v",),
    "composantes": ("masque",),
    "plus_gros_objet": ("masque", "aire_min"),
    "image_sol": ("pose", "ligne"),
    "points_sigma": ("x", "P", "kappa"),
}
OPEN = {"distance", "incertitude_distance", "image_sol"}  # the statement leaves open what follows


@pytest.mark.parametrize(
    ("file", "name"), [(file, name) for file, names in PRESCRIBED.items() for name in names]
)
def test_prescribed_names_take_what_is_prescribed(file, name):
    found = attrgetter(name)(load(file))
    parameters = tuple(inspect.signature(found).parameters)
    asked = PARAMETERS[name]
    assert parameters[: len(asked)] == asked
    assert len(parameters) == len(asked) or name in OPEN


@pytest.fixture(scope="module")
def e1():
    return load("31_e1_kalman")


@pytest.fixture(scope="module")
def e2():
    return load("32_e2_median_et_sauts")


@pytest.fixture(scope="module")
def d3():
    return load("53_d3_demontrer_et_ukf")


def textbook(F, B, H, Q, R, x, P, mesures, commandes):
    nis = []
    for z, u in zip(mesures, commandes, strict=True):
        x, P = F @ x + B @ u, F @ P @ F.T + Q
        S = H @ P @ H.T + R
        residual = z - H @ x
        K = P @ H.T @ np.linalg.inv(S)
        x, P = x + K @ residual, (np.eye(len(x)) - K @ H) @ P
        nis.append(residual @ np.linalg.solve(S, residual))
    return x, P, nis


@pytest.mark.parametrize("measured", [1, 2])
def test_kalman_is_the_textbook_s(e1, measured, rng):
    F, B = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]])
    H, Q, R = np.eye(2)[:measured], np.diag([0.01, 0.1]), 0.3 * np.eye(measured)
    x0, P0 = np.array([1.0, -1.0]), np.diag([2.0, 3.0])
    mesures, commandes = rng.standard_normal((30, measured)), rng.standard_normal((30, 1))
    x, P, nis = textbook(F, B, H, Q, R, x0, P0, mesures, commandes)
    kf = e1.Kalman(F, B, H, Q, R, x0, P0)
    ours = []
    for z, u in zip(mesures, commandes, strict=True):
        kf.predire(u)
        ours.append(kf.corriger(z))
    np.testing.assert_allclose(kf.x, x, rtol=1e-10)
    np.testing.assert_allclose(kf.P, P, rtol=1e-10)
    np.testing.assert_allclose(ours, nis, rtol=1e-10)
    mean = e1.nis_moyen(e1.Kalman(F, B, H, Q, R, x0, P0), mesures, commandes)
    assert mean == pytest.approx(np.mean(nis) / measured, rel=1e-10)


def test_a_scalar_filter_without_control(e1):
    kf = e1.Kalman([[1.0]], None, [[1.0]], [[0.0]], [[1.0]], [0.0], [[1.0]])
    kf.predire()
    assert kf.corriger(2.0) == pytest.approx(2.0)  # 2² / (1 + 1)
    assert kf.x == pytest.approx([1.0])
    assert pytest.approx(np.array([[0.5]])) == kf.P
    assert e1.nis_moyen(kf, [1.0, 1.0, 1.0]) == pytest.approx(0.0)


def test_columns_and_no_command(e1, rng):
    F, B, H = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]]), np.array([[1.0, 0.0]])
    filters = [
        e1.Kalman(F, B, H, 0.1 * np.eye(2), 0.3, x0, np.eye(2)) for x0 in (np.ones(2), np.ones((2, 1)))
    ]
    for z in rng.standard_normal(5):
        filters[0].predire()
        filters[1].predire(np.zeros((1, 1)))
        assert filters[0].corriger(z) == filters[1].corriger(np.array([[z]]))
    np.testing.assert_array_equal(filters[0].x, filters[1].x)


def test_a_list_is_as_good_as_an_array(e2):
    assert e2.median_glissant([1, 9, 2, 3], 3).tolist() == [5.0, 2.0, 3.0, 2.5]
    assert e2.detecter_sauts([0, 0, 0, 5, 0, 0, 0], 5, 3.0).tolist() == [3]


def test_jumps_are_found_and_little_else(e2, rng):
    x = 0.2 * rng.standard_normal(3000)
    at = np.sort(rng.choice(3000, 30, replace=False))
    x[at] += 4.0
    found = e2.detecter_sauts(x, 21, 5.0)
    assert np.isin(at, found).all()
    assert len(found) - len(at) <= 5


def moving_medians(x, k):
    half = k // 2
    return np.array([np.median(x[max(0, i - half) : i + half + 1]) for i in range(len(x))])


@pytest.mark.parametrize("k", [1, 3, 5, 11, 25])
def test_medians_are_the_naive_ones(e2, k, rng):
    x = rng.standard_normal(60)
    inside = slice(k // 2, len(x) - k // 2)  # the edges are a convention
    np.testing.assert_array_equal(e2.median_glissant(x, k)[inside], moving_medians(x, k)[inside])


def test_an_outlier_does_not_move_the_median_and_readings_stay_as_they_were(e2, rng):
    x = rng.standard_normal(50)
    spoilt = x.copy()
    spoilt[20] = 1e6
    kept = spoilt.copy()
    assert np.abs(e2.median_glissant(spoilt, 9) - e2.median_glissant(x, 9)).max() < 3.0
    assert 20 in e2.detecter_sauts(spoilt, 9, 5.0)
    np.testing.assert_array_equal(spoilt, kept)


@pytest.fixture(scope="module")
def e3():
    return load("33_e3_capteur_ir")


def infrared(d, a=28.0, b=0.5, c=0.1):
    return a / (np.asarray(d) + b) + c


@pytest.mark.parametrize("kind", [list, np.array])
def test_an_exact_table_gives_its_curve(e3, kind):
    d = np.linspace(8.0, 80.0, 20)
    curve = e3.ajuster(kind(d), kind(infrared(d)))
    np.testing.assert_allclose([curve.a, curve.b, curve.c], [28.0, 0.5, 0.1], rtol=1e-6)
    np.testing.assert_allclose(e3.distance(infrared(d), curve), d, rtol=1e-7)
    assert e3.distance(float(infrared(25.0)), curve) == pytest.approx(25.0, rel=1e-7)
    assert np.isnan(e3.distance(0.05, curve))  # below c: no distance reads that


def test_the_sigma_of_a_distance_is_what_repeating_shows(e3, rng):
    d, sigma_v = np.repeat(np.linspace(8.0, 80.0, 20), 20), 0.02
    curve = e3.ajuster(d, infrared(d) + sigma_v * rng.standard_normal(len(d)))
    for place in (10.0, 60.0):
        found = e3.distance(infrared(place) + sigma_v * rng.standard_normal(4000), curve)
        told = e3.incertitude_distance(float(infrared(place)), curve)
        assert told == pytest.approx(found.std(), rel=0.15)
    near, far = (e3.incertitude_distance(float(infrared(place)), curve) for place in (10.0, 60.0))
    assert far / near == pytest.approx((60.5 / 10.5) ** 2, rel=0.15)  # sigma grows as (d + b)²


@pytest.mark.parametrize("kappa", [0.0, 1.0, -1.0])
def test_sigma_points_have_the_moments(d3, kappa, rng):
    root = rng.standard_normal((3, 3))
    x, P = rng.standard_normal(3), root @ root.T + np.eye(3)
    points, weights = d3.points_sigma(x, P, kappa)
    assert points.shape == (7, 3)
    assert weights.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(weights @ points, x, rtol=0, atol=1e-12)
    np.testing.assert_allclose((points - x).T @ np.diag(weights) @ (points - x), P, rtol=0, atol=1e-12)


def test_angles_are_averaged_on_the_circle(d3):
    weights = np.full(3, 1 / 3)
    assert np.degrees(d3.circular_mean(np.radians([179.0, -179.0, -177.0]), weights)) == pytest.approx(-179)
    assert d3.circular_mean(np.array([0.1, 0.2, 0.3]), weights) == pytest.approx(0.2)


@pytest.fixture(scope="module")
def e4():
    return load("34_e4_composantes")


@pytest.mark.parametrize("shape", [(1, 1), (1, 30), (30, 1), (25, 40)])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 1.0])
def test_components_are_the_naive_ones(e4, shape, share, rng):
    masque = rng.random(shape) < share
    ours, naive = e4.composantes(masque), e4.naive_components(masque)
    assert [area for area, _ in ours] == [area for area, _ in naive]
    np.testing.assert_allclose([c for _, c in ours], [c for _, c in naive], rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", [bool, np.uint8, float, int, list])
def test_any_kind_of_mask(e4, kind):
    rows = [[0, 255, 255], [0, 0, 255], [1, 0, 0]]
    masque = rows if kind is list else np.array(rows).astype(kind)
    assert e4.composantes(masque) == [(3, (5 / 3, 1 / 3)), (1, (0.0, 2.0))]
    assert e4.plus_gros_objet(masque, 3) == (5 / 3, 1 / 3)
    assert e4.plus_gros_objet(masque, 4) is None


def test_a_long_snake_is_one_piece(e4):
    masque = np.zeros((400, 401), bool)
    masque[::2] = True
    masque[1::4, -1] = masque[3::4, 0] = True  # to and fro over the whole image: no recursion survives it
    ((area, _),) = e4.composantes(masque)
    assert area == masque.sum()
