"""D3 (★★★). Démontrer la fusion et le gain, puis remplacer les jacobiennes par des points sigma.

1. Fusion en une dimension.  Deux mesures indépendantes du même x, variances a et b ; on cherche la
   combinaison sans biais x̂ = (1 - K) x₁ + K x₂ de variance minimale.  Var = (1 - K)² a + K² b ; dérivée
   nulle : K = a / (a + b), et Var = ab / (a + b), soit 1/Var = 1/a + 1/b.  C'est le gain de Kalman 1-D,
   sans même supposer de gaussienne.

2. Le gain K = P Hᵀ (H P Hᵀ + R)⁻¹ minimise la trace de la covariance après correction.  Pour un gain K
   quelconque, x̂ = x + K (z - H x) a pour covariance (forme de Joseph)
   P(K) = (I - K H) P (I - K H)ᵀ + K R Kᵀ.  En posant S = H P Hᵀ + R :
   tr P(K) = tr P - 2 tr(K H P) + tr(K S Kᵀ).  Son gradient selon K, -2 P Hᵀ + 2 K S, est nul pour
   K = P Hᵀ S⁻¹.  S est définie positive, donc c'est un minimum, et le seul :
   tr P(K + D) = tr P(K) + tr(D S Dᵀ) ≥ tr P(K), pour tout écart D.

3. UKF.  L'EKF remplace la fonction par sa tangente ; l'UKF garde la fonction et remplace la gaussienne
   par 2n + 1 points qui ont sa moyenne et sa covariance.  Les angles se moyennent sur le cercle.  Ici, sous
   fort bruit et après 15 s à l'aveugle, l'EKF se perd dans 10 à 30 % des essais selon le tirage, l'UKF dans
   0 à 5 % : bien mieux, mais pas infaillible.  Sous faible bruit ils font jeu égal (voir K3).

4. Kalman, 1960.  L'article paraît dans une revue de génie mécanique (ASME, Journal of Basic Engineering),
   et non d'électronique ; l'accueil fut d'abord sceptique, dit-on.  Il raisonnait en espace d'état et dans
   le temps, quand la théorie du filtrage (Wiener) se faisait en fréquence, et sa solution demandait un
   calculateur.  L'équipe de S. Schmidt, à la NASA Ames, l'adopta pour la navigation d'Apollo.
"""

from dataclasses import replace

import numpy as np

import sequential as sq

LANDMARKS_M = np.array([[0.0, 0.0], [25.0, 0.0], [0.0, 25.0]])
DT_S, BLIND_S, RUNS = 0.5, 15, 80
LOST_M = 3.0


def points_sigma(x, P, kappa):
    """Les points (2n + 1, n) de la gaussienne N(x, P), et leurs poids (2n + 1,) (Julier et Uhlmann)."""
    x, n = np.asarray(x, dtype=float), len(x)
    root = np.linalg.cholesky((n + kappa) * np.asarray(P))
    points = np.vstack([x, x + root.T, x - root.T])
    return points, np.append(kappa, np.full(2 * n, 0.5)) / (n + kappa)


def moyenne_circulaire(angles, poids):
    """Moyenne pondérée d'angles (rad), autour du premier : juste aussi pour un poids central négatif."""
    wrapped = np.angle(np.exp(1j * (angles - angles[0])))
    return np.angle(np.exp(1j * (angles[0] + poids @ wrapped)))


def corriger_ukf(x, P, observe, z, R, kappa):
    """Correction par points sigma d'une mesure scalaire z de variance R."""
    points, weights = points_sigma(x, P, kappa)
    seen = np.array([observe(p) for p in points])
    expected = weights @ seen
    S = weights @ (seen - expected) ** 2 + R
    K = (points - x).T @ (weights * (seen - expected)) / S
    return x + K * (z - expected), P - np.outer(K, K) * S


def robot(start=None):
    """Robot différentiel, fort bruit : cap initial à 40° près, relèvements à 29° près, distances à 5 cm."""
    return sq.StateSpace(
        manifold=sq.SE2(),
        prior=sq.Gaussian([2.0, 1.0, 0.5], np.array([0.2, 0.2, 0.7]) ** 2),
        process=sq.Unicycle(along=0.3, across=0.1, heading=0.3),
        sensors={"landmarks": sq.RangeBearing(LANDMARKS_M, np.array([0.05, 0.5]) ** 2)},
        input="wheels",
        start=start,
    )


