"""D1 (★). Régler un Kalman comme un ingénieur : une température, rampe puis palier, 1 Hz, σ = 0,5 °C.

Une mesure aberrante de +8 °C tombe à t = 40 s.  État : (température, pente).  On compare avec un
passe-bas et une médiane : temps pour faire 90 % d'un échelon, et erreur RMS.  Sans pente dans l'état, ces
deux-là traînent pendant toute la rampe ; le Kalman, lui, croit encore à la pente après le coude, et dépasse.

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

Les étapes 6 à 8 s'automatisent : cet exemple écrit `mesures.csv` et `modele.py`, et
`factorlab tune mesures.csv --model modele.py:modele --method nis` trouve le même q.  Le défi noté, sur des
enregistrements que l'on ne connaît pas d'avance : `factorlab l19 defi mon_filtre.py`.
"""

import numpy as np
from scipy.stats import chi2

import sequential as sq
from factorlab.l19.challenge import public_trial
from factorlab.l19.challenge.files import TUNE, starting_files
from sequential.signal import measure_step_delay

SIGMA, GATE = 0.5, 0.999
MOST = chi2.ppf(GATE, 1)  # le seuil du portillon
TRIAL = public_trial()
T, TRUTH_C = TRIAL.t, TRIAL.truth


def kalman(z, q, R, gate=GATE, t=T):
    """Kalman (température, pente) sur les mesures z, prises aux instants t."""
    sensors = {"thermometre": sq.LinearSensor([[1.0, 0.0]], R, gate=gate)}
    prior = sq.Gaussian([z[0], 0.0], [1.0, 0.25])
    model = sq.StateSpace(sq.Vector(2), prior, sq.ConstantVelocity(q), sensors)
    return sq.run(sq.KalmanFilter(), model, sq.SensorLog({"thermometre": sq.Stream(t, z)}))


def mean_nis(z, q, R):
    """NIS moyen ; une mesure refusée compte pour le seuil, ni plus ni zéro.

    Ne compter que les mesures acceptées flatterait un q bien trop petit : il n'accepte que celles qui lui
    donnent raison.  Le diviseur est la moyenne d'un χ² ainsi plafonné.
    """
    nis = kalman(z, q, R).innovations["thermometre"].nis()
    capped = chi2.cdf(MOST, 3) + MOST * chi2.sf(MOST, 1)
    return float(np.mean(np.minimum(nis, MOST))) / capped


def tune_q(z, R, low=1e-5, high=1.0):
    """Le bouton q pour lequel le NIS moyen vaut 1."""
    for _ in range(25):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if mean_nis(z, middle, R) > 1.0 else (low, middle)
    return np.sqrt(low * high)


def tuned_by_command(folder):
    """Écrire l'enregistrement et le modèle, et régler q comme le fait `factorlab tune`."""
    from factorlab.compare.own import own_dataset
    from factorlab.tuning import tune_dataset

    folder.mkdir(parents=True, exist_ok=True)
    for name, text in starting_files(TRIAL).items():
        (folder / name).write_text(text, encoding="utf-8")
    dataset = own_dataset(folder / "mesures.csv", f"{folder / 'modele.py'}:modele")
    return tune_dataset(dataset, "nis").tuning


def rms(error):
    return float(np.sqrt(np.mean(error**2)))


