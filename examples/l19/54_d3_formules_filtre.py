"""D3 (★★★), suite. Chaque formule de docs/derivations.fr.md, vérifiée : fusion, gain, covariances, NIS, RTS.

Une démonstration se lit ; une vérification s'exécute.  SymPy montre l'identité pour des lettres quelconques
quand il le peut (état à deux composantes, une mesure) ; ailleurs, des nombres au hasard ou un Monte-Carlo.
Le script s'arrête si une formule de ces sections n'a pas sa vérification, ou l'inverse.  Il lui faut SymPy
(`pip install sympy`).

À voir sur la figure : la variance de la fusion est une parabole en K, et son minimum est le gain de Kalman ;
le NIS suit un χ² quand R est juste, et pas quand il est trop petit ; le lisseur RTS retrouve les moindres
carrés, avec une incertitude plus petite que celle du filtre.
"""

from pathlib import Path

import numpy as np
import sympy as sp
from scipy.stats import chi2

from factorlab.l19.formulas import Checks, read_formulas

PAGE = Path(__file__).resolve().parents[2] / "docs" / "derivations.fr.md"
LAST = "rts"  # les formules suivantes sont dans 55_d3_formules_capteurs.py
checks = Checks()

a, b, K, x, x1, x2, rho, sigma = sp.symbols("a b K x x1 x2 rho sigma", positive=True)
P = sp.Matrix(2, 2, sp.symbols("p11 p12 p12 p22"))  # symétrique, quelconque
H, R = sp.Matrix([sp.symbols("h1 h2")]), sp.Matrix([[sp.symbols("r", positive=True)]])
G, D = sp.Matrix(sp.symbols("k1 k2")), sp.Matrix(sp.symbols("d1 d2"))  # un gain et un écart quelconques
S = H * P * H.T + R
BEST = P * H.T * S.inv()


def zero(expression):
    """Vrai si l'expression, ou chaque terme de la matrice, est nulle pour toutes les lettres."""
    terms = expression if isinstance(expression, sp.MatrixBase) else [expression]
    assert all(sp.simplify(term) == 0 for term in terms), f"{expression} n'est pas nul"


def joseph(gain):
    left = sp.eye(2) - gain * H
    return left * P * left.T + gain * R * gain.T


@checks("fusion-variance", "correlated-mean")
def variance_of_a_combination():
    cov = sp.Matrix([[a, 0], [0, b]])
    weights = sp.Matrix([1 - K, K])
    zero((weights.T * cov * weights)[0] - ((1 - K) ** 2 * a + K**2 * b))
    alike = sigma**2 * sp.Matrix([[1, rho], [rho, 1]])
    half = sp.Matrix([1, 1]) / 2
    zero((half.T * alike * half)[0] - sigma**2 * (1 + rho) / 2)
    return "SymPy"


@checks("fusion-gain", "fusion-precision", "fusion-shrinks", "gain-limits")
def best_combination():
    variance = (1 - K) ** 2 * a + K**2 * b
    (found,) = sp.solve(sp.diff(variance, K), K)
    zero(found - a / (a + b))
    least = variance.subs(K, found)
    zero(1 / least - (1 / a + 1 / b))
    zero(least - (1 - found) * a)
    assert sp.simplify(a - least).is_positive
    assert sp.simplify(b - least).is_positive
    assert sp.limit(found, b, sp.oo) == 0
    assert sp.limit(found, a, sp.oo) == 1
    return "SymPy"


@checks("fusion-bayes")
def product_of_two_gaussians():
    mean, p = (b * x1 + a * x2) / (a + b), a * b / (a + b)
    exponent = -((x - x1) ** 2) / (2 * a) - (x - x2) ** 2 / (2 * b) + (x - mean) ** 2 / (2 * p)
    zero(sp.diff(exponent, x))  # leur rapport ne dépend pas de x
    return "SymPy"


