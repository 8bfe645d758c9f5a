"""K2. Régler Q et R : R au repos, Q pour un NIS moyen de 1, et un portillon de Mahalanobis.

NIS = νᵀ S⁻¹ ν : l'innovation ν au carré, en unités de sa variance annoncée S.  Si le filtre dit vrai, sa
moyenne est le nombre de composantes de la mesure (1 ici).  NIS >> 1 : trop sûr de lui, augmenter Q (ou R,
s'il vient d'une notice) ; NIS << 1 : trop prudent, diminuer Q.  Le portillon de Mahalanobis refuse une mesure
si son NIS dépasse le χ² à 99,9 % ; un seuil fixe, en mètres, ne sait pas que l'incertitude grandit quand le
capteur se tait : il refuse alors les bonnes mesures, pour toujours.
"""

import numpy as np

import sequential as sq

RATE_HZ = 10.0
GATE = 0.999  # probabilité qu'une bonne mesure soit acceptée


def cart(q, R, gate=None):
    """Un chariot à vitesse presque constante (densité d'accélération q, m²/s³) vu par un télémètre."""
    sensors = {"range": sq.LinearSensor([[1.0, 0.0]], R, gate=gate)}
    return sq.StateSpace(
        sq.Vector(2), sq.Gaussian([0.0, 0.0], [1.0, 1.0]), sq.ConstantVelocity(q), sensors, start=0.0
    )


def mean_nis(q, R, log):
    """NIS moyen d'un filtre réglé ainsi, le début exclu."""
    return float(np.mean(sq.run(sq.KalmanFilter(), cart(q, R), log).innovations["range"].nis()[20:]))


def tune_q(R, log, low=1e-4, high=1e2):
    """La densité q qui donne un NIS moyen de 1 : le NIS décroît avec q, on coupe l'intervalle en deux."""
    for _ in range(40):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if mean_nis(middle, R, log) > 1.0 else (low, middle)
    return np.sqrt(low * high)


def fixed_threshold(q, R, log, threshold_m):
    """Le même filtre, qui refuse toute innovation de plus de `threshold_m` : estimations à chaque mesure."""
    F, H = np.array([[1.0, 1.0 / RATE_HZ], [0.0, 1.0]]), np.array([1.0, 0.0])
    x, P, last, path = np.zeros(2), np.eye(2), 0.0, []
    for t, z in zip(log["range"].t * 1e-9, log["range"].values[:, 0], strict=True):
        dt = t - last
        F[0, 1], last = dt, t
        x, P = F @ x, F @ P @ F.T + q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        if abs(z - x[0]) < threshold_m:
            K = P @ H / (H @ P @ H + R)
            x, P = x + K * (z - x[0]), (np.eye(2) - np.outer(K, H)) @ P
        path.append(x[0])
    return np.array(path)


