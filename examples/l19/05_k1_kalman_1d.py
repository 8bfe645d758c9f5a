"""K1. Kalman à une dimension : prédire, puis corriger avec le bon gain.

    prédire :   x ← x            P ← P + Q          (on en sait un peu moins)
    corriger :  K = P / (P + R)
                x ← x + K (z - x)
                P ← (1 - K) P                        (on en sait davantage)

Lire chaque terme : R grand (mauvais capteur) → K tend vers 0, on garde la prédiction ; P grand (on ne
sait rien) → K tend vers 1, on prend la mesure.  Question du cours : augmenter R fait quoi ?  Le filtre
croit moins ses mesures : l'estimation est plus lisse, mais elle suit plus lentement ; et K ne dépend que
de P, Q et R, jamais des mesures.
"""

import numpy as np

import sequential as sq


def kalman_1d(z, Q, R, x, P):
    """Estimations, variances et gains ; z sont les mesures, x et P la croyance avant la première."""
    history = []
    for k, measured in enumerate(z):
        if k > 0:
            P = P + Q
        K = P / (P + R)
        x = x + K * (measured - x)
        P = (1.0 - K) * P
        history.append((x, P, K))
    return np.array(history).T


def main():
    from claims import claim
    from figures import BLUE, GREEN, ORANGE, READINGS, TRUTH, panels, save, say

    rng = np.random.default_rng(3)
    Q, R = 0.05**2, 0.5**2  # °C² par seconde ; °C²
    truth = 20.0 + np.cumsum(np.sqrt(Q) * rng.standard_normal(600))
    z = truth + np.sqrt(R) * rng.standard_normal(600)
    estimates = {factor: kalman_1d(z, Q, factor * R, x=15.0, P=4.0**2) for factor in (0.05, 1.0, 20.0)}
    rms = {factor: np.sqrt(np.mean((x - truth)[50:] ** 2)) for factor, (x, _, _) in estimates.items()}

    # le même filtre avec la bibliothèque
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([15.0], 4.0**2),
        sq.RandomWalk(Q),
        {"thermometer": sq.LinearSensor([[1.0]], R)},
    )
    log = sq.SensorLog({"thermometer": sq.Stream(np.arange(600.0), z)})
    run = sq.run(sq.KalmanFilter(), model, log)

    figure, (a, b) = panels(1, 2, size=(11.5, 4.0), title="K1. Kalman 1-D : le gain dose la confiance")
    a.plot(z, label="mesures, σ = 0,5 °C", **READINGS)
    for (factor, (x, P, K)), colour in zip(estimates.items(), (ORANGE, GREEN, BLUE), strict=True):
        name = "bon R" if factor == 1.0 else f"R × {factor:g}"
        say(f"{name:9}: K de {K[0]:.2f} à {K[-1]:.3f}, erreur RMS {rms[factor]:.3f} °C, "
              f"σ annoncé {np.sqrt(P[-1]):.3f} °C")  # fmt: skip
        a.plot(x, color=colour, label=name)
        b.semilogy(K, color=colour, label=name)
    a.plot(truth, label="vérité", **TRUTH)
    a.set(title="Estimation, x₀ = 15 °C", xlabel="temps (s)", ylabel="température (°C)")
    a.set(xlim=(0, 200), ylim=(16.5, 21.5))
    a.legend(ncols=2, loc="lower right")
    b.set(title="Gain K : grand au début, puis constant", xlabel="temps (s)", ylabel="K (sans unité)")
    b.set(xlim=(-3, 200))
    b.legend()
    save(figure)

    good = estimates[1.0]
    np.testing.assert_allclose(run.mean[:, 0], good[0], rtol=1e-10)
    np.testing.assert_allclose(run.cov[:, 0, 0], good[1], rtol=1e-10)
    assert estimates[20.0][2][-1] < good[2][-1] < estimates[0.05][2][-1], "R grand : K petit"
    assert kalman_1d(z, Q, 1e9, 15.0, 1.0)[2][0] < 1e-8, "R → ∞ : K → 0"
    assert kalman_1d(z, Q, R, 15.0, 1e9)[2][0] > 1 - 1e-8, "P → ∞ : K → 1"
    claim("K1", "gain K installé, bon R", good[2][-1], low=0.09, high=0.10)
    claim("K1", "gain K installé, R 20 fois trop grand", estimates[20.0][2][-1], low=0.02, high=0.025)
    claim("K1", "erreur RMS, bon R", rms[1.0], "°C", low=0.13, high=0.19)
    claim("K1", "erreur RMS, R 20 fois trop grand, sur celle du bon R", rms[20.0] / rms[1.0], low=1.1)
    claim("K1", "erreur RMS, R 20 fois trop petit, sur celle du bon R", rms[0.05] / rms[1.0], low=1.1)


if __name__ == "__main__":
    main()
