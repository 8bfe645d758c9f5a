"""C1. Caractériser un capteur : huit questions à poser avant d'écrire le moindre filtre.

Bruit : l'écart-type σ de 1000 mesures immobiles, et R = σ².  Biais : leur moyenne moins la vérité.  Dérive :
la tendance sur une heure, et la pente selon la température.  Non-linéarité : un télémètre infrarouge suit
1/d, une droite n'y suffit pas : il faut un modèle inverse, ou une table.  Résolution : le pas (LSB) ;
moyenner 4 mesures gagne 1 bit, si le bruit dépasse un demi-pas.  Latence : la réponse à un échelon, à
compenser dans le filtre.  Valeurs aberrantes : fréquence et amplitude, pour choisir la médiane ou le
portillon.  Variance d'Allan : jusqu'à quand moyenner un gyromètre sert, et d'où vient Q.

Toutes ces réponses d'un coup : `factorlab characterize FICHIER --lang fr`.

Avec FACTORLAB_DATA, le bruit est celui d'un vrai MPU-6050 ; les autres questions ont une vérité simulée.
"""

import os
from pathlib import Path

import figures
import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, READINGS, TRUTH, say

from sequential.sensors import allan_deviation, characterize, fit_noise, step_response
from sequential.sensors.characterize_resolution import oversampling_of

HOUR = 3600.0


def still_gyro(rng, count=1000):
    """Vitesses angulaires (°/s) d'un gyromètre immobile à 100 Hz, et d'où elles viennent."""
    folder = os.environ.get("FACTORLAB_DATA")
    recording = Path(folder or "") / "imu/mpu6050/imu_static_test.csv"
    if folder and recording.is_file():
        return np.loadtxt(
            recording, delimiter=",", skiprows=5, usecols=3, max_rows=count
        ) / 131.0, "MPU-6050 réel"
    return np.round((-3.3 + 0.075 * rng.standard_normal(count)) * 131.0) / 131.0, "simulé"


def noise_and_bias(panel, rng):
    """σ et biais de 1000 mesures immobiles, et leur histogramme."""
    x, origin = still_gyro(rng)
    rest = characterize(np.arange(1000) * 0.01, x, name="gx", unit="°/s")
    sigma, bias, distance = rest.noise.sigma, rest.bias, rest.distribution.distance
    claim("C1", "bruit du gyromètre au repos, σ", sigma.value, "°/s", low=0.06, high=0.09, source=origin)
    say(f"σ entre {sigma.low:.4f} et {sigma.high:.4f} °/s (95 %) ; R = σ² = {sigma.value**2:.2e} (°/s)²")
    say(f"biais : {bias.value:.3f} °/s, entre {bias.low:.3f} et {bias.high:.3f} ; "
          f"écart à la loi normale : {100 * distance:.1f} % des mesures")  # fmt: skip
    panel.hist(
        rest.residual,
        rest.distribution.edges,
        density=True,
        color="#c8d8e8",
        label=f"1000 mesures\n({origin})",
    )
    grid = np.linspace(-4 * sigma.value, 4 * sigma.value, 200)
    gauss = np.exp(-0.5 * (grid / sigma.value) ** 2) / (sigma.value * np.sqrt(2 * np.pi))
    panel.plot(grid, gauss, color=BLUE, label=f"gaussienne, σ = {sigma.value:.3f} °/s")
    panel.set(title="Bruit : R = σ²", xlabel="écart à la moyenne (°/s)", ylabel="densité (s/°)")
    panel.set_ylim(0, 1.7 * gauss.max())
    assert rest.distribution.nearly_normal, "un bruit gaussien, ou presque"
    return [f"R = σ² = {sigma.value**2:.1e} (°/s)²", f"biais à soustraire : {bias.value:.2f} °/s"]


