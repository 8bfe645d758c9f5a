"""TP2. Calibrer un accéléromètre : six positions, la preuve à 45°, puis une position jamais vue.

    calibré = gain · (brut - décalage), axe par axe

Posé sans bouger, l'accéléromètre ne lit que la pesanteur : ‖calibré‖ = g, quelle que soit la position.
Avec chaque axe vers le haut puis vers le bas, six équations pour six inconnues, par moindres carrés.
Est-ce que cela suffit ?  On vérifie à 45° : il y reste un défaut que six positions ne montrent pas, des axes
qui ne sont pas tout à fait perpendiculaires.  Il faut des positions penchées (neuf inconnues, une dizaine
de positions au moins), et l'erreur à 45° tombe au bruit.

Sur un vrai capteur on ne connaît pas les 45° exactement ; la preuve se fait alors sur une position que la
calibration n'a pas vue : chacune est prédite par les autres.  Données : MPU-6050 tenu en dix positions
(FACTORLAB_DATA), simulées quand le dossier manque ; ou les vôtres :
`python examples/l19/42_tp2_calibration_accelerometre.py MES_POSITIONS.csv`
"""

import os
from pathlib import Path

import numpy as np

from sequential.manifold.quaternion import quaternion_exp
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
TILTS = [
    (45.0, 0, 0),
    (-45, 0, 0),
    (135, 0, 0),
    (-135, 0, 0),
    (0, 45, 0),
    (0, -45, 0),
    (0, 135, 0),
    (0, -135, 0),
]
GAINS, OFFSETS = np.array([1.02, 0.99, 0.97]), np.array([0.4, -0.2, -1.1])


def simulated(attitudes, rng):
    """Un capteur bon marché, posé dans ces attitudes (K, 4)."""
    skewed = np.diag(1 / GAINS) @ np.array([[1.0, 0.0, 0.0], [0.01, 1.0, 0.0], [-0.008, 0.012, 1.0]])
    errors = ImuErrors(noise=ImuNoise(1e-4, 4e-3, 0.0, 0.0), accel_matrix=skewed, accel_bias=OFFSETS)
    return simulate_imu(waypoints(attitudes, 3.0, 1.0), rng, errors=errors, gravity=G, field=None).recording