def monte_carlo(rng):
    """Pire erreur de position (m) des 10 dernières secondes et NEES final, par filtre et par essai."""
    model, t = robot(start=0.0), np.arange(0, 45, DT_S)
    wheels = np.tile([1.0, 0.1], (len(t), 1))
    sights = np.arange(int(BLIND_S / DT_S), len(t), int(1 / DT_S))  # d'abord à l'aveugle
    which = (np.arange(len(sights)) % 3.0)[:, None]
    filters = sq.ExtendedKalmanFilter(), sq.UnscentedKalmanFilter()
    worst, nees = {f.name: [] for f in filters}, {f.name: [] for f in filters}
    for _ in range(RUNS):
        drive = sq.simulate(
            model, t, rng, inputs=wheels, readings={"landmarks": sights}, contexts={"landmarks": which}
        )
        for chosen in filters:
            run = sq.run(chosen, model, drive.log, at=t)
            off = np.hypot(*(run.mean - drive.truth)[t > 35, :2].T)
            error = model.manifold.local(run.mean[-1], drive.truth[-1])
            worst[chosen.name].append(off.max())
            nees[chosen.name].append(error @ np.linalg.solve(run.cov[-1], error))
    return {k: np.array(v) for k, v in worst.items()}, {k: np.array(v) for k, v in nees.items()}


def other_gains(rng):
    """Trace de P(K + D) moins celle du gain de Kalman K, et tr(D S Dᵀ), pour 1000 écarts D."""
    P, R, H = np.diag([4.0, 1.0]) + 0.5, np.array([[0.5]]), np.array([[1.0, 0.3]])
    S = H @ P @ H.T + R
    best = P @ H.T @ np.linalg.inv(S)

    def trace(K):
        joseph = (np.eye(2) - K @ H) @ P @ (np.eye(2) - K @ H).T + K @ R @ K.T
        return np.trace(joseph)

    steps = 0.3 * rng.standard_normal((1000, 2, 1))
    return np.array([trace(best + D) - trace(best) for D in steps]), np.einsum(
        "nij,jk,nik->n", steps, S, steps
    )


def check_sigma_points():
    """Les points ont la bonne moyenne et la bonne covariance ; la correction est celle de la bibliothèque."""
    x, P, beacon = np.array([3.0, 1.0]), np.array([[2.0, 0.5], [0.5, 1.0]]), np.zeros(2)
    points, weights = points_sigma(x, P, 1.0)
    np.testing.assert_allclose(weights @ points, x, rtol=1e-12)
    np.testing.assert_allclose((points - x).T @ np.diag(weights) @ (points - x), P, rtol=1e-12)
    mine = corriger_ukf(x, P, lambda p: np.hypot(*(p - beacon)), 3.5, 0.1, kappa=1.0)
    sensors = {"range": sq.Range([beacon], 0.1)}
    model = sq.StateSpace(sq.Vector(2), sq.Gaussian(x, P), sq.RandomWalk(0.0), sensors)
    log = sq.SensorLog({"range": sq.Stream([0.0], [3.5], context=[0.0])})
    theirs = sq.run(sq.UnscentedKalmanFilter(alpha=1.0, beta=0.0, kappa=1.0), model, log)
    np.testing.assert_allclose(theirs.mean[-1], mine[0], rtol=1e-10)
    np.testing.assert_allclose(theirs.cov[-1], mine[1], rtol=1e-10)
    # un poids central négatif : l'atan2 des sommes donnerait l'angle opposé
    angles, weights = np.radians([180.0, 150.0, -150.0, 160.0, -160.0]), np.array([-99.0] + 4 * [25.0])
    naive = np.arctan2(weights @ np.sin(angles), weights @ np.cos(angles))
    mean = moyenne_circulaire(angles, weights)
    print(f"moyenne d'angles autour de 180° : {np.degrees(mean):.0f}° ; par atan2 : {np.degrees(naive):.0f}°")
    assert np.isclose(abs(mean), np.pi)
    assert abs(naive) < 0.1


