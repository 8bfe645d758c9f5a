"""F1. Un capteur réel : bruit, biais, et pourquoi il faut fusionner.

Le bruit d'un capteur ne dérive pas, mais il est là ; un biais, lui, s'accumule quand on intègre.
Question du cours : pourquoi intégrer deux fois un accéléromètre est-il sans espoir à long terme ?  Parce
qu'un biais b, même petit, devient une erreur de position ½bt² qui grandit sans limite, et que rien dans
la mesure ne la révèle ; le bruit seul s'accumule aussi, mais bien plus lentement.  La fusion prend le court
terme de l'un (le gyromètre, lisse mais qui dérive) et le long terme de l'autre (l'accéléromètre, bruité mais
qui sait toujours où est le bas).

Avec FACTORLAB_DATA, l'histogramme est celui d'un vrai MPU-6050 immobile ; sinon il est simulé.
"""

import os
from pathlib import Path

import numpy as np

import sequential as sq

G = 9.80665
RATE_HZ = 100.0


def still_readings(rng, count=1000):
    """Accélérations (m/s²) d'un capteur immobile, et d'où elles viennent."""
    folder = os.environ.get("FACTORLAB_DATA")
    recording = Path(folder or "") / "imu/mpu6050/imu_static_test.csv"
    if folder and recording.is_file():
        raw = np.loadtxt(recording, delimiter=",", skiprows=5, usecols=0, max_rows=count)
        return raw / 16384.0 * G, "MPU-6050 réel"
    return np.round((0.35 + 0.02 * rng.standard_normal(count)) * 16384 / G) * G / 16384, "simulé"


def integrate_twice(acceleration, dt):
    """Position (m) depuis l'arrêt."""
    speed = np.cumsum(acceleration) * dt
    return np.cumsum(speed) * dt


def main():
    from claims import claim
    from figures import BLUE, GREEN, ORANGE, READINGS, TRUTH, panels, save

    rng = np.random.default_rng(1)
    still, origin = still_readings(rng)
    sigma = np.std(still, ddof=1)
    within = np.mean(np.abs(still - still.mean()) < sigma)

    # un accéléromètre immobile, biais b = 0,05 m/s² (5 mg), intégré deux fois
    t = np.arange(1, 6001) / RATE_HZ
    bias = 0.05
    position = integrate_twice(bias + sigma * rng.standard_normal(len(t)), 1 / RATE_HZ)
    noise_only = integrate_twice(sigma * rng.standard_normal(len(t)), 1 / RATE_HZ)

    # une inclinaison : gyromètre biaisé de 0,5 °/s, accéléromètre bruité de 3°
    truth = 20 * np.sin(0.5 * t)
    rate = 10 * np.cos(0.5 * t) + 0.5 + 0.1 * rng.standard_normal(len(t))
    tilt = truth + 3 * rng.standard_normal(len(t))
    gyro_alone = np.cumsum(rate) / RATE_HZ
    fused = sq.Complementary(time_constant=1.0)(t, tilt, rate=rate)
    error = {
        name: np.sqrt(np.mean((y - truth)[500:] ** 2))
        for name, y in [("gyro", gyro_alone), ("accel", tilt), ("fused", fused)]
    }

    figure, (a, b, c) = panels(1, 3, size=(12.5, 3.8), title="F1. Un capteur réel ment un peu, tout le temps")
    lsb = G / 16384
    centred = still - still.mean()
    edges = np.arange(centred.min() - lsb / 2, centred.max() + lsb, 4 * lsb)
    a.hist(
        centred * 1e3,
        bins=edges * 1e3,
        density=True,
        color="#c8d8e8",
        label=f"1000 mesures\n({origin}, axe x)",
    )
    grid = np.linspace(-4 * sigma, 4 * sigma, 200)
    gauss = np.exp(-0.5 * (grid / sigma) ** 2) / (sigma * 1e3 * np.sqrt(2 * np.pi))
    a.plot(grid * 1e3, gauss, color=BLUE, label=f"gaussienne, σ = {sigma * 1e3:.1f} mm/s²")
    a.set(title="Le bruit, au repos", xlabel="écart à la moyenne (mm/s²)", ylabel="densité (s²/mm)")
    a.set_ylim(0, 2.0 * gauss.max())
    a.legend(loc="upper left")
    b.plot(t, position, color=ORANGE, label="biais 0,05 m/s² et bruit")
    b.plot(t, 0.5 * bias * t**2, label="½ b t²", **TRUTH)
    b.plot(t, noise_only, color=BLUE, label="bruit seul")
    b.set(title="Accélération intégrée deux fois", xlabel="temps (s)", ylabel="position (m), immobile")
    b.legend()
    c.plot(t, tilt, label="accéléromètre", **READINGS)
    c.plot(t, gyro_alone, color=ORANGE, label="gyromètre intégré")
    c.plot(t, fused, color=GREEN, label="fusion (τ = 1 s)")
    c.plot(t, truth, label="vérité", **TRUTH)
    c.set(title="Court terme de l'un, long terme de l'autre", xlabel="temps (s)", ylabel="inclinaison (°)")
    c.set_ylim(-32, 75)
    c.legend(loc="upper left", ncols=2)
    save(figure)

    # ½bt² = 90 m ; le bruit seul ne fait qu'un mètre
    claim("F1", "erreur de position après 60 s, biais de 0,05 m/s²", position[-1], "m", low=85, high=95)
    claim("F1", "erreur de position après 60 s, bruit seul", abs(noise_only[-1]), "m", high=5)
    claim("F1", "σ de l'accéléromètre au repos", 1e3 * sigma, "mm/s²", low=15, high=50, source=origin)
    claim("F1", "inclinaison par le gyromètre seul, erreur RMS", error["gyro"], "°", low=10, high=25)
    claim("F1", "inclinaison par l'accéléromètre seul, erreur RMS", error["accel"], "°", low=2.7, high=3.3)
    claim("F1", "inclinaison par la fusion, erreur RMS", error["fused"], "°", high=1.0)
    assert 0.6 < within < 0.75, "environ 68 % des mesures sont à moins d'un σ"


if __name__ == "__main__":
    main()
