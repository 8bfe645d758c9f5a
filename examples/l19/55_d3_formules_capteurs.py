"""D3 (★★★), fin. Les autres formules de docs/derivations.fr.md : points sigma, dérives, Allan, caméra.

Comme 54_d3_formules_filtre.py : SymPy où il le peut, des nombres ailleurs, et le script s'arrête si une
formule n'a pas sa vérification.

Pourquoi intégrer deux fois un accéléromètre est-il sans espoir à la longue ?  Un biais de 0,01 m/s² fait 18 m
en une minute, et rien ne ramène l'erreur (à gauche).  Pourquoi une caméra seule ne mesure-t-elle pas une
distance ?  Tous les points d'un rayon ont la même image : la jacobienne annule sa direction.
"""

from pathlib import Path

import numpy as np
import sympy as sp
from scipy.integrate import quad

from factorlab.l19.formulas import Checks, read_formulas
from sequential.discretise import van_loan
from sequential.sensors import allan_deviation

PAGE = Path(__file__).resolve().parents[2] / "docs" / "derivations.fr.md"
FIRST = "sigma-points"  # les précédentes sont dans 54_d3_formules_filtre.py
checks = Checks()
positive = {"positive": True}


def zero(expression):
    """Vrai si l'expression, ou chaque terme de la matrice, est nulle pour toutes les lettres."""
    terms = expression if isinstance(expression, sp.MatrixBase) else [expression]
    assert all(sp.simplify(term) == 0 for term in terms), f"{expression} n'est pas nul"


def symbolic_points():
    """Les cinq points sigma d'une gaussienne quelconque du plan, leurs poids, x, P et κ."""
    x, kappa = sp.Matrix(sp.symbols("x1 x2")), sp.Symbol("kappa", **positive)
    root = sp.Matrix([[sp.Symbol("l11", **positive), 0], sp.symbols("l21 l22")])  # triangulaire : de Cholesky
    P, spread = root * root.T, sp.sqrt(2 + kappa) * root
    columns = [spread[:, k] for k in range(2)]
    points = [x, *(x + c for c in columns), *(x - c for c in columns)]
    return points, [kappa / (2 + kappa)] + 4 * [1 / (2 * (2 + kappa))], x, P, kappa


@checks("sigma-points", "sigma-weights", "sigma-moments", "sigma-linear", "sigma-quadratic")
def sigma_points_have_the_moments():
    points, weights, x, P, kappa = symbolic_points()
    zero((points[1] - x) * (points[1] - x).T + (points[2] - x) * (points[2] - x).T - (2 + kappa) * P)
    zero(sum(weights) - 1)
    weighted = list(zip(weights, points, strict=True))
    zero(sum((w * p for w, p in weighted), sp.zeros(2, 1)) - x)
    zero(sum((w * (p - x) * (p - x).T for w, p in weighted), sp.zeros(2)) - P)
    A, M = (sp.Matrix(2, 2, sp.symbols(f"{n}11 {n}12 {n}21 {n}22")) for n in "am")
    zero(sum((w * A * p for w, p in weighted), sp.zeros(2, 1)) - A * x)
    zero(sum((w * A * (p - x) * (p - x).T * A.T for w, p in weighted), sp.zeros(2)) - A * P * A.T)
    zero(sum(w * (p.T * M * p)[0] for w, p in weighted) - ((x.T * M * x)[0] + (M * P).trace()))
    return "SymPy"


@checks("sigma-fourth", "circular-mean")
def fourth_moment_and_angles():
    kappa, P, xi = sp.Symbol("kappa", **positive), sp.Symbol("P", **positive), sp.Symbol("xi")
    zero(2 * ((1 + kappa) * P) ** 2 / (2 * (1 + kappa)) - (1 + kappa) * P**2)
    gaussian = sp.exp(-(xi**2) / (2 * P)) / sp.sqrt(2 * sp.pi * P)
    zero(sp.integrate(xi**4 * gaussian, (xi, -sp.oo, sp.oo)) - 3 * P**2)
    angles, weights = np.radians([359.0, 1.0, 0.0]), np.array([0.25, 0.25, 0.5])
    wrapped = (angles - angles[0] + np.pi) % (2 * np.pi) - np.pi
    assert abs(np.sin(angles[0] + weights @ wrapped)) < 1e-12, "0°, pas 180°"
    return "SymPy, et 0°"


