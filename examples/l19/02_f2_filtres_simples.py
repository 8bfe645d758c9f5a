"""F2. Filtres simples : moyenne glissante, médiane, passe-bas, complémentaire.

Passe-bas y += a (x - y) : sa constante de temps vaut environ Δt/a.  Avec a = 0,05 à 50 Hz il lisse sur
0,4 s, et il retarde d'autant.  La médiane supprime les valeurs aberrantes, mais le bruit gaussien moins bien
que la moyenne, qui, elle, étale chaque valeur aberrante sur toute sa fenêtre.  Tout lissage causal se paie
en retard : chaque filtre annonce le sien (`response`).  Le complémentaire lisse sans retarder, parce qu'un
second capteur (le gyromètre) lui dit ce qui bouge vraiment.
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
    from claims import claim
    from figures import say

    rng = np.random.default_rng(2)
    t = np.arange(1000) * INTERVAL_S
    truth = np.where(t < 8.0, 1.0, 3.0)  # un échelon
    gaussian = 0.2 * rng.standard_normal(len(t))
    outliers = np.where(rng.random(len(t)) < 0.02, 6.0, 0.0)
    x = truth + gaussian + outliers

    print(f"{'filtre':30}{'retard à 90 %':>14}{'σ gardé':>14}{'erreur RMS hors échelon':>26}")
    steady = (t > 2) & ((t < 8) | (t > 11))
    rms, outlier_rms = {}, {}
    for name, chosen in FILTERS.items():
        response = (chosen or FILTERS["passe-bas a = 0,05"]).response(INTERVAL_S)
        rms[name] = np.sqrt(np.mean((smooth(name, x) - truth)[steady] ** 2))
        outlier_rms[name] = np.sqrt(np.mean(smooth(name, outliers)[steady] ** 2))
        say(f"{name:30}{response.delay_90:12.2f} s{response.noise_gain:14.2f}{rms[name]:26.3f}")
    low = FILTERS["passe-bas a = 0,05"]

    # complémentaire : un cap qui franchit ±180°, boussole bruitée et gyromètre biaisé
    heading = 60 * t + 20 * np.sin(t)
    compass = (heading + 8 * rng.standard_normal(len(t)) + 180) % 360 - 180
    rate = 60 + 20 * np.cos(t) + 1.0
    blend = sq.Complementary(time_constant=2.0, angle=True)
    fused = np.degrees(blend(t, np.radians(compass), rate=np.radians(rate)))
    wrong = np.degrees(sq.Complementary(2.0)(t, np.radians(compass), rate=np.radians(rate)))
    off, off_wrong = ((y - heading + 180) % 360 - 180 for y in (fused, wrong))

    draw(t, truth, x, outliers, (compass - heading + 180) % 360 - 180, off, off_wrong)

    mean, median = FILTERS["moyenne (25)"], FILTERS["médiane (25)"]
    more = median.response().noise_gain / mean.response().noise_gain  # √(π/2) = 1,25 en théorie
    lag, delay_90 = t[-1] - low(t)[-1], low.response(INTERVAL_S).delay_90
    claim("F2", "constante de temps du passe-bas, a = 0,05 à 50 Hz", low.tau, "s", low=0.38, high=0.42)
    claim("F2", "retard de ce passe-bas sur une rampe", lag, "s", low=0.36, high=0.42)
    claim("F2", "temps de ce passe-bas pour 90 % d'un échelon", delay_90, "s", low=0.8, high=1.0)
    claim("F2", "bruit gaussien gardé, médiane sur moyenne", more, low=1.2, high=1.3)
    claim("F2", "cap qui franchit ±180°, écart-type, angles repliés", np.std(off[200:]), "°", high=2)
    claim("F2", "cap qui franchit ±180°, écart-type, sans repli", np.std(off_wrong[200:]), "°", low=20)
    assert outlier_rms["médiane (25)"] == 0.0 < outlier_rms["moyenne (25)"], "la médiane ôte les aberrantes"
    assert rms["Hampel (25) puis passe-bas"] < rms["passe-bas a = 0,05"], "écarter, puis lisser"


def draw(t, truth, x, outliers, compass_error, off, off_wrong):
    """Les filtres sous le bruit, sur l'échelon, et le cap."""
    from figures import BLUE, GREEN, ORANGE, PINK, READINGS, TRUTH, panels, save

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
        axes.step(t, truth, where="mid", label="vérité", **TRUTH)
        axes.set(xlabel="temps (s)", ylabel="signal (sans unité)")
    a.set(title="Bruit gaussien et valeurs aberrantes", xlim=(2, 7), ylim=(0.2, 4.6))
    b.set(title="Réponse à un échelon", xlim=(7.5, 10), ylim=(0.5, 3.8))
    a.legend(loc="upper left", fontsize=8)
    c.plot(t, compass_error, label="boussole", **READINGS)
    c.plot(t, off_wrong, color=ORANGE, label="sans repli des angles")
    c.plot(t, off, color=GREEN, label="complémentaire, angles repliés")
    c.set(title="Complémentaire : cap qui franchit ±180°", xlabel="temps (s)", ylabel="erreur de cap (°)")
    c.set_ylim(-200, 330)
    c.legend(loc="upper left")
    save(figure)


if __name__ == "__main__":
    main()
