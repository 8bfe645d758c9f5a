"""F2. Filtres simples : moyenne glissante, médiane, passe-bas, complémentaire.

Passe-bas y += a (x - y) : sa constante de temps vaut environ Δt/a.  Avec a = 0,05 à 50 Hz il lisse sur
0,4 s, et il retarde d'autant.  La médiane supprime les valeurs aberrantes, mais pas le bruit gaussien ;
la moyenne fait le contraire.  Tout lissage causal se paie en retard : chaque filtre annonce le sien
(`response`).
"""

import numpy as np

import sequential as sq

INTERVAL_S = 0.02
FILTERS = {
    "moyenne (25)": sq.MovingMean(25),
    "médiane (25)": sq.SlidingMedian(25),
    "passe-bas a = 0,05": sq.LowPass(coefficient=0.05, interval=INTERVAL_S),
    "Hampel (25) puis passe-bas": None,
}


def smooth(name, x):
    """Le filtre de ce nom, appliqué à x ; le dernier écarte d'abord les valeurs aberrantes."""
    chosen = FILTERS[name]
    if chosen is not None:
        return chosen(x)
    return FILTERS["passe-bas a = 0,05"](sq.Hampel(25, threshold=4.0)(x))


def main():
    from figures import BLUE, GREEN, ORANGE, PINK, READINGS, TRUTH, panels, save

    rng = np.random.default_rng(2)
    t = np.arange(1000) * INTERVAL_S
    truth = np.where(t < 8.0, 1.0, 3.0)  # un échelon
    gaussian = 0.2 * rng.standard_normal(len(t))
    outliers = np.where(rng.random(len(t)) < 0.02, 6.0, 0.0)
    x = truth + gaussian + outliers

    print(f"{'filtre':30}{'retard à 90 %':>14}{'σ out / σ in':>14}{'erreur RMS hors échelon':>26}")
    steady = (t > 2) & ((t < 8) | (t > 11))
    rms, outlier_rms = {}, {}
    for name, chosen in FILTERS.items():
        response = (chosen or FILTERS["passe-bas a = 0,05"]).response(INTERVAL_S)
        rms[name] = np.sqrt(np.mean((smooth(name, x) - truth)[steady] ** 2))
        outlier_rms[name] = np.sqrt(np.mean(smooth(name, outliers)[steady] ** 2))
        print(f"{name:30}{response.delay_90:12.2f} s{response.noise_gain:14.2f}{rms[name]:26.3f}")
    low = FILTERS["passe-bas a = 0,05"]
    print(f"passe-bas : constante de temps {low.tau:.2f} s (Δt/a = {INTERVAL_S / 0.05:.2f} s), "
          f"retard de phase à 1 Hz : {float(low.phase_delay(1.0)) * 1e3:.0f} ms")  # fmt: skip

    # complémentaire : un cap qui franchit ±180°, boussole bruitée et gyromètre biaisé
    heading = 60 * t + 20 * np.sin(t)
    compass = (heading + 8 * rng.standard_normal(len(t)) + 180) % 360 - 180
    rate = 60 + 20 * np.cos(t) + 1.0
    blend = sq.Complementary(time_constant=2.0, angle=True)
    fused = np.degrees(blend(t, np.radians(compass), rate=np.radians(rate)))
    wrong = np.degrees(sq.Complementary(2.0)(t, np.radians(compass), rate=np.radians(rate)))
    off, off_wrong = ((y - heading + 180) % 360 - 180 for y in (fused, wrong))

    figure, (a, b, c) = panels(1, 3, size=(12.5, 4.0), title="F2. Lisser, c'est retarder")
    colours = (BLUE, ORANGE, GREEN, PINK)
    a.plot(t, x, label="mesures", **READINGS)
    b.plot(t, x, **READINGS)
    for name, colour in zip(FILTERS, colours, strict=True):
        a.plot(t, smooth(name, x), color=colour, label=name)
        b.plot(t, smooth(name, x), color=colour)
    spikes = t[outliers > 0]
    a.plot(spikes, np.full(len(spikes), 2.2), "^", color="#9a9a9a", label="aberrantes (+6, hors cadre)")
    for axes in (a, b):
        axes.plot(t, truth, label="vérité", **TRUTH)
        axes.set(xlabel="temps (s)", ylabel="signal")
    a.set(title="Bruit gaussien et valeurs aberrantes", xlim=(2, 7), ylim=(0.2, 4.6))
    b.set(title="Réponse à un échelon", xlim=(7.5, 10), ylim=(0.5, 3.8))
    a.legend(loc="upper left", fontsize=8)
    c.plot(t, (compass - heading + 180) % 360 - 180, label="boussole", **READINGS)
    c.plot(t, off_wrong, color=ORANGE, label="sans repli des angles")
    c.plot(t, off, color=GREEN, label="complémentaire, angles repliés")
    c.set(title="Complémentaire : cap qui franchit ±180°", xlabel="temps (s)", ylabel="erreur de cap (°)")
    c.set_ylim(-200, 260)
    c.legend(loc="upper left")
    save(figure)

    mean, median = FILTERS["moyenne (25)"], FILTERS["médiane (25)"]
    assert median.response().noise_gain > 1.2 * mean.response().noise_gain, "la médiane laisse plus de bruit"
    assert outlier_rms["médiane (25)"] == 0.0 < outlier_rms["moyenne (25)"], "et supprime les aberrantes"
    assert abs(low.tau - INTERVAL_S / 0.05) < 0.02, "τ ≈ Δt/a"
    assert rms["Hampel (25) puis passe-bas"] < rms["passe-bas a = 0,05"], "écarter, puis lisser"
    assert 10.0 * np.std(off[200:]) < 20.0 < np.std(off_wrong[200:]), "un angle se compare replié"


if __name__ == "__main__":
    main()
