"""P3. Troisième piège : deux capteurs corrélés, fusionnés comme s'ils étaient indépendants.

Deux thermomètres sur la même carte, chauffés par le même composant : une part c de leur erreur est
commune.  La covariance de leurs mesures n'est pas diagonale :

    z₁ = x + c + e₁        R = | σc² + σe²     σc²     |
    z₂ = x + c + e₂            |    σc²     σc² + σe²  |

Fusionner avec R diagonale fait croire que l'erreur commune se moyenne : la variance annoncée diminue comme
1/N avec N capteurs, alors que l'erreur vraie ne descend jamais sous σc².

Deux remèdes :
- on connaît la part commune : donner la covariance jointe R, termes croisés compris ;
- on ne la connaît pas : l'intersection de covariances, P⁻¹ = ω A⁻¹ + (1 - ω) B⁻¹, ω minimisant la trace.
  Elle ne ment pour aucune corrélation ; elle est prudente, c'est son prix.
"""

import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, PINK, panels, save, say

import sequential as sq

COMMON, OWN = 0.4, 0.3  # °C : écart-type de l'erreur commune, et de celle de chacun
TRIALS = 4000


def fuse(z, R):
    """La température et sa variance par un filtre de Kalman, de N mesures (N,) de covariance R (N, N)."""
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], 1e6),  # on ne savait rien avant
        sq.RandomWalk(0.0),
        {"thermometers": sq.LinearSensor(np.ones((len(z), 1)), R)},
    )
    online = sq.Online(sq.KalmanFilter(), model)
    belief, _ = online.update(online.start(), "thermometers", z)
    return belief.mean[0], belief.cov[0, 0]


def covariance_intersection(a, A, b, B):
    """Deux estimations (n,) d'un même x, de corrélation inconnue : la plus petite borne de ce genre, et ω."""
    omegas = np.linspace(0.0, 1.0, 101)
    inverse = [w * np.linalg.inv(A) + (1 - w) * np.linalg.inv(B) for w in omegas]
    best = np.argmin([np.trace(np.linalg.inv(one)) for one in inverse])
    P, w = np.linalg.inv(inverse[best]), omegas[best]
    return P @ (w * np.linalg.solve(A, a) + (1 - w) * np.linalg.solve(B, b)), P, w


def many_sensors(rng, counts):
    """Écart-type annoncé par les deux fusions, et vrai, selon le nombre de capteurs."""
    rows = []
    for n in counts:
        common, own = COMMON * rng.standard_normal((TRIALS, 1)), OWN * rng.standard_normal((TRIALS, n))
        z = 20.0 + common + own
        joint = COMMON**2 * np.ones((n, n)) + OWN**2 * np.eye(n)
        naive_x, naive_var = fuse(z[0], np.diag(np.diag(joint)))
        _, joint_var = fuse(z[0], joint)
        assert np.isclose(naive_x, z[0].mean(), atol=1e-3), "capteurs semblables : la fusion est leur moyenne"
        rows.append((np.sqrt(naive_var), np.sqrt(joint_var), np.std(z.mean(axis=1))))
    return np.array(rows).T


def two_positions(rng):
    """Deux GPS sur le même toit : une erreur commune (les satellites), une propre à chacun."""
    shared = np.array([[1.2, 0.3], [0.3, 0.8]])
    A, B = shared + np.diag([0.3, 2.0]), shared + np.diag([2.0, 0.3])
    common = rng.multivariate_normal(np.zeros(2), shared, TRIALS)
    a = common + rng.multivariate_normal(np.zeros(2), A - shared, TRIALS)
    b = common + rng.multivariate_normal(np.zeros(2), B - shared, TRIALS)
    naive_cov = np.linalg.inv(np.linalg.inv(A) + np.linalg.inv(B))
    naive = (a @ np.linalg.inv(A) + b @ np.linalg.inv(B)) @ naive_cov
    H, R = np.vstack([np.eye(2), np.eye(2)]), np.block([[A, shared], [shared, B]])
    joint_cov = np.linalg.inv(H.T @ np.linalg.solve(R, H))
    joint = np.hstack([a, b]) @ np.linalg.solve(R, H) @ joint_cov
    _, P, w = covariance_intersection(a[0], A, b[0], B)
    careful = (w * a @ np.linalg.inv(A) + (1 - w) * b @ np.linalg.inv(B)) @ P
    fused = {
        "indépendants": (naive, naive_cov),
        "covariance jointe": (joint, joint_cov),
        "intersection": (careful, P),
    }
    nees = {n: np.mean(np.einsum("ni,ij,nj->n", e, np.linalg.inv(C), e)) / 2 for n, (e, C) in fused.items()}
    return fused, nees