def drift(panel, rng):
    """Une heure d'un gyromètre qui chauffe de 10 °C : son biais suit la température, 0,08 °/s par °C."""
    t = np.arange(0.0, HOUR)
    warm = 22.0 + 10.0 * t / HOUR + 0.5 * np.sin(t / 500)
    x = 0.08 * (warm - 25.0) + 0.1 * rng.standard_normal(len(t))
    found = characterize(t, x, unit="°/s", temperature=warm)
    slope, per_degree = found.drift.scaled(HOUR), found.per_degree
    say(f"dérive : {slope.value:.2f} °/s en une heure, entre {slope.low:.2f} et {slope.high:.2f}")
    claim(
        "C1",
        "dérive selon la température (vraie : 0,08)",
        per_degree.value,
        "°/s par °C",
        low=0.07,
        high=0.09,
    )
    panel.plot(warm[::5], x[::5], label="mesures", **READINGS)
    k = per_degree.value
    panel.plot(warm, x.mean() + k * (warm - warm.mean()), color=ORANGE, label=f"{k:.3f} °/s par °C")
    panel.set(title="Dérive : une heure, 10 °C", xlabel="température (°C)", ylabel="vitesse angulaire (°/s)")
    panel.set_ylim(-0.8, 1.3)
    assert abs(slope.value - 0.8) < 0.1, "0,08 °/s par °C fois 10 °C par heure"
    return [f"dérive : {1e3 * k:.0f} millièmes de °/s par °C"]


def non_linearity(panel, rng):
    """Un télémètre infrarouge, v = a/(d+b) + c : le modèle inverse contre une droite."""
    d, far = np.linspace(0.1, 0.8, 15), np.linspace(0.08, 0.85, 200)
    v = 0.22 / (d + 0.04) + 0.1 + 0.005 * rng.standard_normal(len(d))
    line = np.polyfit(v, d, 1)
    b = min(np.linspace(0.0, 0.1, 101), key=lambda b: np.polyfit(1 / (d + b), v, 1, full=True)[1][0])
    a, c = np.polyfit(1 / (d + b), v, 1)
    error, inverse = np.abs(np.polyval(line, v) - d).max(), np.abs(a / (v - c) - b - d).max()
    claim("C1", "télémètre IR, pire erreur d'une droite", 100 * error, "cm", low=10)
    claim("C1", "télémètre IR, pire erreur du modèle inverse", 100 * inverse, "cm", high=3)
    curve = a / (far + b) + c
    panel.plot(v, 100 * d, "o", color="#555555", label="étalonnage")
    panel.plot(curve, 100 * far, color=GREEN, label="d = a/(v − c) − b")
    panel.plot(curve, 100 * np.polyval(line, curve), color=ORANGE, label="droite")
    panel.set(title="Non-linéarité : IR ∝ 1/d", xlabel="tension (V)", ylabel="distance (cm)", ylim=(-15, 100))
    return []


def resolution(panel, rng):
    """Suréchantillonner : 1 bit pour ×4, si le bruit dépasse un demi-pas."""
    fine, coarse = (oversampling_of(np.round(0.3 + s * rng.standard_normal(40_000))) for s in (1.0, 0.02))
    claim("C1", "bits gagnés en moyennant 64 mesures, bruit de 1 LSB", fine.bits[3], low=2.9, high=3.1)
    panel.plot(fine.factor, fine.expected, label="théorie : 1 bit pour ×4", **TRUTH)
    panel.errorbar(fine.factor, fine.bits, 2 * fine.error, color=GREEN, marker="o", label="bruit de 1 LSB")
    panel.plot(coarse.factor, coarse.bits, color=ORANGE, marker="s", label="bruit de 0,02 LSB")
    panel.set(title="Suréchantillonnage", xlabel="mesures par moyenne", ylabel="bits gagnés", xscale="log")
    assert coarse.bits[3] < 0.1, "toutes arrondies pareil : moyenner ne gagne rien"
    return []


def latency(panel, rng):
    """La réponse à un échelon : retard pur de 40 ms, puis premier ordre de 150 ms."""
    s = np.arange(0.0, 3.0, 0.01)
    seen = np.where(s > 1.04, -np.expm1(-(s - 1.04) / 0.15), 0.0) + 0.02 * rng.standard_normal(len(s))
    found = step_response(s, seen, at=1.0)
    late, tau = found.latency.value, found.time_constant.value
    say(f"latence : {1e3 * late:.0f} ms, puis τ = {1e3 * tau:.0f} ms, bande {found.bandwidth.value:.2f} Hz")
    panel.plot(s, seen, label="mesures", **READINGS)
    panel.plot(s, 1.0 * (s > 1.0), label="entrée", **TRUTH)
    panel.plot(s, found.fitted, color=BLUE, label=f"ajustée, τ = {1e3 * tau:.0f} ms")
    panel.set(
        title="Latence et bande passante", xlabel="temps (s)", ylabel="sortie (sans unité)", xlim=(0.8, 2.2)
    )
    assert found.latency.low < 0.04 < found.latency.high
    assert found.time_constant.low < 0.15 < found.time_constant.high
    return [f"dater les mesures {1e3 * (late + tau):.0f} ms plus tôt"]