def record(rng):
    """Vos positions, celles du vrai capteur, ou dix positions simulées ; et ce que c'est."""
    from figures import files_given

    for given in files_given():
        return read_imu(given), Path(given).name
    folder = os.environ.get("FACTORLAB_DATA")
    real = Path(folder or "") / "imu/mpu6050/example_data_calibration.csv"
    if folder and real.is_file():
        return read_imu(real), "MPU-6050 réel"
    return simulated(rng.standard_normal((10, 4)), rng), "simulé"


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
    from claims import claim, table
    from figures import save, say

    rng = np.random.default_rng(2)
    # six positions simulées : à la main, et par la bibliothèque
    six = find_dwells(simulated(SIX_POSITIONS, rng))
    gain, offset = six_by_hand(six.accel)
    library = MultiPosition(gravity=G, shears=False, six=True).calibrate(six).calibration
    nine = MultiPosition(gravity=G).calibrate(find_dwells(simulated(rng.standard_normal((12, 4)), rng)))
    at_45 = find_dwells(simulated(quaternion_exp(np.radians(TILTS)), rng)).accel
    errors = {
        "brut": np.linalg.norm(at_45, axis=1) - G,
        "six positions": np.linalg.norm(gain * (at_45 - offset), axis=1) - G,
        "douze positions penchées": np.linalg.norm(nine.calibration.apply(at_45), axis=1) - G,
    }
    say(f"six positions : gain {gain.round(4)}, décalage {offset.round(3)} m/s²")
    for name, error in errors.items():
        say(f"  à 45°, {name} : écart à g {rms(error):.4f} m/s² RMS")

    # de vraies positions : chacune prédite par les autres
    recording, origin = record(rng)
    dwells = find_dwells(recording)
    many = MultiPosition(gravity=G, shears=len(dwells) > 9).calibrate(dwells)
    say(f"{recording.name}, {len(dwells)} positions : écart à g {rms(many.before):.3f} m/s² brut, "
        f"{many.leave_one_out_rms:.4f} sur une position jamais vue")  # fmt: skip
    if len(dwells) > 9:
        for name, kept in zip(("yx", "zx", "zy"), many.fit.kept[3:6], strict=True):
            if kept > 0.7:
                print(f"  aucune position ne montre l'angle {name} : il en faudrait une à 45° entre les deux")

    save(draw(errors, many, origin))
    scale, shift = np.diag(many.calibration.matrix), many.calibration.offset
    rows = [["simulé, six positions", *gain, *offset], [origin, *scale, *shift]]
    headings = ("capteur", *(f"gain {k}" for k in "xyz"), *((f"décalage {k}", "m/s²") for k in "xyz"))
    table("Gains et décalages trouvés", headings, rows)
    known = origin in {"MPU-6050 réel", "simulé"}
    if np.isfinite(many.leave_one_out_rms):
        claim("TP2", "écart RMS à g d'une position jamais vue", many.leave_one_out_rms, "m/s²",
              high=0.02 if known else None, source=origin)  # fmt: skip
    else:
        print("chacune de ces positions est indispensable : tenez-en une de plus, à 45°, pour vérifier")
    claim("TP2", "écart RMS à g, calibré", rms(many.after), "m/s²", high=0.02, source=origin)
    claim("TP2", "écart RMS à g, brut", rms(many.before), "m/s²", low=0.4 if known else None, source=origin)
    claim("TP2", "à 45°, brut : écart RMS à g", rms(errors["brut"]), "m/s²", low=0.3)
    claim("TP2", "à 45°, six positions", rms(errors["six positions"]), "m/s²", low=0.02, high=0.1)
    claim("TP2", "à 45°, neuf inconnues", rms(errors["douze positions penchées"]), "m/s²", high=0.01)
    claim("TP2", "gain à la main et par la bibliothèque, pire écart",
          np.abs(np.diag(library.matrix) - gain).max(), high=1e-3)  # fmt: skip
    np.testing.assert_allclose(library.offset, offset, atol=5e-3)


def draw(errors, many, origin):
    """À 45° avant et après, puis chaque position du vrai capteur."""
    from figures import BLUE, GREEN, ORANGE, panels

    figure, (first, a, b) = panels(1, 3, size=(14.0, 4.0), title="TP2. À l'arrêt, la norme doit être g")
    tilt = np.arange(1, len(TILTS) + 1)
    for (name, error), colour in zip(errors.items(), (ORANGE, BLUE, GREEN), strict=True):
        first.semilogy(tilt, np.maximum(np.abs(error), 1e-4), "o-", color=colour, label=name)
    first.set(title="À 45° (simulé)", xlabel="position penchée", ylabel="|‖a‖ − g| (m/s²)", ylim=(5e-5, 90))
    first.legend(loc="upper right")
    k = np.arange(1, len(many.before) + 1)
    a.bar(k, many.before, color=ORANGE)
    a.set(title=f"Brut ({origin})", xlabel="position", ylabel="‖moyenne‖ − g (m/s²)")
    b.bar(k - 0.2, many.after, 0.4, color=BLUE, label="calibré sur toutes")
    b.plot(k + 0.2, many.left_out, "o", color=ORANGE, label="calibré sans cette position")
    b.axhline(0.0, color="black", linewidth=0.8)
    b.set(title="Calibré (autre échelle !)", xlabel="position", ylabel="‖moyenne‖ − g (m/s²)")
    b.set_ylim(top=1.45 * np.nanmax(np.abs(many.left_out)))
    b.legend(loc="upper right")
    return figure


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
