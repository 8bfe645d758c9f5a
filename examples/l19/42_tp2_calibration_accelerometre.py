"""TP2. Étalonner un accéléromètre : six positions, puis beaucoup.

    étalonné = gain · (brut - décalage), axe par axe

Posé sans bouger, l'accéléromètre ne lit que la pesanteur : ‖étalonné‖ = g, quelle que soit la position.
Avec chaque axe vers le haut puis vers le bas, six équations pour six inconnues, par moindres carrés.
Un septième défaut ne se voit pas ainsi : les axes ne sont pas tout à fait perpendiculaires ; il faut des
positions penchées (neuf inconnues, une dizaine de positions au moins).

La preuve se fait sur une position que l'étalonnage n'a pas vue : chacune est prédite par les autres.
Données : MPU-6050 tenu en dix positions (FACTORLAB_DATA), simulées quand le dossier manque.
"""

import os
from pathlib import Path

import numpy as np

from sequential.noise import ImuNoise
from sequential.readers import read_imu
from sequential.sensors import (
    SIX_POSITIONS,
    ImuErrors,
    MultiPosition,
    find_dwells,
    simulate_imu,
    waypoints,
)

G = 9.81
GAINS, OFFSETS = np.array([1.02, 0.99, 0.97]), np.array([0.4, -0.2, -1.1])


def simulated(attitudes, rng):
    """Un capteur bon marché, posé dans ces attitudes (K, 4)."""
    skewed = np.diag(1 / GAINS) @ np.array([[1.0, 0.0, 0.0], [0.01, 1.0, 0.0], [-0.008, 0.012, 1.0]])
    errors = ImuErrors(noise=ImuNoise(1e-4, 4e-3, 0.0, 0.0), accel_matrix=skewed, accel_bias=OFFSETS)
    return simulate_imu(waypoints(attitudes, 3.0, 1.0), rng, errors=errors, gravity=G, field=None).recording


def real_or_simulated(rng):
    """L'enregistrement du MPU-6050, ou à défaut dix positions simulées."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "")) / "imu" / "mpu6050"
    file = folder / "example_data_calibration.csv"
    if file.is_file():
        return read_imu(file)
    return simulated(rng.standard_normal((10, 4)), rng)


def six_by_hand(means):
    """Gain et décalage par axe (moindres carrés de Gauss-Newton sur ‖étalonné‖² = g²), means (K, 3)."""
    gain, offset = np.ones(3), np.zeros(3)
    for _ in range(20):
        a = gain * (means - offset)
        residual = np.sum(a**2, axis=1) - G**2
        J = np.hstack([2 * a * (means - offset), -2 * a * gain])
        step = np.linalg.lstsq(J, -residual, rcond=None)[0]
        gain, offset = gain + step[:3], offset + step[3:]
    return gain, offset


def main():
    from figures import BLUE, ORANGE, panels, save

    rng = np.random.default_rng(2)
    # six positions simulées : à la main, et par la bibliothèque
    six = find_dwells(simulated(SIX_POSITIONS, rng))
    gain, offset = six_by_hand(six.accel)
    library = MultiPosition(gravity=G, shears=False, six=True).calibrate(six).calibration
    tilted = find_dwells(simulated(rng.standard_normal((12, 4)), rng)).accel
    before, after = (np.linalg.norm(a, axis=1) - G for a in (tilted, gain * (tilted - offset)))
    print(f"six positions : gain {gain.round(4)}, décalage {offset.round(3)} m/s²")
    print(f"douze positions penchées : écart à g {rms(before):.3f} m/s² brut, {rms(after):.3f} étalonné")

    # dix positions réelles : chacune prédite par les neuf autres
    recording = real_or_simulated(rng)
    dwells = find_dwells(recording)
    many = MultiPosition(gravity=G).calibrate(dwells)
    print(f"{recording.name}, {len(dwells)} positions : écart à g {rms(many.before):.3f} m/s² brut, "
          f"{many.leave_one_out_rms:.4f} sur une position jamais vue")  # fmt: skip
    for name, kept in zip(("yx", "zx", "zy"), many.fit.kept[3:6], strict=True):
        if kept > 0.7:
            print(f"  aucune position ne montre l'angle {name} : il en faudrait une à 45° entre les deux")

    figure, (a, b) = panels(1, 2, size=(11.0, 3.9), title="TP2. À l'arrêt, la norme doit être g")
    k = np.arange(1, len(dwells) + 1)
    a.bar(k, many.before, color=ORANGE)
    a.set(title="brut : ‖moyenne‖ − g", xlabel="position", ylabel="m/s²")
    b.bar(k - 0.2, many.after, 0.4, color=BLUE, label="étalonné sur toutes")
    b.plot(k + 0.2, many.left_out, "o", color=ORANGE, label="étalonné sans cette position")
    b.axhline(0.0, color="black", linewidth=0.8)
    b.set(title="étalonné (autre échelle !)", xlabel="position", ylabel="m/s²")
    b.legend()
    save(figure)

    np.testing.assert_allclose(np.diag(library.matrix), gain, atol=1e-3)
    np.testing.assert_allclose(library.offset, offset, atol=5e-3)
    assert rms(after) < 0.2 * rms(before), "six positions suffisent au gain et au décalage"
    assert many.leave_one_out_rms < 0.02, "une position jamais vue donne g à 0,2 % près"
    assert many.leave_one_out_rms < 0.1 * rms(many.before)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
