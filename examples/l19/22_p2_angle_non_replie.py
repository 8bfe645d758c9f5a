"""P2. Deuxième piège : des angles soustraits comme des nombres.

359° et -1° sont le même cap.  Un filtre qui attend 179° et reçoit -179° ne s'est pas trompé de 358° mais
de 2° : l'innovation doit être repliée dans ]-π, π] avant de multiplier le gain.  Sinon, chaque passage par
le sud envoie le cap faire un tour dans le mauvais sens, et le biais estimé du gyromètre avec lui.

- Ici : un robot tourne en rond ; gyromètre biaisé à 100 Hz, boussole à 10 Hz, Kalman (cap, biais).
- Remède : une seule ligne, `replier`, partout où l'on soustrait deux angles (innovation, erreur, écart au
  cap voulu).  La bibliothèque le fait dès qu'on dit où vit la mesure : `manifold=SO2()` (voir K3).
- De même, la moyenne de 359° et de 1° n'est pas 180° : on moyenne les cosinus et les sinus.
"""

import numpy as np
from claims import claim
from figures import GREEN, ORANGE, READINGS, TRUTH, panels, save, say

DT, GYRO_SIGMA, COMPASS_SIGMA = 0.01, np.radians(1.0), np.radians(3.0)
BIAS, TURN = np.radians(2.0), np.radians(20.0)  # rad/s : le biais vrai, et la vitesse de rotation


def replier(angle):
    """Le même angle dans ]-π, π]."""
    return np.pi - (np.pi - angle) % (2.0 * np.pi)


def kalman(gyro, compass, wrap):
    """Cap et biais (N, 2) et innovations ; `wrap` replie l'innovation, ou ne fait rien."""
    F, Q = np.array([[1.0, -DT], [0.0, 1.0]]), np.diag([(GYRO_SIGMA * DT) ** 2, (1e-4 * DT) ** 2])
    x, P, H = np.zeros(2), np.diag([0.1, 0.01]), np.array([1.0, 0.0])
    path, innovations = [], []
    for k, rate in enumerate(gyro):
        x = np.array([replier(x[0] + DT * (rate - x[1])), x[1]])
        P = F @ P @ F.T + Q
        if k % 10 == 9:
            nu = wrap(compass[k] - x[0])
            K = P @ H / (H @ P @ H + COMPASS_SIGMA**2)
            x, P = x + K * nu, P - np.outer(K, H @ P)
            innovations.append((k * DT, nu))
        path.append(x)
    return np.array(path), np.array(innovations)


def main():
    rng = np.random.default_rng(22)
    t = DT * np.arange(1, 6001)
    truth = replier(TURN * t)
    gyro = TURN + BIAS + GYRO_SIGMA * rng.standard_normal(len(t))
    compass = replier(truth + COMPASS_SIGMA * rng.standard_normal(len(t)))

    runs = {
        "non repliée": kalman(gyro, compass, wrap=lambda a: a),
        "repliée": kalman(gyro, compass, wrap=replier),
    }
    error = {name: np.degrees(replier(path[:, 0] - truth)) for name, (path, _) in runs.items()}
    rms = {name: np.sqrt(np.mean(off[1000:] ** 2)) for name, off in error.items()}
    bias = {name: np.degrees(path[-1, 1]) for name, (path, _) in runs.items()}
    headings = np.radians([359.0, 1.0])
    mean = np.degrees(np.angle(np.mean(np.exp(1j * headings))))
    say(f"moyenne de 359° et de 1° : {np.degrees(headings.mean()):.0f}° (nombres), {abs(mean):.0f}° (angles)")

    claim("P2", "erreur de cap, innovation repliée", rms["repliée"], "°", high=1.0)
    claim("P2", "erreur de cap, innovation non repliée", rms["non repliée"], "°", low=10)
    claim("P2", "erreur du biais estimé, repliée", abs(bias["repliée"] - 2.0), "°/s", high=0.1)
    claim("P2", "erreur du biais estimé, non repliée", abs(bias["non repliée"] - 2.0), "°/s", low=0.3)
    largest = {name: np.degrees(np.abs(nu[:, 1]).max()) for name, (_, nu) in runs.items()}
    assert largest["repliée"] < 30, "repliée, l'innovation reste petite"
    assert largest["non repliée"] > 300, "359° pour -1°"
    assert replier(np.pi) == np.pi == replier(-np.pi), "l'intervalle est ]-π, π]"
    assert abs(mean) < 1e-9, "la moyenne de 359° et de 1° est 0°"
    draw(t, truth, compass, runs, error)


def draw(t, truth, compass, runs, error):
    """Le cap, l'innovation et le biais, avec et sans repli."""
    figure, (a, b, c) = panels(
        1, 3, size=(14.5, 4.2), title="P2. Un angle n'est pas un nombre : replier l'innovation"
    )
    a.plot(t[9::10], np.degrees(compass[9::10]), label="boussole", **READINGS)
    for (name, (path, nu)), colour in zip(runs.items(), (ORANGE, GREEN), strict=True):
        a.plot(t, np.degrees(replier(path[:, 0])), color=colour, label=f"innovation {name}", linewidth=1.2)
        b.plot(nu[:, 0], np.degrees(nu[:, 1]), ".", color=colour, markersize=4, label=f"innovation {name}")
        c.plot(t, np.degrees(path[:, 1]), color=colour, label=f"innovation {name}")
    a.plot(t, np.degrees(truth), label="vérité", **{**TRUTH, "linewidth": 1.0})
    a.set(title="Cap", xlabel="temps (s)", ylabel="cap (°)", xlim=(0, 40), ylim=(-190, 320))
    a.set_yticks([-180, -90, 0, 90, 180])
    b.set(title="Innovation de la boussole", xlabel="temps (s)", ylabel="innovation (°)", ylim=(-400, 480))
    c.axhline(np.degrees(BIAS), label="vrai biais", **TRUTH)
    c.set(title="Biais estimé du gyromètre", xlabel="temps (s)", ylabel="biais (°/s)")
    for axes in (a, b, c):
        axes.legend(loc="upper right" if axes is c else "upper left", fontsize=8, ncols=2 if axes is a else 1)
    save(figure)


if __name__ == "__main__":
    main()