def main():
    from claims import claim, table
    from figures import out_folder, say

    print("\n".join(__doc__.splitlines()[6:]))
    z = TRIAL.z
    R = np.var(z[TRIAL.rest], ddof=1)
    q = tune_q(z, R)
    seen = kalman(z, q, R).innovations["thermometre"]
    say(f"\nR : σ = {np.sqrt(R):.2f} °C ; refusées : t = {seen.t[~seen.accepted] // 1_000_000_000} s")
    folder = out_folder() / "defi_d1"
    found = tuned_by_command(folder)
    least, most = found.interval("q")
    print(f"dans {folder} :  {TUNE}")
    say(f"  q = {found.values['q']:.3g} °C²/s³, à 95 % de {least:.1g} à {most:.1g} : le NIS dépend peu de q")

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
        ramp[name], plateau[name] = rms(error[TRIAL.ramp]), rms(error[TRIAL.plateau])
        say(f"{name:24}{delay[name]:12.0f} s{ramp[name]:9.2f} °C{plateau[name]:9.2f} °C")

    rows = [(name, delay[name], ramp[name], plateau[name]) for name in filters]
    headings = "filtre", ("retard à 90 %", "s"), ("RMS rampe", "°C"), ("RMS palier", "°C")
    table("Un thermomètre : rampe, palier, aberrante", headings, rows)
    draw(z, R, q, outputs)
    claim("D1", "RMS du Kalman réglé sur la rampe", ramp["Kalman"], "°C", low=0.1, high=0.3)
    claim("D1", "RMS du passe-bas sur la rampe", ramp["passe-bas (a = 0,2)"], "°C", low=0.8, high=1.2)
    claim("D1", "RMS du Kalman réglé sur le palier", plateau["Kalman"], "°C", high=0.3)
    claim("D1", "retard du Kalman à 90 % d'un échelon", delay["Kalman"], "s", low=2, high=8)
    claim("D1", "q de factorlab tune sur q trouvé à la main", found.values["q"] / q, low=0.95, high=1.05)
    assert 0.35 < np.sqrt(R) < 0.65, "R mesuré sur 30 s de palier : à 13 % près en moyenne"
    assert abs(mean_nis(z, q, R) - 1.0) < 0.05, "Q réglé"
    assert not seen.accepted[40], "l'aberrante est refusée"
    assert np.sum(~seen.accepted) <= 3, "et presque rien d'autre"
    assert ramp["Kalman"] < 0.5 * ramp["médiane (k = 9)"], "il connaît la pente : pas de traînage"
    assert delay["médiane (k = 9)"] == median.response(1.0).delay_90
    assert delay["passe-bas (a = 0,2)"] == low.response(1.0).delay_90


def draw(z, R, q, outputs):
    from figures import BLUE, GREEN, ORANGE, PINK, READINGS, TRUTH, panels, save

    figure, (a, b, c) = panels(
        1, 3, size=(14.0, 4.3), title="D1. Une température : Kalman, passe-bas, médiane"
    )
    # loin de l'aberrante les deux Kalman se confondent : l'un est plus épais
    looks = (GREEN, 3.0), (PINK, 1.3), (BLUE, 1.5), (ORANGE, 1.5)
    for axes in (a, b):
        axes.plot(T, z, label="mesures", **READINGS)
        for (name, y), (colour, width) in zip(outputs.items(), looks, strict=True):
            axes.plot(T, y, color=colour, linewidth=width, label=name)
        axes.plot(T, TRUTH_C, label="vérité", **TRUTH)
        axes.set(xlabel="temps (s)", ylabel="température (°C)")
    a.set(title="L'aberrante de +8 °C à t = 40 s", xlim=(30, 60), ylim=(26, 44))
    b.set(title="Fin de rampe", xlim=(105, 150), ylim=(44, 53))
    a.legend(loc="upper right", fontsize=8, ncols=2)
    grid = np.logspace(-5, 0, 25)
    c.semilogx(grid, [mean_nis(z, value, R) for value in grid], color=BLUE, marker=".", label="NIS moyen")
    c.axhline(1.0, color="black", linewidth=0.8)
    c.plot(q, 1.0, "o", color=ORANGE, label=f"q choisi : {q:.1g} °C²/s³".replace(".", ","))
    c.set(title="Choisir Q par le NIS", xlabel="densité q (°C²/s³)", ylabel="NIS (sans unité)")
    c.legend()
    save(figure)


if __name__ == "__main__":
    main()
