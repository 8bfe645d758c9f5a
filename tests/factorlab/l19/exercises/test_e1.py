# ruff: noqa: ARG005 - what a system offers is not all that each wrong filter reads
"""E1: right filters of several tastes pass, wrong ones are called by the name of their mistake."""

import numpy as np
import pytest
from kalman_copies import COLUMNS, PLAIN, RIGHT, WRONG

from factorlab.l19.exercises.kalman_mutants import PREDICTED_COV, PREDICTED_STATE, Update, updates
from factorlab.l19.exercises.kalman_systems import SYSTEMS, ReferenceKalman, constant_velocity


@pytest.mark.parametrize("solution", RIGHT.values(), ids=RIGHT)
def test_a_right_solution_passes(checked, solution):
    done = checked(solution)
    assert done.verdict != "FAIL", done
    assert {"converge", "nis", "nis_moyen", "arguments"} <= {f.check for f in done.of("PASS")}


@pytest.mark.parametrize(("cause", "changes"), WRONG.items(), ids=WRONG)
def test_a_wrong_solution_is_called_by_name(changed, cause, changes):
    done = changed(PLAIN, *changes)
    assert done.verdict == "FAIL", done
    assert cause in done.causes, done
    assert all(finding.mend for finding in done.of("FAIL") if finding.cause)


def test_what_is_right_is_told_beside_what_is_wrong(changed):
    done = changed(PLAIN, ("nu = z - H @ self.x", "nu = H @ self.x - z"))
    assert {"predire.x", "predire.P", "corriger.P", "nis_moyen"} <= {f.check for f in done.of("PASS")}
    (finding,) = done.of("FAIL")
    assert (finding.expected, finding.got) == ("kf.x = [3, 3.2]", "kf.x = [1, 2.8]")


def test_the_example_can_be_typed_again(changed, tmp_path, monkeypatch):
    done = changed(PLAIN, ("nu = z - H @ self.x", "nu = H @ self.x - z"))
    monkeypatch.syspath_prepend(tmp_path)
    typed = {}
    exec(done.of("FAIL")[0].example, typed)  # noqa: S102 - what a student would type
    assert typed["kf"].x == pytest.approx([1, 2.8])


def test_a_fault_shows_their_line(changed):
    done = changed(PLAIN, ("K = self.P @ H.T", "K = self.Pp @ H.T"))
    (finding,) = [f for f in done.of("FAIL") if f.line]
    assert "AttributeError" in finding.said
    assert finding.code == "K = self.Pp @ H.T @ np.linalg.inv(S)"
    assert finding.line == 1 + PLAIN.splitlines().index("        K = self.P @ H.T @ np.linalg.inv(S)")


@pytest.mark.parametrize(
    ("before", "after", "word"),
    [
        ("def predire(self, u=None)", "def predict(self, u=None)", "renommez `predict` en `predire`"),
        ("def corriger(self, z)", "def corrige(self, z)", "`corrige` : est-ce `corriger`"),
        ("def corriger(self, z)", "def corriger(self, z, t)", "(self, z, t) au lieu de (self, z)"),
        ("def __init__(self, F, B, H,", "def __init__(self, F, H,", "au lieu de"),
        ("def nis_moyen(", "def nis_moyenne(", "est-ce `nis_moyen`"),
        ("class Kalman:", "class kalman:", "est-ce `Kalman`"),
        ("self.x, self.P = x0, P0", "self.x, self.P = x0, np.zeros((1, 1))", "aucun attribut"),
    ],
)
def test_names_and_arguments(changed, before, after, word):
    done = changed(PLAIN, (before, after))
    assert any(word in f.said for f in done.of("FAIL")), done


def test_remarks_are_no_failures(checked):
    done = checked(COLUMNS)
    (finding,) = [f for f in done.of("WARN") if f.check == "corriger.rendu"]
    assert "√S" in finding.said


def test_noise_and_endings_do_not_matter(checked):
    tail = "\nprint('fini')\nimport sys\nsys.exit(0)\n"
    done = checked("print('bonjour')\n" + PLAIN + tail)
    assert done.verdict != "FAIL", done
    assert done.file.stopped.kind == "SystemExit"
    assert done.file.printed.split() == ["bonjour", "fini"]


def test_a_loop_in_corriger_is_ended(changed):
    done = changed(
        PLAIN, ("        H, R = self.H, self.R", "        H, R = self.H, self.R\n        while True: pass")
    )
    assert any("boucle sans fin" in f.said for f in done.of("FAIL")), done


def test_wrong_filters_differ_from_the_right_one():
    def somewhere(differ):
        for s in SYSTEMS:
            P, u, z = s.P0, s.commands[0], s.measurements[0]
            try:
                if differ(s, s.x0, P, u, z):
                    return True
            except (ValueError, np.linalg.LinAlgError):
                continue
        return False

    for wrong in PREDICTED_STATE.values():
        assert somewhere(lambda s, x, P, u, z, f=wrong: not np.allclose(f(s, x, u), s.F @ x + s.B @ u))
    for wrong in PREDICTED_COV.values():
        assert somewhere(lambda s, x, P, u, z, f=wrong: not np.allclose(f(s, P), s.F @ P @ s.F.T + s.Q))

    def corrected(s, x, P, u, z, f):
        return not all(np.allclose(a, b) for a, b in zip(f(s, x, P, z), Update(())(s, x, P, z), strict=True))

    for wrong in updates():
        if len(wrong.causes) == 1:
            assert somewhere(lambda *a, f=wrong: corrected(*a, f)), wrong.causes


def test_the_reference_is_honest():
    system = constant_velocity(4000, np.random.default_rng(1))
    kf, nis = ReferenceKalman(system), []
    for u, z in zip(system.commands, system.measurements, strict=True):
        kf.predire(u)
        nis.append(kf.corriger(z))
    assert np.mean(nis) == pytest.approx(1.0, abs=0.08)


def test_a_mean_that_squares_is_right_for_a_filter_that_does_not(changed):
    done = changed(
        COLUMNS, ("innovation = z - np.dot(self.H, self.x)", "innovation = np.dot(self.H, self.x) - z")
    )
    assert done.causes == {"signe de l'innovation"}, done
    assert "nis_moyen" in {f.check for f in done.of("PASS")}


def test_one_command_times_b_is_enough_for_the_statement(changed):
    done = changed(COLUMNS, ("np.dot(self.B, u).reshape(-1, 1)", "self.B * u"))
    assert done.verdict == "WARN", done
    assert any("produit élément par élément" in f.said for f in done.of("WARN"))


def test_a_file_that_stops_before_the_class_says_so(checked):
    done = checked("n = int(input('combien ? '))\n" + PLAIN)
    assert done.file.stopped.kind == "EOFError"
    assert all("pas encore défini" in f.said for f in done.of("FAIL"))


@pytest.mark.parametrize("name", ["etoile", "scalar"])
def test_stars_instead_of_products_are_called_by_name(checked, name):
    text = (
        PLAIN.replace(" @ ", " * ") if name == "etoile" else PLAIN.replace(" @ ", " * ").replace("F.T", "F")
    )
    assert any(cause.startswith("produit élément par élément") for cause in checked(text).causes)