def main():
    from figures import BLUE, GREEN, ORANGE, panels, save

    rng = np.random.default_rng(1)

    excess, expected = other_gains(rng)
    check_sigma_points()
    worst, nees = monte_carlo(rng)
    lost = {name: np.mean(values > LOST_M) for name, values in worst.items()}
    for name, values in worst.items():
        print(f"{name} : perdu (plus de {LOST_M:.0f} m) {np.sum(values > LOST_M)} fois sur {RUNS} ; sinon "
              f"{np.median(values[values <= LOST_M]):.2f} m ; NEES médian {np.median(nees[name]):.1f} "
              "(2,4 attendu)")  # fmt: skip

    figure, (a, b, c) = panels(1, 3, size=(13.5, 4.3), title="D3. Le gain optimal, et l'UKF face à l'EKF")
    a.plot(expected, excess, ".", color=BLUE, markersize=4)
    a.set(
        title="1000 gains K + D autour de celui de Kalman",
        xlabel="tr(D S Dᵀ)",
        ylabel="tr P(K + D) - tr P(K)",
    )
    draw_banana(b, rng, (ORANGE, GREEN))
    for (name, values), colour in zip(worst.items(), (ORANGE, GREEN), strict=True):
        c.semilogx(np.sort(values), np.arange(1, RUNS + 1) / RUNS * 100, color=colour, label=name.upper())
    c.axvline(LOST_M, color="black", linewidth=0.8, label=f"perdu : plus de {LOST_M:.0f} m")
    c.set(title=f"{RUNS} essais sous fort bruit", xlabel="pire erreur des 10 dernières secondes (m)",
          ylabel="part des essais (%)")  # fmt: skip
    c.legend(loc="lower right")
    save(figure)

    assert (excess > 0).all(), "aucun autre gain ne fait mieux"
    np.testing.assert_allclose(excess, expected, rtol=1e-6)
    assert lost["ekf"] > 0.1, "sous fort bruit, l'EKF se perd souvent"
    assert lost["ukf"] < 0.5 * lost["ekf"], "l'UKF bien moins, mais pas jamais"
    assert np.median(nees["ukf"]) < np.median(nees["ekf"]), "et il est moins trop sûr de lui"


def draw_banana(axes, rng, colours):
    """Après 15 s à l'aveugle : les possibles forment une banane, et la croyance du filtre aussi, sur SE(2).

    EKF et UKF en sont là au même point : sur ce robot c'est la correction, pas la prédiction, qui les sépare.
    """
    model = replace(robot(), sensors={})
    t = np.arange(0, BLIND_S + DT_S / 2, DT_S)
    log = sq.SensorLog({"wheels": sq.Stream(t, np.tile([1.0, 0.1], (len(t), 1)))})
    ekf, ukf = (sq.run(f, model, log, at=t) for f in (sq.ExtendedKalmanFilter(), sq.UnscentedKalmanFilter()))
    np.testing.assert_allclose(ekf.mean[-1], ukf.mean[-1], atol=1e-9)
    truth = np.array([sq.simulate(robot(0.0), t, rng, inputs=np.tile([1.0, 0.1], (len(t), 1)),
                                  contexts={"landmarks": [0.0]}).truth[-1] for _ in range(200)])  # fmt: skip
    steps = rng.standard_normal((200, 3)) @ np.linalg.cholesky(ekf.cov[-1]).T
    belief = model.manifold.retract(ekf.mean[-1], steps)
    axes.plot(truth[:, 0], truth[:, 1], ".", color="#9a9a9a", markersize=5, label="200 essais simulés")
    axes.plot(belief[:, 0], belief[:, 1], ".", color=colours[1], markersize=3, label="croyance du filtre")
    axes.plot(*ekf.mean[-1, :2], "o", color=colours[0], label="moyenne (EKF et UKF)")
    axes.set(title="Après 15 s à l'aveugle : une banane", xlabel="x (m)", ylabel="y (m)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.update_datalim([(0, -14), (0, 30)])
    axes.legend(loc="upper left", fontsize=8)


if __name__ == "__main__":
    main()