@checks("bias-twice", "bias-spread", "walk")
def drifts():
    t, s, u, bias, q = sp.symbols("t s u b q", **positive)
    zero(sp.integrate(sp.integrate(bias, (u, 0, s)), (s, 0, t)) - bias * t**2 / 2)
    zero(sp.integrate(q, (u, 0, t)) - q * t)  # un bruit blanc ajoute q du à chaque instant u,
    zero(sp.integrate((t - u) ** 2 * q, (u, 0, t)) - q * t**3 / 3)  # qui déplace de t - u à l'instant t
    assert abs(walk_spread() - 1.0) < 0.05, "Monte-Carlo de 4000 marches"
    return "SymPy et 4000 tirages"


def walk_spread(walks=4000, steps=200, step=0.05):
    """Écart-type de la position au bout de 10 s, q = 1, sur celui de la formule."""
    speed = np.random.default_rng(2).standard_normal((walks, steps)).cumsum(axis=1) * np.sqrt(step)
    return np.std(speed.sum(axis=1) * step) / np.sqrt((steps * step) ** 3 / 3)


@checks("q-constant-velocity", "q-two-steps")
def noise_of_a_step():
    tau, step, q = sp.symbols("tau Delta q", **positive)
    arrived = sp.Matrix([tau, 1])
    Q = (arrived * q * arrived.T).applyfunc(lambda term: sp.integrate(term, (tau, 0, step)))
    zero(Q - q * sp.Matrix([[step**3 / 3, step**2 / 2], [step**2 / 2, step]]))
    F = sp.Matrix([[1, step], [0, 1]])
    zero(Q.subs(step, 2 * step) - (F * Q * F.T + Q))
    found = np.array(Q.subs({step: 0.3, q: 0.7}), dtype=float)
    theirs = van_loan(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), 0.7, 0.3)[1]
    np.testing.assert_allclose(theirs, found, rtol=1e-12)
    return "SymPy, et la bibliothèque"


@checks("allan", "allan-white", "allan-walk", "allan-flicker", "allan-best")
def slopes_of_allan():
    N, B, tau = sp.symbols("N B tau", **positive)
    (best,) = sp.solve(sp.diff(N**2 / tau + B**2 * tau / 3, tau), tau)
    zero(best - sp.sqrt(3) * N / B)
    s = sp.Symbol("s", **positive)  # y(k+1) - y(k) est la marche vue par un triangle de base 2 τ
    triangle = sp.integrate((s / tau) ** 2, (s, 0, tau)) + sp.integrate((2 - s / tau) ** 2, (s, tau, 2 * tau))
    zero(B**2 * triangle / 2 - B**2 * tau / 3)
    zero((N**2 / tau + N**2 / tau) / 2 - N**2 / tau)  # deux moyennes indépendantes de variance N²/τ
    assert abs(flicker_floor() ** 2 - 2 * np.log(2) / np.pi) < 1e-6
    noise = allan_noise()
    own = [0.5 * np.mean(np.diff(noise.reshape(-1, m).mean(axis=1)) ** 2) for m in (1, 10)]
    assert abs(own[0] / own[1] / 10 - 1.0) < 0.1, "la définition même, sur un bruit blanc"
    return "SymPy, intégrale, tirage"


def flicker_floor(end=400.0):
    """Palier d'Allan d'un bruit en 1/f de b = 1, par l'intégrale (sin⁴ vaut 3/8 en moyenne à la fin)."""
    near = quad(lambda u: np.sin(u) ** 4 / u**3, 0, end, limit=2000)[0]  # u = π f τ
    return np.sqrt(2 / np.pi * (near + 3 / 8 / (2 * end**2)))


@checks("pinhole", "depth-lost", "depth-null", "stereo")
def projection():
    X, Y = sp.symbols("X Y")
    Z, f, cx, cy, scale, base, d = sp.symbols("Z f c_x c_y lambda B d", **positive)
    point = sp.Matrix([X, Y, Z])
    seen = sp.Matrix([f * X / Z + cx, f * Y / Z + cy])
    camera = sp.Matrix([[f, 0, cx], [0, f, cy], [0, 0, 1]]) * point
    zero(sp.Matrix([camera[0] / camera[2], camera[1] / camera[2]]) - seen)
    larger = dict(zip(point, scale * point, strict=True))
    zero(seen.subs(larger, simultaneous=True) - seen)
    zero(seen.jacobian(point) * point)
    zero(f * X / Z - f * (X - base) / Z - f * base / Z)  # la disparité de deux caméras distantes de B
    zero(sp.Abs(sp.diff(f * base / d, d)) - (Z**2 / (f * base)).subs(Z, f * base / d))
    return "SymPy"


