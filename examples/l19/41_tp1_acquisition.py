"""TP1. Acquisition : un MPU-6050 ou un téléphone, immobile puis en mouvement, à 100 Hz.

`python examples/l19/41_tp1_acquisition.py MON_FICHIER.csv` lit votre enregistrement (colonnes t, ax, ay, az,
gx, gy, gz ; l'export d'un téléphone convient aussi) et répond au TP : la partie immobile, trouvée seule ;
σ par axe ; biais du gyromètre ; variance d'Allan.  Faut-il 10 minutes immobiles ?  Le bruit blanc (pente
-1/2) se lit en quelques secondes ; le plateau demande que la durée dépasse plusieurs fois le temps où la
courbe se couche.  Quand il ne se voit pas, on donne une borne, pas une valeur.

Sans fichier : le vrai MPU-6050 immobile de FACTORLAB_DATA (449 s), sinon un enregistrement simulé de 10 min.
"""

import os
from pathlib import Path

import numpy as np

from sequential import ImuNoise
from sequential.readers import read_imu
from sequential.sensors import ImuErrors, StillDetector, characterize, imu_noise, simulate_imu, tumble

AXES = ("x", "y", "z")
BANDS = {  # quantité -> tolérance, là où le capteur est connu
    "MPU-6050 réel": {
        "bruit blanc du gyromètre, N moyen des axes": (0.0088, 0.0098),
        "biais du gyromètre, norme": (3.5, 3.6),
        "σ de l'accéléromètre, moyenne des axes": (0.034, 0.037),
        "partie immobile trouvée": (7.4, 7.5),
        "angle dérivé, biais soustrait / biais laissé": (0.0, 0.1),
        "N par Allan / σ des pas sur √cadence, pire axe": (0.9, 1.1),
    },
    "simulé": {
        "bruit blanc du gyromètre, N moyen des axes": (0.0087, 0.0097),
        "biais du gyromètre, norme": (3.4, 3.7),
        "σ de l'accéléromètre, moyenne des axes": (0.034, 0.038),
        "partie immobile trouvée": (9.9, 10.1),
        "angle dérivé, biais soustrait / biais laissé": (0.0, 0.1),
        "N par Allan / σ des pas sur √cadence, pire axe": (0.9, 1.1),
    },
}
NOISE = ImuNoise(gyro_density=1.6e-4, accel_density=3.6e-3, gyro_bias_walk=6e-6, accel_bias_walk=1e-5)


def record(rng, minutes=10.0):
    """Votre fichier, le vrai capteur, ou dix minutes simulées suivies d'un mouvement ; et ce que c'est."""
    from figures import files_given

    for given in files_given():
        return read_imu(given), Path(given).name
    folder = os.environ.get("FACTORLAB_DATA")
    real = Path(folder or "") / "imu/mpu6050/example_data_tinit_calc.csv"
    if folder and real.is_file():
        return read_imu(real, kind="mpu6050"), "MPU-6050 réel"
    errors = ImuErrors(NOISE, gyro_bias=np.radians([-3.3, 1.1, -0.5]), accel_bias=[0.3, -0.2, 0.4])
    motion = tumble(60.0 * minutes + 30.0, rng, rest=60.0 * minutes)
    return simulate_imu(motion, rng, errors=errors, field=None).recording, "simulé"


def still_part(recording):
    """La plus longue partie immobile, sans sa première ni sa dernière demi-seconde, où la main est là."""
    rows = max(StillDetector().find(recording), key=len)
    edge = round(0.5 * recording.rate)
    return recording.select(rows[edge:-edge])


def describe(still):
    """σ, moyenne, pas et valeurs aberrantes de chaque axe."""
    found = {}
    print(f"{'axe':4}{'σ':>12}{'intervalle à 95 %':>24}{'moyenne':>12}{'LSB':>11}{'aberrantes':>12}")
    for sensor, unit in (("accel", "m/s²"), ("gyro", "rad/s")):
        for k, axis in enumerate(AXES):
            one = characterize(still.t, getattr(still, sensor)[:, k], name=sensor[0] + axis, unit=unit)
            found[one.name], sigma = one, one.noise.sigma
            print(f"{one.name:4}{sigma.value:12.5f}{sigma.low:14.5f}{sigma.high:10.5f}{one.bias.value:12.4f}"
                  f"{one.resolution.lsb:11.6f}{one.outliers.count:12d}  {unit}")  # fmt: skip
    return found


def plateau(noise):
    """Ce que la durée permet de lire : N toujours, le plateau B s'il se voit, sinon sa borne."""
    print(f"{'axe':4}{'N (°/s/√Hz)':>14}{'plateau B (°/s)':>18}{'il faudrait':>16}")
    for axis, fit in zip(AXES, noise.fits["gyro"], strict=True):
        seen = fit.B.visible
        words = f"{np.degrees(fit.B.value):.5f}" if seen else f"< {np.degrees(fit.B.high):.5f}"
        needed = "" if seen else f"{fit.seconds_needed('B', fit.B.high / 2) / 60:.0f} min"
        print(f"g{axis:3}{np.degrees(fit.N.value):14.5f}{words:>18}{needed:>16}")
    told = ("gyro_density", "accel_density", "gyro_bias_walk")
    print("à déclarer au filtre : " + ", ".join(f"{k} = {getattr(noise.noise, k):.2e}" for k in told))