def ellipse(cov, radius=2.0):
    """Le contour à 2σ d'une covariance (2, 2)."""
    turn = np.linspace(0, 2 * np.pi, 100)
    return radius * np.linalg.cholesky(cov) @ np.array([np.cos(turn), np.sin(turn)])


def main():
    rng = np.random.default_rng(23)
    counts = np.array([1, 2, 4, 8, 16, 32])
    naive, joint, true = many_sensors(rng, counts)
    for n, *row in zip(counts, naive, joint, true, strict=True):
        say(
            "{:2d} capteurs : annoncé {:.3f} °C (indépendants), {:.3f} °C (jointe) ; vrai {:.3f} °C".format(
                n, *row
            )
        )
    fused, nees = two_positions(rng)
    told = ", ".join(f"{n} {v:.2f}" for n, v in nees.items())
    say(f"deux GPS, NEES par composante (1 attendu) : {told}")

    claim(
        "P3",
        "écart-type vrai sur annoncé, 8 capteurs, covariance jointe",
        true[3] / joint[3],
        low=0.95,
        high=1.05,
    )
    claim(
        "P3",
        "écart-type vrai sur annoncé, 8 capteurs crus indépendants",
        true[3] / naive[3],
        low=2.0,
        high=2.8,
    )
    claim("P3", "NEES par composante de deux GPS crus indépendants", nees["indépendants"], low=1.2)
    claim("P3", "NEES par composante, covariance jointe", nees["covariance jointe"], low=0.93, high=1.07)
    claim("P3", "NEES par composante, intersection de covariances", nees["intersection"], high=1.0)
    assert (true > 0.98 * COMMON).all(), "l'erreur commune ne se moyenne pas"
    np.testing.assert_allclose(joint, np.sqrt(COMMON**2 + OWN**2 / counts), rtol=1e-4)
    draw(counts, naive, joint, true, fused, nees)


def draw(counts, naive, joint, true, fused, nees):
    """L'écart-type selon N ; puis l'erreur de deux GPS, et ce que chaque fusion en annonce."""
    figure, (a, b, c) = panels(
        1, 3, size=(14.5, 4.4), title="P3. Deux capteurs corrélés ne valent pas deux capteurs"
    )
    a.loglog(counts, naive, "o-", color=ORANGE, label="annoncé, crus indépendants")
    a.loglog(counts, joint, "s-", color=GREEN, label="annoncé, covariance jointe")
    a.loglog(counts, true, "kx", markersize=8, label=f"vrai ({TRIALS} essais)")
    a.axhline(COMMON, color="black", linewidth=0.8, linestyle=":", label="part commune σc")
    a.set(title="N thermomètres de la même carte", xlabel="nombre de capteurs", ylabel="écart-type (°C)")
    a.set_xticks(counts, [str(n) for n in counts])
    a.set_yticks([0.1, 0.2, 0.3, 0.4, 0.5], ["0.1", "0.2", "0.3", "0.4", "0.5"])
    a.minorticks_off()
    colours = dict(zip(fused, (ORANGE, GREEN, BLUE), strict=True))
    b.plot(
        *fused["indépendants"][0][:600].T,
        ".",
        color="#b0b0b0",
        markersize=3,
        label="erreurs, crus indépendants",
    )
    for name, (_, cov) in fused.items():
        b.plot(*ellipse(cov), color=colours[name], label=f"2σ, {name}")
    b.set(title="Deux GPS sur le même toit", xlabel="erreur est (m)", ylabel="erreur nord (m)")
    b.set(xlim=(-6, 6), ylim=(-4, 6.5), aspect="equal")
    c.bar(list(nees), list(nees.values()), color=[colours[name] for name in nees], width=0.55)
    c.axhline(1.0, color=PINK, linewidth=1.2, label="attendu : 1")
    c.set(title="NEES par composante : > 1, trop sûr de lui", ylabel="NEES (sans unité)")
    for axes, place in ((a, "lower left"), (b, "upper left"), (c, "upper right")):
        axes.legend(loc=place, fontsize=8)
    save(figure)


if __name__ == "__main__":
    main()
