"""P1. Premier piège : R trop petit, ou Q trop petit.

Un chariot à vitesse presque constante, un télémètre de 0,5 m d'écart-type, trois réglages du même filtre.

- R déclaré 100 fois trop petit : le filtre prend le bruit pour du mouvement.  Il court après chaque mesure
  et annonce un écart-type bien plus petit que son erreur.
- Q déclaré 1000 fois trop petit : il croit tout savoir du mouvement.  L'estimation est lisse, en retard à
  chaque changement d'allure, et l'écart-type annoncé est tout aussi faux.
- Remède (voir K2) : R se mesure capteur immobile, puis Q se règle pour que le NIS moyen vaille 1.

Comment le voir sans connaître la vérité ?  Par le NIS : dans les deux cas il dépasse 1 de beaucoup.  Et
lequel des deux est en cause ?  R trop petit : les innovations changent de signe à chaque mesure (le gain
est trop fort) ; Q trop petit : elles gardent longtemps le même (le filtre traîne).

Question du cours : augmenter R fait quoi ?  Le filtre croit moins ses mesures ; il est plus lisse et plus
lent.  Déclarer un R trop petit fait l'inverse, et le rend trop sûr de lui.
"""

import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, READINGS, TRUTH, panels, save, say

import sequential as sq

RATE_HZ, Q_TRUE, SIGMA_TRUE = 10.0, 0.5, 0.5  # Q : densité d'accélération, m²/s³


def cart(q, R):
    """Position et vitesse d'un chariot, vu par un télémètre de variance R."""
    return sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 0.0], [1.0, 1.0]),
        sq.ConstantVelocity(q),
        {"range": sq.LinearSensor([[1.0, 0.0]], R)},
        start=0.0,
    )


def judge(q, R, drive):
    """Le filtre réglé ainsi : son Run, et ce qu'en disent l'innovation et la vérité."""
    run = sq.run(sq.KalmanFilter(), cart(q, R), drive.log)
    seen = run.innovations["range"]
    nu, error = seen.residual[20:, 0], (run.mean - drive.truth)[20:, 0]
    sigma = np.sqrt(run.cov[20:, 0, 0])
    return run, {
        "rms": np.sqrt(np.mean(error**2)),
        "announced": np.sqrt(np.mean(sigma**2)),
        "inside": 100.0 * np.mean(np.abs(error) < 2 * sigma),
        "nis": np.mean(seen.nis()[20:]),
        "echo": np.mean(nu[1:] * nu[:-1]) / np.mean(nu**2),  # autocorrélation au premier pas
    }


def main():
    rng = np.random.default_rng(21)
    still = 3.0 + SIGMA_TRUE * rng.standard_normal(600)  # une minute devant un mur
    drive = sq.simulate(cart(Q_TRUE, SIGMA_TRUE**2), np.arange(0, 120, 1 / RATE_HZ), rng)
    R = np.var(still, ddof=1)
    tuned = sq.tune_by_nis(lambda v: cart(v["q"], R), [sq.Knob("q", 1.0, "m²/s³")], drive.log).values["q"]
    settings = {
        "R ÷ 100": (Q_TRUE, SIGMA_TRUE**2 / 100),
        "Q ÷ 1000": (Q_TRUE / 1000, SIGMA_TRUE**2),
        "réglé": (tuned, R),
    }
    runs, told = {}, {}
    for name, (q, noise) in settings.items():
        runs[name], told[name] = judge(q, noise, drive)
        say("{:9}: erreur {rms:.2f} m pour {announced:.2f} m annoncés ; dans ±2σ : {inside:.0f} % ; "
              "NIS {nis:.1f} ; innovations corrélées à {echo:+.2f}".format(name, **told[name]))  # fmt: skip

    small_r, small_q, right = (told[name] for name in settings)
    claim("P1", "vérité dans ±2σ, filtre réglé (95 % attendus)", right["inside"], "%", low=91, high=99)
    claim("P1", "vérité dans ±2σ, R ÷ 100", small_r["inside"], "%", high=35)
    claim("P1", "vérité dans ±2σ, Q ÷ 1000", small_q["inside"], "%", high=35)
    claim("P1", "erreur de position, R ÷ 100 sur réglé", small_r["rms"] / right["rms"], low=1.15)
    claim("P1", "erreur de position, Q ÷ 1000 sur réglé", small_q["rms"] / right["rms"], low=1.15)
    assert small_r["nis"] > 3, "R trop petit : NIS >> 1"
    assert small_q["nis"] > 1.5, "Q trop petit : NIS >> 1 aussi"
    assert abs(right["nis"] - 1) < 0.1, "réglé : NIS ≈ 1"
    assert small_r["echo"] < -0.2, "R trop petit : les innovations changent de signe"
    assert small_q["echo"] > 0.2, "Q trop petit : elles gardent le même"
    draw(drive, runs, told)


def draw(drive, runs, told):
    """L'erreur et ce que chacun en annonce ; à droite, la forme des innovations."""
    figure, axes = panels(
        1, 4, size=(16.0, 4.2), title="P1. R ou Q trop petit : un filtre trop sûr de lui, et le remède"
    )
    t = drive.log["range"].t * 1e-9
    window = (t > 60) & (t < 80)
    t, truth = t[window], drive.truth[window, 0]
    z = drive.log["range"].values[window, 0]
    for axis, (name, run), colour in zip(axes, runs.items(), (ORANGE, BLUE, GREEN), strict=False):
        error, sigma = run.mean[window, 0] - truth, np.sqrt(run.cov[window, 0, 0])
        axis.plot(t, z - truth, label="mesures", **READINGS)
        axis.fill_between(t, -2 * sigma, 2 * sigma, color=colour, alpha=0.25, label="±2σ annoncé")
        axis.plot(t, error, color=colour, label="estimation")
        axis.axhline(0.0, label="vérité", **TRUTH)
        title = f"{name} : vérité dans ±2σ à {told[name]['inside']:.0f} %"
        axis.set(title=title, xlabel="temps (s)", ylabel="erreur de position (m)", ylim=(-5.5, 4.5))
        axis.legend(loc="upper left", fontsize=8, ncols=2)
        nu = run.innovations["range"].residual[window, 0]
        level = -6 * list(runs).index(name)
        axes[3].plot(t, nu / np.sqrt(np.mean(nu**2)) + level, color=colour, label=name)
    axes[3].set(title="Innovations : en zigzag, en vagues, ou blanches", xlabel="temps (s)", yticks=[])
    axes[3].set_ylim(-16, 6.5)
    axes[3].legend(loc="upper center", ncols=3, fontsize=8)
    save(figure)


if __name__ == "__main__":
    main()