def outliers(panel, rng):
    """25 valeurs aberrantes en une heure : combien, de combien."""
    x = 0.05 * rng.standard_normal(36_000)
    bad = rng.choice(len(x), 25, replace=False)
    x[bad] += rng.choice([-1.0, 1.0], 25) * rng.uniform(1.0, 2.0, 25)
    t = np.arange(len(x)) * 0.1
    found = characterize(t, x, unit="m").outliers
    say(f"aberrantes : {found.count} en une heure, {found.typical:.1f} m ({found.typical_sigmas:.0f} σ)")
    panel.plot(t / 60, x, label="mesures", rasterized=True, **READINGS)
    panel.plot(t[found.where] / 60, x[found.where], "x", color=ORANGE, label=f"{found.count} aberrantes")
    panel.set(title="Valeurs aberrantes", xlabel="temps (min)", ylabel="erreur (m)")
    assert set(bad) == set(np.flatnonzero(found.where)), "toutes les aberrantes, et rien d'autre"
    return [f"portillon : {found.per_hour:.0f} aberrantes par heure"]


def allan(panel, rng, rate=20.0, N=0.01, K=3e-4):
    """Une heure de gyromètre : bruit blanc N (°/s/√Hz), biais qui marche au hasard, K (°/s²/√Hz)."""
    count = int(HOUR * rate)
    bias = np.cumsum(K / np.sqrt(rate) * rng.standard_normal(count))
    gyro = N * np.sqrt(rate) * rng.standard_normal(count) + bias
    seen, fit = allan_deviation(gyro, rate), fit_noise(gyro, rate, unit="°/s")
    tau, best = seen.tau, seen.tau[np.argmin(fit.deviation(seen.tau))]
    say(f"Allan : N = {fit.N.value:.4f} °/s/√Hz, K = {fit.K.value:.1e} °/s²/√Hz ; "
        f"Q du biais = K² = {fit.K.value**2:.1e} (°/s)²/s")  # fmt: skip
    claim("C1", "durée au-delà de laquelle moyenner n'aide plus (√3 N/K = 58 s)", best, "s", low=20, high=200)
    panel.fill_between(tau, seen.low, seen.high, color=BLUE, alpha=0.2)
    panel.loglog(tau, seen.deviation, color=BLUE, label="mesuré")
    panel.loglog(tau, fit.N.value / np.sqrt(tau), "--", color="black", label="N/√τ, pente −1/2")
    panel.loglog(tau, fit.K.value * np.sqrt(tau / 3), ":", color=ORANGE, label="K√(τ/3), pente +1/2")
    panel.axvline(best, color=GREEN, label=f"moyenner jusqu'à {best:.0f} s")
    panel.set(title="Variance d'Allan", xlabel="durée de moyenne τ (s)", ylabel="écart-type d'Allan (°/s)")
    panel.set_ylim(0.5 * seen.deviation.min(), 2 * seen.deviation.max())
    assert fit.K.low < K < fit.K.high, "K, dont vient Q, est dans son intervalle"
    return [f"Q du biais = K² = {fit.K.value**2:.1e} (°/s)²/s"]


def main():
    rng = np.random.default_rng(11)
    figure, axes = figures.panels(2, 4, size=(17.0, 7.6), title="C1. Caractériser un capteur")
    questions = (noise_and_bias, drift, non_linearity, resolution, latency, outliers, allan)
    told = [word for question, panel in zip(questions, axes, strict=False) for word in question(panel, rng)]
    for panel in axes[:-1]:
        panel.legend(fontsize=8)
    axes[-1].axis("off")
    axes[-1].text(0.0, 0.9, "Ce que le filtre en reçoit\n\n" + "\n\n".join(told), va="top", fontsize=11)
    figures.save(figure)


if __name__ == "__main__":
    main()