def main():
    from claims import claim
    from figures import panels, save, say

    rng = np.random.default_rng(8)
    q_true, sigma_true = 0.5, 0.2
    at_rest = 3.0 + sigma_true * rng.standard_normal(300)  # 30 s devant un mur
    R = np.var(at_rest, ddof=1)
    drive = sq.simulate(cart(q_true, sigma_true**2), np.arange(0, 100, 1 / RATE_HZ), rng)
    q = tune_q(R, drive.log)
    library = sq.tune_by_nis(lambda v: cart(v["q"], R), [sq.Knob("q", 1.0, "m²/s³")], drive.log)
    low, high = library.interval("q")
    say(f"par la bibliothèque : q = {library.values['q']:.2f}, entre {low:.2f} et {high:.2f} m²/s³")
    grid = np.logspace(-3, 2, 26)
    curve = [mean_nis(value, R, drive.log) for value in grid]

    # 2 % de mesures aberrantes, et 8 s de silence
    t, z = drive.log["range"].t, drive.log["range"].values[:, 0].copy()
    bad = rng.random(len(z)) < 0.02
    z[bad] += 10.0
    heard = (t < 40_000_000_000) | (t > 48_000_000_000)
    log = sq.SensorLog({"range": sq.Stream(t[heard], z[heard])})
    truth, bad = drive.truth[heard, 0], bad[heard]
    gated = sq.run(sq.KalmanFilter(), cart(q, R, gate=GATE), log)
    accepted = gated.innovations["range"].accepted
    fixed = fixed_threshold(q, R, log, threshold_m=1.0)
    after = log["range"].t > 50_000_000_000
    rms_gate, rms_fixed = (np.sqrt(np.mean((y - truth)[after] ** 2)) for y in (gated.mean[:, 0], fixed))
    say(f"Mahalanobis : {np.sum(~accepted)} refus pour {np.sum(bad)} aberrantes")

    figure, (a, b) = panels(1, 2, size=(11.5, 4.2), title="K2. R au repos, Q par le NIS, puis un portillon")
    draw_nis(a, grid, curve, q, q_true)
    draw_gate(b, log, truth, gated, fixed)
    save(figure)

    claim("K2", "NIS moyen une fois Q réglé", mean_nis(q, R, drive.log), low=0.99, high=1.01)
    claim("K2", "σ mesuré au repos (vrai : 0,2)", np.sqrt(R), "m", low=0.17, high=0.23)
    claim("K2", "q réglé par le NIS (vrai : 0,5)", q, "m²/s³", low=0.2, high=1.25)
    claim("K2", "erreur RMS après le silence, portillon de Mahalanobis", rms_gate, "m", high=0.3)
    claim("K2", "erreur RMS après le silence, seuil fixe de 1 m", rms_fixed, "m", low=5)
    assert 0.7 < library.values["q"] / q < 1.4, "à la main et par la bibliothèque"
    assert curve[0] / 3.0 > 1.0 > curve[-1], "trop sûr de lui, puis trop prudent"
    assert (~accepted[bad]).all(), "aucune aberrante n'entre"
    assert np.sum(~accepted & ~bad) <= 5, "et presque rien d'autre n'est refusé"


def draw_nis(a, grid, curve, q, q_true):
    """Le NIS moyen en fonction de q."""
    import figures

    a.loglog(grid, curve, color=figures.BLUE, marker=".", label="NIS moyen")
    a.axhline(1.0, color="black", linewidth=0.8)
    a.axvline(q_true, color=figures.GREEN, linestyle="--", label="q vrai")
    a.plot(q, 1.0, "o", color=figures.ORANGE, label=f"q choisi : {q:.2f} m²/s³")
    a.text(1.3e-3, 1.05, "trop sûr de lui", va="bottom")
    a.text(1.3e-3, 0.95, "trop prudent", va="top")
    a.set(title="Le NIS décroît avec Q", xlabel="densité d'accélération q (m²/s³)", ylabel="NIS moyen")
    a.legend(loc="upper right")


def draw_gate(b, log, truth, gated, fixed):
    """Les deux portillons, autour du silence."""
    import figures

    s, z, accepted = log["range"].t * 1e-9, log["range"].values[:, 0], gated.innovations["range"].accepted
    b.plot(s, z, label="mesures", **figures.READINGS)
    b.plot(s[~accepted], z[~accepted], "x", color=figures.ORANGE, label="refusées par Mahalanobis")
    b.plot(s, fixed, color=figures.ORANGE, linewidth=1, label="seuil fixe de 1 m")
    b.plot(s, gated.mean[:, 0], color=figures.GREEN, label="portillon de Mahalanobis")
    b.plot(s, truth, label="vérité", **figures.TRUTH)
    b.set(title="Après 8 s de silence, le seuil fixe refuse tout", xlabel="temps (s)", ylabel="position (m)")
    b.set_xlim(30, 70)
    inside = (s > 30) & (s < 70)
    b.axvspan(40, 48, color="#eeeeee", label="capteur muet")
    b.set_ylim(truth[inside].min() - 25, truth[inside].max() + 15)
    b.legend(loc="lower left", fontsize=8)


if __name__ == "__main__":
    main()
