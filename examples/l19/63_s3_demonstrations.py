"""S3. La fiche des démonstrations : lue, affichée, et refaite en calcul formel.

Le texte est dans `fiches/s3_demonstrations.md`.  Ici, SymPy dérive, intègre et simplifie à la place du
crayon : ce qui est égal l'est pour toutes les valeurs, et non pour un tirage.  Il faut SymPy
(`pip install sympy`).
"""

from pathlib import Path

import numpy as np
import sympy as sp
from claims import claim
from figures import BLUE, GREEN, ORANGE, panels, save, say

from factorlab.l19.sheets import as_text, read_sheet, verified

SHEET = Path(__file__).parent / "fiches" / "s3_demonstrations.md"
P, R = sp.symbols("P R", positive=True)


def gain():
    K = sp.symbols("K")
    variance = (1 - K) ** 2 * P + K**2 * R
    (best,) = sp.solve(sp.diff(variance, K), K)
    assert sp.simplify(best - P / (P + R)) == 0
    assert sp.simplify(sp.diff(variance, K, 2) - 2 * (P + R)) == 0
    assert sp.simplify(1 / variance.subs(K, best) - 1 / P - 1 / R) == 0
    return f"K = {best}, V = {sp.factor(variance.subs(K, best))}"


def matrices():
    """P, R et H à deux états et une mesure, toutes leurs lettres libres."""
    a, b, c, r, h, g = sp.symbols("a b c r h g", real=True)
    return sp.Matrix([[a, b], [b, c]]), sp.Matrix([[r]]), sp.Matrix([[h, g]])


def joseph(K, prior, noise, H):
    """Covariance après la correction d'un gain quelconque."""
    left = sp.eye(2) - K * H
    return left * prior * left.T + K * noise * K.T


def trace():
    prior, noise, H = matrices()
    k1, k2, d1, d2 = sp.symbols("k1 k2 d1 d2", real=True)
    any_gain, D = sp.Matrix([k1, k2]), sp.Matrix([d1, d2])
    S = H * prior * H.T + noise
    kalman = prior * H.T * S.inv()
    slope = [sp.diff(joseph(any_gain, prior, noise, H).trace(), k) for k in (k1, k2)]
    found = sp.solve(slope, [k1, k2], dict=True)[0]
    assert all(sp.simplify(found[k] - kalman[i]) == 0 for i, k in enumerate((k1, k2)))
    worse = (joseph(kalman + D, prior, noise, H) - joseph(kalman, prior, noise, H)).trace()
    assert sp.simplify(worse - (D * S * D.T).trace()) == 0
    return "gradient nul pour K = P Hᵀ S⁻¹ seulement ; un écart D coûte tr(D S Dᵀ), exactement"


def shrinks():
    prior, noise, H = matrices()
    S = H * prior * H.T + noise
    kalman = prior * H.T * S.inv()
    short = (sp.eye(2) - kalman * H) * prior
    assert sp.simplify(joseph(kalman, prior, noise, H) - short) == sp.zeros(2)
    assert sp.simplify(prior - short - kalman * S * kalman.T) == sp.zeros(2)
    after = P * R / (P + R)
    assert sp.simplify(P - after - P**2 / (P + R)) == 0
    assert sp.simplify(R - after - R**2 / (P + R)) == 0
    return f"P - P⁺ = K S Kᵀ ; à une dimension P - P⁺ = {sp.factor(P - after)}"


def twice():
    b, t, s, q = sp.symbols("b t s q", positive=True)
    speed = sp.integrate(b, (s, 0, t))
    position = sp.integrate(speed.subs(t, s), (s, 0, t))
    variance = sp.integrate((t - s) ** 2 * q, (s, 0, t))
    assert sp.simplify(position - b * t**2 / 2) == 0
    assert sp.simplify(variance - q * t**3 / 3) == 0
    assert sp.limit(sp.sqrt(variance) / position, t, sp.oo) == 0
    return f"position {position}, variance du bruit {variance} ; à la longue le biais l'emporte"


def projection():
    X, Y, Z, k, B = sp.symbols("X Y Z lambda B", positive=True)
    fx, fy, cx, cy = sp.symbols("fx fy cx cy", positive=True)

    def seen(x, y, z):
        return sp.Matrix([fx * x / z + cx, fy * y / z + cy])

    assert sp.simplify(seen(k * X, k * Y, k * Z) - seen(X, Y, Z)) == sp.zeros(2, 1)
    one = seen(X, Y, Z).jacobian([X, Y, Z])
    assert sp.simplify(one * sp.Matrix([X, Y, Z])) == sp.zeros(2, 1)
    both = sp.Matrix.vstack(one, seen(X - B, Y, Z).jacobian([X, Y, Z]))
    assert (one.rank(), both.rank()) == (2, 3)
    return "λ s'en va ; rang 2 avec une vue (le rayon est le noyau), rang 3 avec deux"