@checks("predict", "joseph", "innovation-covariance")
def linear_maps_of_independent_errors():
    e, v, w = sp.Matrix(sp.symbols("e1 e2")), sp.Matrix([sp.symbols("v")]), sp.Matrix(sp.symbols("w1 w2"))
    F, Q = sp.Matrix(2, 2, sp.symbols("f11 f12 f21 f22")), sp.Matrix(2, 2, sp.symbols("q11 q12 q12 q22"))
    blocks = sp.diag(P, R, Q)  # indépendants : aucun terme croisé
    for error, expected in (
        ((sp.eye(2) - G * H) * e - G * v, joseph(G)),
        (H * e + v, S),
        (F * e + w, F * P * F.T + Q),
    ):
        jacobian = error.jacobian([*e, *v, *w])
        zero(jacobian * blocks * jacobian.T - expected)
    return "SymPy"


@checks("trace", "trace-gradient", "gain", "excess")
def the_gain_minimises_the_trace():
    trace = joseph(G).trace()
    zero(trace - (P.trace() - 2 * (G * H * P).trace() + (G * S * G.T).trace()))
    gradient = sp.Matrix([sp.diff(trace, k) for k in G])
    zero(gradient - (-2 * P * H.T + 2 * G * S))
    zero(gradient.subs(dict(zip(G, BEST, strict=True))))
    zero(joseph(BEST + D).trace() - joseph(BEST).trace() - (D * S * D.T).trace())
    return "SymPy"


@checks("short-form", "shrinks", "information", "information-gain")
def forms_of_the_covariance():
    after = joseph(BEST)
    zero(after - (sp.eye(2) - BEST * H) * P)
    zero(after - (P - BEST * S * BEST.T))
    zero(after * (P.inv() + H.T * R.inv() * H) - sp.eye(2))
    zero(BEST - after * H.T * R.inv())
    rng = np.random.default_rng(0)
    for _ in range(200):  # K S Kᵀ n'a que des valeurs propres positives, à quatre états et deux mesures aussi
        root, h = rng.standard_normal((4, 4)), rng.standard_normal((2, 4))
        p, s = root @ root.T, h @ root @ root.T @ h.T + np.eye(2)
        gain = p @ h.T @ np.linalg.inv(s)
        assert np.linalg.eigvalsh(gain @ s @ gain.T).min() > -1e-9
    return "SymPy et 200 tirages"


def innovations(count=20_000, m=2):
    """Innovations de covariance s, et s."""
    rng = np.random.default_rng(3)
    root = rng.standard_normal((m, m)) + 2 * np.eye(m)
    return rng.standard_normal((count, m)) @ root.T, root @ root.T


@checks("nis", "mahalanobis", "nis-wrong")
def expectation_of_the_nis():
    nu, s = innovations()
    nis = np.einsum("ki,ki->k", nu, np.linalg.solve(s, nu.T).T)
    white = np.linalg.solve(np.linalg.cholesky(s), nu.T)
    np.testing.assert_allclose(nis, np.sum(white**2, axis=0), rtol=1e-9)
    assert abs(nis.mean() - 2.0) < 4 * np.sqrt(4.0 / len(nis)), "m en moyenne (variance 2 m)"
    assert abs(np.mean(nis < chi2.ppf(0.9, 2)) - 0.9) < 0.01, "et c'est un χ²"
    wrong = np.einsum("ki,ki->k", nu, np.linalg.solve(s / 10, nu.T).T)
    np.testing.assert_allclose(wrong, 10 * nis, rtol=1e-12)
    return "20 000 tirages"