@checks("low-pass", "low-pass-noise", "low-pass-lag", "infrared")
def simple_filters():
    a, step, slope, v, behind = sp.symbols("a Delta s v e", **positive)
    tau = -step / sp.log(1 - a)
    zero(sp.series(tau * a / step, a, 0, 2).removeO() - (1 - a / 2))
    zero(sp.solve(sp.Eq(v, (1 - a) ** 2 * v + a**2), v)[0] - a / (2 - a))
    zero(sp.solve(sp.Eq(behind, (1 - a) * (behind + slope * step)), behind)[0] - slope * step * (1 - a) / a)
    c, d, b, near = sp.symbols("c d b sigma_v", **positive)
    slope_of_v = sp.Abs(sp.diff(a / (d + b) + c, d))
    zero(near / slope_of_v - (d + b) ** 2 / a * near)
    return "SymPy"


def allan_noise(count=200_000):
    """Un bruit blanc de densité 1 à 1 Hz."""
    return np.random.default_rng(6).standard_normal(count)


def main():
    from claims import claim

    names = list(read_formulas(PAGE))
    mine = names[names.index(FIRST) :]
    done = checks.run()
    for name in mine:
        print(f"  {name:24} {done[name]}")
    draw()
    claim("D3", "formules de points sigma, de dérives et de capteurs vérifiées", len(done), low=25, high=25)
    claim("D3", "palier d'Allan d'un bruit en 1/f, sur b", flicker_floor(), low=0.663, high=0.665)
    claim(
        "D3",
        "position de marches intégrées, écart-type mesuré sur √(q t³/3)",
        walk_spread(),
        low=0.95,
        high=1.05,
    )
    assert sorted(done) == sorted(mine), "chaque formule a sa vérification, et l'inverse"


def draw():
    from figures import BLUE, GREEN, ORANGE, panels, save

    figure, (one, two, three) = panels(1, 3, size=(13.5, 4.0), title="D3. Dérives, Allan, et une courbure")
    t = np.linspace(0, 60, 100)
    one.plot(t, 0.005 * t**2, color=ORANGE, label="biais de 0,01 m/s²")
    one.plot(t, np.sqrt(1e-4 * t**3 / 3), color=BLUE, label="bruit blanc de 0,01 m/s² par √Hz (σ)")
    one.set(title="Intégrer deux fois", xlabel="temps (s)", ylabel="erreur de position (m)")
    found = allan_deviation(allan_noise(), 1.0)
    two.loglog(found.tau, found.deviation, ".", color="#9a9a9a", label="bruit blanc simulé")
    tau = np.logspace(0, 4.5, 50)
    white, walk = 1 / np.sqrt(tau), 0.02 * np.sqrt(tau / 3)
    two.loglog(tau, white, color=BLUE, label="N/√τ : pente −1/2")
    two.loglog(tau, walk, color=GREEN, label="B√(τ/3) : pente +1/2")
    two.loglog(tau, np.hypot(white, walk), "--", color="black", linewidth=1.0, label="les deux ensemble")
    two.set(title="Écart-type d'Allan", xlabel="τ (s)", ylabel="σ(τ)", ylim=(2e-3, 40))
    x = np.linspace(-3, 3, 100)
    three.plot(x, x**2, color=BLUE, label="f(ξ) = ξ²")
    points = np.array([0.0, np.sqrt(3), -np.sqrt(3)])
    three.plot(points, points**2, "o", color=GREEN, label="points sigma (κ = 2)")
    three.axhline(1.0, color=GREEN, linestyle="--", label="leur moyenne : 1, exacte")
    three.axhline(0.0, color=ORANGE, linestyle="--", label="celle de l'EKF : f(0) = 0")
    three.set(title="ξ de moyenne 0, de variance 1", xlabel="ξ", ylabel="f(ξ)", ylim=(-0.8, 9))
    for axes in (one, two, three):
        axes.legend(loc="upper left" if axes is one else "upper center")
    save(figure)


if __name__ == "__main__":
    main()
