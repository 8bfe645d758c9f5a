"""Which exercises a file answers, read from its text alone."""

import pytest

from factorlab.l19.exercises.survey import survey


@pytest.fixture
def of(tmp_path):
    def read(text, **options):
        path = tmp_path / "copie.py"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return survey(path, **options)

    return read


@pytest.mark.parametrize(
    ("text", "exercises"),
    [
        ("class Kalman: pass", ("E1",)),
        ("def median_glissant(x, k): pass\ndef composantes(m): pass", ("E2", "E4")),
        ("nis_moyen = lambda kf, z, u: 1", ("E1",)),
        ("try:\n    import x\n    def ajuster(d, v): pass\nexcept ImportError:\n    pass", ("E3",)),
        ("def distance(a, b): pass", ()),
        ("if __name__ == '__main__':\n    def ajuster(d, v): pass", ()),
        ("from voisin import Kalman", ()),
        ("def replier(a): return a", ("K3",)),
        ("def innovation(z, prevu): pass", ("K3",)),
        ("def innovation(): pass\ndef wrap(): pass", ()),
        ("from textwrap import wrap", ()),
        ("class EKF:\n    def __init__(self, x0, P0): pass", ()),
        ("class EKF:\n    def __init__(self, F, B, H, Q, R, x0, P0): pass", ("K3",)),
        ("class KalmanAngle(Kalman):\n    def corriger(self, z): pass", ("K3",)),
        ("def points_sigma(x, P, kappa=1): pass", ("D3",)),
        ("class EKF: pass\nx = 1", ()),
    ],
)
def test_exercises_are_found_by_what_is_defined(of, text, exercises):
    assert of(text).exercises == exercises


def test_a_neighbour_s_name_completes_an_exercise(of):
    text = "from voisin import Kalman\ndef nis_moyen(kf, z, u): pass"
    assert of(text).missing("E1") == {}
    assert list(of(text, imported=False).missing("E1")) == ["Kalman"]


def test_what_may_have_been_meant(of):
    assert "`plus_gros_objets` : est-ce `plus_gros_objet`" in " ".join(
        of("def plus_gros_objets(m): 1").hints()
    )
    assert "renommez `KalmanFilter` en `Kalman`" in " ".join(of("class KalmanFilter: pass").hints())


@pytest.mark.parametrize(
    "text", ["def f(:\n    pass\n", "x = (1,\n", b"x = '\xff'\n", b"a\x00b", "\tx = 1\n y = 2\n"]
)
def test_what_is_no_python_has_a_fault(of, text):
    found = of(text)
    assert found.fault.kind == "syntaxe"
    assert found.exercises == ()