def smoothed(count=30, q=0.1, r=0.5):
    """Moyennes et covariances, écrites à la main : du filtre, du lisseur RTS, des moindres carrés en bloc."""
    rng, F, h = np.random.default_rng(4), np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q = q * np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]])
    z = np.cumsum(rng.standard_normal(count))
    mean, cov, ahead = [], [], []
    m, c = np.zeros(2), 10 * np.eye(2)
    information, vector = np.zeros((2 * count, 2 * count)), np.zeros(2 * count)
    information[:2, :2] = np.linalg.inv(c)
    for k in range(count):
        if k:
            m, c = F @ m, F @ c @ F.T + Q
            J = np.zeros((2, 2 * count))
            J[:, 2 * k - 2 : 2 * k], J[:, 2 * k : 2 * k + 2] = -F, np.eye(2)
            information += J.T @ np.linalg.solve(Q, J)
        ahead.append((m, c))
        gain = c @ h.T / (h @ c @ h.T + r)
        m, c = m + gain[:, 0] * (z[k] - m[0]), c - gain @ h @ c
        information[2 * k, 2 * k] += 1 / r
        vector[2 * k] += z[k] / r
        mean.append(m)
        cov.append(c)
    back = [(mean[-1], cov[-1])]
    for k in range(count - 2, -1, -1):
        (s, cs), (p, cp) = back[0], ahead[k + 1]
        g = cov[k] @ F.T @ np.linalg.inv(cp)
        back.insert(0, (mean[k] + g @ (s - p), cov[k] + g @ (cs - cp) @ g.T))
    whole = np.linalg.inv(information)
    blocks = whole.reshape(count, 2, count, 2)[np.arange(count), :, np.arange(count)]
    batch = (whole @ vector).reshape(count, 2), blocks
    return (np.array(mean), cov), tuple(map(np.array, zip(*back, strict=True))), batch


@checks("rts-gain", "rts")
def smoothing_is_least_squares():
    _, (mean, cov), (best, spread) = smoothed()
    np.testing.assert_allclose(mean, best, rtol=0, atol=1e-9)
    np.testing.assert_allclose(cov, spread, rtol=0, atol=1e-9)
    return "moindres carrés, 30 instants"


def main():
    from claims import claim

    names = list(read_formulas(PAGE))
    mine = names[: names.index(LAST) + 1]
    done = checks.run()
    for name in mine:
        print(f"  {name:24} {done[name]}")
    nu, s = innovations()
    nis = np.einsum("ki,ki->k", nu, np.linalg.solve(s, nu.T).T)
    (_, filtered), (mean, cov), (best, _) = smoothed()
    draw(nis, filtered, cov)
    claim("D3", "formules de fusion, de gain et de lissage vérifiées", len(done), low=23, high=23)
    claim("D3", "NIS moyen pour deux composantes", nis.mean(), low=1.94, high=2.06)
    claim("D3", "écart du lisseur RTS aux moindres carrés", np.abs(mean - best).max(), high=1e-9)
    assert sorted(done) == sorted(mine), "chaque formule a sa vérification, et l'inverse"


def draw(nis, filtered, cov):
    from figures import BLUE, GREEN, ORANGE, panels, save

    figure, (one, two, three) = panels(1, 3, size=(13.5, 4.0), title="D3. Trois démonstrations en images")
    gains, variances = np.linspace(0, 1, 101), (4.0, 1.0)
    one.plot(gains, (1 - gains) ** 2 * variances[0] + gains**2 * variances[1], color=BLUE)
    one.plot(0.8, 0.8, "o", color=ORANGE, label="K = a / (a + b)")
    one.axhline(1.0, color="black", linewidth=0.8, linestyle="--", label="la meilleure mesure seule (b = 1)")
    one.set(title="Fusion de variances 4 et 1", xlabel="gain K (sans unité)", ylabel="variance")
    grid = np.linspace(0.01, 14, 200)
    two.hist(nis, bins=60, range=(0, 14), density=True, color="#c9d9e8", label="NIS, S juste")
    two.plot(grid, chi2.pdf(grid, 2), color=BLUE, label="χ² à 2 degrés de liberté")
    two.plot(grid, chi2.pdf(grid / 10, 2) / 10, color=ORANGE, label="S déclarée 10 fois trop petite")
    two.set(title="Le NIS dit si S est juste", xlabel="NIS (sans unité)", ylabel="densité")
    three.plot([np.sqrt(c[0, 0]) for c in filtered], color=ORANGE, label="filtre")
    three.plot(np.sqrt(cov[:, 0, 0]), color=GREEN, label="lisseur RTS")
    three.set(title="Connaître la suite rend plus sûr", xlabel="instant k", ylabel="σ de position (m)",
              ylim=(0, None))  # fmt: skip
    for axes in (one, two, three):
        axes.legend()
    save(figure)


if __name__ == "__main__":
    main()