def draw_allan(panel, noise, sensor, scale, unit):
    """Les trois axes d'un capteur, et la droite de pente -1/2 de leur bruit blanc."""
    from figures import BLUE, GREEN, ORANGE

    of = noise.deviations[sensor]
    for axis, k, colour in zip(AXES, range(3), (BLUE, ORANGE, GREEN), strict=True):
        N = scale * noise.fits[sensor][k].N.value
        panel.fill_between(of.tau, scale * of.low[:, k], scale * of.high[:, k], color=colour, alpha=0.15)
        label = f"{sensor[0]}{axis} : N = {N:.2g} {unit}/√Hz".replace(".", ",")
        panel.loglog(of.tau, scale * of.deviation[:, k], color=colour, label=label)
        panel.loglog(of.tau, N / np.sqrt(of.tau), ":", color=colour, linewidth=1)
    name = "accéléromètre" if sensor == "accel" else "gyromètre"
    panel.set(
        title=f"Écart-type d'Allan, {name}", xlabel="durée de moyenne τ (s)", ylabel=f"écart-type ({unit})"
    )
    panel.set_ylim(0.4 * scale * of.deviation.min(), 2 * scale * of.deviation.max())


def report(origin, axes, noise):
    """Le tableau du compte rendu : une ligne par axe."""
    from claims import table

    rows = []
    for sensor, scale in (("accel", 1.0), ("gyro", 180 / np.pi)):
        for axis, fit in zip(AXES, noise.fits[sensor], strict=True):
            one = axes[sensor[0] + axis]
            flat = f"{scale * fit.B.value:.2g}" if fit.B.visible else f"< {scale * fit.B.high:.2g}"
            found = [one.noise.sigma.value, one.bias.value, one.resolution.lsb, fit.N.value]
            rows.append([one.name, "m/s²" if sensor == "accel" else "°/s", *(scale * v for v in found),
                         flat.replace(".", ","), one.outliers.count])  # fmt: skip
    headings = ("axe", "unité", "σ", "moyenne", "LSB", ("N", "unité/√Hz"), "plateau B", "aberrantes")
    table(f"Capteur immobile ({origin}), par axe", headings, rows)


def main():
    from claims import claim
    from figures import GREEN, ORANGE, READINGS, panels, save

    recording, origin = record(np.random.default_rng(12))
    still = still_part(recording)
    print(f"{origin} : {recording.duration:.0f} s à {recording.rate:.0f} Hz, immobile {still.duration:.0f} s")
    axes, noise = describe(still), imu_noise(still)
    bias = np.array([axes["g" + axis].bias.value for axis in AXES])
    worst = int(np.argmax(np.abs(bias)))
    print("biais du gyromètre : " + ", ".join(f"{b:.3f}" for b in np.degrees(bias)) + " °/s ; sans le "
          f"soustraire, {60 * np.degrees(abs(bias[worst])):.1f}° d'erreur par minute")  # fmt: skip
    plateau(noise)

    figure, (raw, turned, gyro, accel) = panels(2, 2, size=(13.0, 8.4), title=f"TP1. Acquisition ({origin})")
    shown = np.unique(np.linspace(0, len(recording) - 1, 6000).astype(int))
    raw.plot(recording.seconds[shown] / 60, np.degrees(recording.gyro[shown, 0]), label="gx", **READINGS)
    ends = (still.t[[0, -1]] - recording.t[0]) / 60e9
    raw.axvspan(*ends, color=GREEN, alpha=0.15, label="partie immobile, trouvée")
    raw.set(title="L'enregistrement", xlabel="temps (min)", ylabel="vitesse angulaire (°/s)")
    left, taken = (np.degrees(np.cumsum(still.gyro[:, worst] - b)) / still.rate for b in (0.0, bias[worst]))
    turned.plot(still.seconds / 60, left, color=ORANGE, label="biais laissé")
    turned.plot(still.seconds / 60, taken, color=GREEN, label="biais soustrait")
    turned.set(title=f"g{AXES[worst]} intégré, capteur immobile", xlabel="temps (min)", ylabel="angle (°)")
    draw_allan(gyro, noise, "gyro", 180 / np.pi, "°/s")
    draw_allan(accel, noise, "accel", 1.0, "m/s²")
    for panel in (raw, turned, gyro, accel):
        panel.legend(loc="best")
    save(figure)

    report(origin, axes, noise)
    N = np.degrees([fit.N.value for fit in noise.fits["gyro"]])
    steps = np.degrees([axes["g" + axis].noise.step_sigma for axis in AXES])
    sigma = np.mean([axes["a" + axis].noise.sigma.value for axis in AXES])
    # les tolérances sont celles du capteur connu ; d'un autre, on dit ce qu'il est
    known = BANDS.get(origin, {})

    def told(quantity, value, unit):
        low, high = known.get(quantity, (None, None))
        claim("TP1", quantity, value, unit, low=low, high=high, source=origin)

    told("bruit blanc du gyromètre, N moyen des axes", N.mean(), "°/s/√Hz")
    told("biais du gyromètre, norme", np.degrees(np.linalg.norm(bias)), "°/s")
    told("σ de l'accéléromètre, moyenne des axes", sigma, "m/s²")
    told("partie immobile trouvée", still.duration / 60, "min")
    told("angle dérivé, biais soustrait / biais laissé", np.abs(taken).max() / np.abs(left).max(), "")
    told("N par Allan / σ des pas sur √cadence, pire axe", np.max(N * np.sqrt(still.rate) / steps), "")


if __name__ == "__main__":
    main()
