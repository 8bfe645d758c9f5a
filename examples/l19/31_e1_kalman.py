"""E1. Une classe `Kalman` : prédire, corriger, et mesurer le NIS.

    prédire :   x ← F x + B u             P ← F P Fᵀ + Q
    corriger :  ν = z - H x               S = H P Hᵀ + R         NIS = νᵀ S⁻¹ ν
                K = P Hᵀ S⁻¹              x ← x + K ν            P ← (I - K H) P (I - K H)ᵀ + K R Kᵀ

La dernière ligne est la forme de Joseph : la même chose que (I - K H) P, mais P reste symétrique et
positive malgré les arrondis.  C'est la bibliothèque qui calcule ; les équations écrites à la main servent
ici de vérification.  Ce que l'on voit : P converge sans regarder les mesures, donc ne prouve rien ; le NIS,
lui, les regarde, et dit si Q et R sont justes.

Votre solution se vérifie par `factorlab l19 check MON_FICHIER.py`.
"""

import numpy as np

import sequential as sq


class Kalman:
    """Filtre de Kalman linéaire : x' = F x + B u + w, z = H x + v, w ~ N(0, Q), v ~ N(0, R).

    B vaut None pour un système sans commande ; x0 (n,) et P0 (n, n) sont la croyance de départ.
    """

    def __init__(self, F, B, H, Q, R, x0, P0):
        x0 = np.ravel(x0)  # un vecteur colonne fait aussi l'affaire
        self.rest = None if B is None else np.zeros(np.shape(B)[1])  # la commande nulle
        model = sq.StateSpace(
            manifold=sq.Vector(len(x0)),
            prior=sq.Gaussian(x0, P0),
            process=sq.LinearProcess(np.atleast_2d(F), Q, B),
            sensors={"z": sq.LinearSensor(H, R)},
            input=None if B is None else "u",
        )
        self.filter = sq.Online(sq.KalmanFilter(), model)
        self.belief = self.filter.start()

    @property
    def x(self):
        """État estimé, (n,)."""
        return self.belief.mean

    @property
    def P(self):  # noqa: N802 - the letter of the equations
        """Sa covariance, (n, n)."""
        return self.belief.cov

    def predire(self, u=None):
        """Avancer d'un pas, sous la commande u (nulle par défaut)."""
        self.belief = self.filter.predict(self.belief, 1.0, self.rest if u is None else np.ravel(u))

    def corriger(self, z):
        """Tenir compte d'une mesure ; renvoie son NIS (innovation normalisée au carré, νᵀ S⁻¹ ν)."""
        self.belief, innovation = self.filter.update(self.belief, "z", np.ravel(z))
        return innovation.nis


def nis_moyen(kf, mesures, commandes=None):
    """NIS moyen par composante, en prédisant et en corrigeant chaque mesure : 1 si Q et R sont justes."""
    nis = []
    for k, z in enumerate(mesures):
        kf.predire(None if commandes is None else commandes[k])
        nis.append(kf.corriger(z))
    return float(np.mean(nis)) / np.atleast_1d(mesures[0]).size


def by_hand(F, H, Q, R, x, P, z):
    """Un pas écrit à la main : prédire, puis corriger."""
    x, P = F @ x, F @ P @ F.T + Q
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    return x + K @ (z - H @ x), (np.eye(len(x)) - K @ H) @ P


def main():
    from claims import claim
    from figures import BLUE, GREEN, ORANGE, panels, save, say

    # vitesse constante : position mesurée toutes les 0,1 s, commande = accélération
    dt, q, sigma = 0.1, 0.2, 0.5
    F, B = np.array([[1.0, dt], [0.0, 1.0]]), np.array([[dt**2 / 2], [dt]])
    H, R = np.array([[1.0, 0.0]]), np.array([[sigma**2]])
    Q = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    x0, P0 = np.zeros(2), np.diag([4.0, 1.0])
    rng = np.random.default_rng(7)
    commands = np.sin(0.05 * np.arange(1000))[:, None]
    x, z = rng.multivariate_normal(x0, P0), []
    for u in commands:
        x = F @ x + B @ u + rng.multivariate_normal(np.zeros(2), Q)
        z.append(H @ x + sigma * rng.standard_normal(1))

    trace, factors = {}, {"R × 10": 10.0, "R juste": 1.0, "R ÷ 10": 0.1}
    for name, factor in factors.items():
        kf, nis, sigmas = Kalman(F, B, H, Q, factor * R, x0, P0), [], []
        for u, measured in zip(commands, z, strict=True):
            kf.predire(u)
            nis.append(kf.corriger(measured))
            sigmas.append(np.sqrt(kf.P[0, 0]))
        trace[name] = np.array(nis), np.array(sigmas)
        say(f"{name:8}: NIS moyen {nis_moyen(Kalman(F, B, H, Q, factor * R, x0, P0), z, commands):5.2f}, "
              f"σ de position annoncé {sigmas[-1]:.3f} m")  # fmt: skip

    figure, (a, b) = panels(
        1, 2, size=(11.0, 3.9), title="E1. P converge ; le NIS dit si l'on a raison d'y croire"
    )
    for (name, (nis, sigmas)), colour in zip(trace.items(), (BLUE, GREEN, ORANGE), strict=True):
        t = dt * np.arange(1, 1001)
        a.plot(t, sigmas, color=colour, label=name)
        b.semilogy(t, np.cumsum(nis) / np.arange(1, 1001), color=colour, label=name)
    a.set(title="σ de position annoncé", xlabel="temps (s)", ylabel="σ (m)", xlim=(0, 20), ylim=(0, None))
    b.axhline(1.0, color="black", linewidth=0.8)
    b.set(title="NIS moyen jusqu'à l'instant t", xlabel="temps (s)", ylabel="NIS (sans unité)")
    a.legend()
    b.set_ylim(0.04, 40)
    b.legend(ncols=3, loc="upper right")
    save(figure)

    kf, x, P = Kalman(F, None, H, Q, R, x0, P0), x0, P0
    for measured in z[:100]:
        kf.predire()
        kf.corriger(measured)
        x, P = by_hand(F, H, Q, R, x, P, measured)
    np.testing.assert_allclose(kf.x, x, rtol=1e-9)
    np.testing.assert_allclose(kf.P, P, rtol=1e-9)
    sigmas = trace["R juste"][1]
    mean = {name: np.mean(nis) for name, (nis, _) in trace.items()}
    claim("E1", "NIS moyen, Q et R justes", mean["R juste"], low=0.9, high=1.1)
    claim("E1", "NIS moyen, R déclaré dix fois trop petit", mean["R ÷ 10"], low=3)
    claim("E1", "NIS moyen, R déclaré dix fois trop grand", mean["R × 10"], high=0.3)
    claim("E1", "σ de position installé, Q et R justes", sigmas[-1], "m", low=0.22, high=0.25)
    assert abs(sigmas[-1] - sigmas[-200]) < 1e-9, "P converge"


if __name__ == "__main__":
    main()