CHECKS = {
    "Le gain à une dimension": gain,
    "Le gain qui minimise la trace": trace,
    "La variance diminue toujours": shrinks,
    "Un biais intégré deux fois": twice,
    "La projection perd la profondeur": projection,
}


def main():
    sheet = read_sheet(SHEET)
    found = verified(sheet, CHECKS)
    say(as_text(sheet, found))
    claim("S3", "démonstrations refaites en calcul formel", len(found), low=5, high=5)
    paths = integrated_noise(np.random.default_rng(63))
    ratio = paths[:, -1].std() / np.sqrt(60.0**3 / 3)
    claim(
        "S3",
        "bruit intégré deux fois pendant 60 s, simulé sur q t³/3 (écarts-types)",
        ratio,
        low=0.9,
        high=1.1,
    )
    draw(paths)


def integrated_noise(rng, dt=0.1, seconds=60, runs=1000):
    """Positions (runs, N) d'une accélération de bruit blanc, q = 1 m²/s³."""
    accelerations = rng.standard_normal((runs, round(seconds / dt))) / np.sqrt(dt)
    return np.cumsum(np.cumsum(accelerations, axis=1) * dt, axis=1) * dt


def draw(paths):
    """Quatre démonstrations, chacune en une courbe."""
    figure, (a, b, c, d) = panels(
        1, 4, size=(16.0, 4.0), title="S3. Quatre démonstrations en une image chacune"
    )
    K = np.linspace(0, 1, 200)
    for r, colour in ((0.5, BLUE), (1.0, GREEN), (4.0, ORANGE)):
        a.plot(K, (1 - K) ** 2 + K**2 * r, color=colour, label=f"P = 1, R = {r:g}")
        a.plot(1 / (1 + r), r / (1 + r), "o", color=colour)
    a.set(title="V(K) est minimale en P/(P + R)", xlabel="gain K", ylabel="variance", ylim=(0, 2.4))
    turn = np.linspace(0, 2 * np.pi, 100)
    prior, H = np.array([[2.0, 0.8], [0.8, 1.0]]), np.array([[1.0, 0.4]])
    for noise, colour in ((None, "black"), (2.0, ORANGE), (0.2, GREEN)):
        cov = prior if noise is None else prior - prior @ H.T @ H @ prior / (H @ prior @ H.T + noise)
        label = "avant" if noise is None else f"après, R = {noise:g}"
        b.plot(*(np.linalg.cholesky(cov) @ [np.cos(turn), np.sin(turn)]), color=colour, label=label)
    b.set(
        title="Après une mesure, l'ellipse rentre", xlabel="x₁", ylabel="x₂", aspect="equal", ylim=(-1.6, 2.4)
    )
    t = 0.1 * np.arange(1, 601)
    c.plot(t, paths[:40].T, color="#b0b0b0", linewidth=0.6)
    c.plot(t, np.sqrt(t**3 / 3), color=BLUE, label="bruit : √(q t³/3)")
    c.plot(t, -np.sqrt(t**3 / 3), color=BLUE)
    c.plot(t, 0.5 * 0.3 * t**2, color=ORANGE, label="biais : ½ b t²")
    c.set(
        title="Accélération intégrée deux fois", xlabel="temps (s)", ylabel="position (m)", ylim=(-650, 750)
    )
    rays = np.array([0.3, -0.15])
    for x in rays:
        d.plot([0, 4 * x], [0, 4], color="#9a9a9a", linewidth=1.0)
    for z, colour in ((1.5, GREEN), (3.0, ORANGE)):
        d.plot(rays * z, [z, z], "o-", color=colour, label=f"objet à {z:g} m")
    d.plot(rays, [1, 1], color=BLUE, linewidth=3, label="leur image commune")
    d.set(title="Deux objets, une image", xlabel="X (m)", ylabel="Z (m)", xlim=(-1.5, 2.2))
    for axes, place in ((a, "upper center"), (b, "upper left"), (c, "upper left"), (d, "lower right")):
        axes.legend(loc=place)
    save(figure)


if __name__ == "__main__":
    main()
