"""D1 (★). Régler un Kalman comme un ingénieur : une température, rampe puis palier, 1 Hz, σ = 0,5 °C.

Une mesure aberrante de +8 °C tombe à t = 40 s.  État : (température, pente).  On compare avec un
passe-bas et une médiane : temps pour faire 90 % d'un échelon, et erreur RMS.

Procédure de réglage, pour n'importe quel capteur :
 1. Laisser le capteur immobile ; enregistrer au moins 30 s et 30 mesures.
 2. R = variance de cet enregistrement (enlever la tendance si elle se voit).
 3. Écrire l'état : la grandeur, et sa pente si elle varie.
 4. Écrire Q avec un seul bouton q : la densité du bruit sur la pente (ou l'accélération).
 5. P0 large : l'incertitude honnête avant la première mesure.
 6. Enregistrer un essai qui bouge comme en service ; filtrer avec q sur plusieurs décades.
 7. Retenir le q qui donne un NIS moyen de 1 par composante (au-dessus : augmenter q).
 8. Poser un portillon de Mahalanobis (χ² à 99,9 %) ; compter les refus : 0,1 % attendu, pas 10 %.
 9. Vérifier le retard sur un échelon et l'erreur RMS : s'ils ne conviennent pas, c'est le modèle qu'il
    faut changer.
10. Vérifier le NIS sur un autre enregistrement que celui du réglage.
"""

import numpy as np

import sequential as sq
from sequential.signal import measure_step_delay

SIGMA, GATE = 0.5, 0.999
T = np.arange(240.0)
TRUTH_C = np.where(T < 120, 20 + 0.25 * T, 50.0)  # °C : rampe puis palier
PLATEAU = slice(200, 230)  # 30 s


def record(rng):
    """Mesures à 1 Hz, et l'aberrante."""
    z = TRUTH_C + SIGMA * rng.standard_normal(len(T))
    z[40] += 8.0
    return z


def kalman(z, q, R, gate=GATE, t=T):
    """Kalman (température, pente) sur les mesures z, prises aux instants t."""
    sensors = {"thermometer": sq.LinearSensor([[1.0, 0.0]], R, gate=gate)}
    prior = sq.Gaussian([z[0], 0.0], [1.0, 0.25])
    model = sq.StateSpace(sq.Vector(2), prior, sq.ConstantVelocity(q), sensors)
    return sq.run(sq.KalmanFilter(), model, sq.SensorLog({"thermometer": sq.Stream(t, z)}))


def mean_nis(z, q, R):
    """NIS moyen sans portillon, sur les mesures qu'une médiane locale ne désavoue pas, les premières exclues.

    Avec le portillon, un q bien trop petit aurait un beau NIS : celui des rares mesures qu'il accepte encore.
    """
    sound = ~sq.Hampel(9, centred=True, threshold=4.0).outliers(z)
    run = kalman(z[sound], q, R, gate=None, t=T[sound])
    return float(np.mean(run.innovations["thermometer"].nis()[10:]))


def tune_q(z, R, low=1e-7, high=1.0):
    """Le bouton q pour lequel le NIS moyen vaut 1."""
    for _ in range(40):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if mean_nis(z, middle, R) > 1.0 else (low, middle)
    return np.sqrt(low * high)


def main():
    from figures import BLUE, GREEN, ORANGE, PINK, READINGS, TRUTH, panels, save

    print("\n".join(__doc__.splitlines()[5:]))
    z = record(np.random.default_rng(14))
    R = np.var(z[PLATEAU], ddof=1)
    q = tune_q(z, R)
    run = kalman(z, q, R)
    seen = run.innovations["thermometer"]
    print(f"R : σ = {np.sqrt(R):.2f} °C ; q = {q:.2g} °C²/s³ ; NIS = {mean_nis(z, q, R):.2f} ; "
          f"refusées : t = {seen.t[~seen.accepted] // 1_000_000_000} s")  # fmt: skip

    print(f"30 mesures ne donnent σ qu'à 13 % près, et q en dépend beaucoup : {tune_q(z, R * 1.13**2):.1g} à "
          f"{tune_q(z, R / 1.13**2):.1g}")  # fmt: skip

    low, median = sq.LowPass(coefficient=0.2, interval=1.0), sq.SlidingMedian(9)
    filters = {
        "Kalman": lambda t, x: kalman(x, q, R, t=t).mean[:, 0],
        "Kalman sans portillon": lambda t, x: kalman(x, q, R, gate=None, t=t).mean[:, 0],
        "passe-bas (a = 0,2)": low,
        "médiane (k = 9)": median,
    }
    delay, ramp, plateau, outputs = {}, {}, {}, {}
    print(f"\n{'filtre':24}{'retard à 90 %':>14}{'RMS rampe':>12}{'RMS palier':>12}")
    for name, smooth in filters.items():
        outputs[name] = smooth(T, z)
        # un petit échelon, d'un σ : un portillon prend d'abord un grand échelon pour des aberrantes
        delay[name] = measure_step_delay(lambda t, x, smooth=smooth: smooth(t, SIGMA * x) / SIGMA, 1.0)
        error = outputs[name] - TRUTH_C
        ramp[name], plateau[name] = (
            np.sqrt(np.mean(error[s] ** 2)) for s in (slice(20, 120), slice(160, 240))
        )
        print(f"{name:24}{delay[name]:12.0f} s{ramp[name]:9.2f} °C{plateau[name]:9.2f} °C")

    figure, (a, b, c) = panels(
        1, 3, size=(14.0, 4.3), title="D1. Une température : Kalman, passe-bas, médiane"
    )
    for axes in (a, b):
        axes.plot(T, z, label="mesures", **READINGS)
        for (name, y), colour in zip(outputs.items(), (GREEN, PINK, BLUE, ORANGE), strict=True):
            axes.plot(T, y, color=colour, label=name)
        axes.plot(T, TRUTH_C, label="vérité", **TRUTH)
        axes.set(xlabel="temps (s)", ylabel="température (°C)")
    a.set(title="L'aberrante de +8 °C à t = 40 s", xlim=(30, 60), ylim=(26, 43))
    b.set(title="Fin de rampe", xlim=(105, 150), ylim=(44, 53))
    a.legend(loc="upper right", fontsize=8)
    grid = np.logspace(-6, 0, 25)
    c.loglog(grid, [mean_nis(z, value, R) for value in grid], color=BLUE, marker=".", label="NIS moyen")
    c.axhline(1.0, color="black", linewidth=0.8)
    c.plot(q, 1.0, "o", color=ORANGE, label=f"q choisi : {q:.1g} °C²/s³")
    c.set(title="Choisir Q par le NIS", xlabel="densité q (°C²/s³)", ylabel="NIS (sans unité)")
    c.legend()
    save(figure)

    assert 0.35 < np.sqrt(R) < 0.65, "R mesuré sur 30 s de palier : à 13 % près en moyenne"
    assert abs(mean_nis(z, q, R) - 1.0) < 0.05, "Q réglé"
    assert not seen.accepted[40], "l'aberrante est refusée"
    assert np.sum(~seen.accepted) <= 3, "et presque rien d'autre"
    assert ramp["Kalman"] < 0.5 * ramp["passe-bas (a = 0,2)"], "il connaît la pente : pas de traînage"
    assert ramp["Kalman"] < 0.5 * ramp["médiane (k = 9)"]
    assert plateau["Kalman"] < SIGMA / 1.5
    assert delay["médiane (k = 9)"] == median.response(1.0).delay_90
    assert delay["passe-bas (a = 0,2)"] == low.response(1.0).delay_90


if __name__ == "__main__":
    main()
