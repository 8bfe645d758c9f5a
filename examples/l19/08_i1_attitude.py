"""I1. L'attitude : complémentaire, Kalman avec biais, puis les quaternions de Madgwick et de Mahony.

L'accéléromètre donne le bas, le magnétomètre le nord, le gyromètre ce qui se passe entre deux mesures.  Le
complémentaire et le Kalman (angle + biais) suivent roulis et tangage tant que le tangage reste loin de 90° ;
en 3-D, Madgwick descend le gradient de l'écart, Mahony le corrige par un proportionnel-intégral, et les
quaternions n'ont pas d'angle singulier.

Aucun filtre ne répare un capteur mal étalonné : trois étalonnages sont obligatoires, biais du gyromètre au
repos, accéléromètre en six positions, ellipsoïde du magnétomètre.  Les mêmes filtres, avant et après.  Avec
FACTORLAB_DATA, ils suivent aussi un essai réel de BROAD, dont la vérité vient de caméras.
"""

import os
from pathlib import Path

import numpy as np

import sequential as sq
from sequential.attitude import ComplementaryAttitude, Madgwick, Mahony, TiltKalman
from sequential.evaluate import attitude_error
from sequential.readers import read_broad
from sequential.sensors import (
    SIX_POSITIONS,
    AffineCalibration,
    ImuCalibration,
    ImuErrors,
    MagnetometerEllipsoid,
    MultiPosition,
    find_dwells,
    simulate_imu,
    stationary,
    tumble,
    waypoints,
)

FILTERS = {
    "complémentaire": ComplementaryAttitude(),
    "Kalman (angle + biais)": TiltKalman(),
    "Madgwick": Madgwick(),
    "Mahony": Mahony(),
}
# une centrale à 5 euros, telle qu'on l'achète
ERRORS = ImuErrors(
    noise=sq.ImuNoise(2e-4, 2e-3, 1e-5, 1e-4),
    gyro_bias=np.radians([2.5, -1.5, 1.0]),
    accel_bias=[0.4, -0.3, 0.5],
    accel_matrix=[[1.02, 0.0, 0.0], [0.01, 0.98, 0.0], [-0.01, 0.02, 1.03]],
    mag_matrix=[[1.1, 0.05, 0.0], [0.05, 0.9, 0.02], [0.0, 0.02, 1.0]],
    mag_offset=[12.0, -8.0, 15.0],
    mag_sigma=0.4,
)


def calibrate(rng):
    """Les trois étalonnages, chacun de son enregistrement."""
    from figures import say

    still = simulate_imu(stationary(30.0), rng, errors=ERRORS, field=None).recording
    positions = simulate_imu(waypoints(SIX_POSITIONS), rng, errors=ERRORS, field=None).recording
    turns = simulate_imu(tumble(120.0, rng, angle=1.5, sway=0.0), rng, errors=ERRORS).recording
    bias = still.gyro.mean(axis=0)
    gyro = AffineCalibration(np.eye(3), bias, None, "gyro", "rad/s", "rad/s", 0.0)
    accel = MultiPosition().calibrate(find_dwells(positions))
    mag = MagnetometerEllipsoid(field=47.4).calibrate(turns)
    for what, found, unit in (
        ("gyromètre au repos, biais", np.degrees(bias), "°/s"),
        ("accéléromètre en six positions, décalage", accel.calibration.offset, "m/s²"),
        ("magnétomètre, centre de l'ellipsoïde", mag.calibration.offset, "µT"),
    ):
        say(f"{what:41}: ({' ; '.join(f'{value:.2f}' for value in found)}) {unit}")
    return ImuCalibration(accel.calibration, gyro, mag.calibration)


def errors_of(recording, truth, where=None):
    """RMS total, de cap et d'inclinaison de chaque filtre, degrés."""
    return {
        name: attitude_error(one.estimate(recording).world_q_body, truth, where).degrees
        for name, one in FILTERS.items()
    }


def show(title, found):
    """Une ligne par filtre."""
    from figures import say

    print(title)
    for name, (total, heading, inclination) in found.items():
        say(f"  {name:<24} {total:6.2f}° (cap {heading:5.2f}°, inclinaison {inclination:5.2f}°)")


def main():
    from claims import claim
    from figures import panels, save

    rng = np.random.default_rng(12)
    constants = calibrate(rng)
    motion = tumble(90.0, rng, angle=0.25, sway=0.02, rest=5.0)
    raw, truth = simulate_imu(motion, rng, errors=ERRORS)
    moving = raw.seconds > 10.0
    before = errors_of(raw, truth.world_q_body, moving)
    after = errors_of(constants.apply(raw), truth.world_q_body, moving)
    show("sans étalonnage :", before)
    show("avec les trois étalonnages :", after)
    real = broad()

    figure, axes = panels(1, 2 if real is None else 3, size=(13.0, 4.2), title="I1. L'attitude")
    draw_errors(axes[0], before, after)
    draw_yaw(axes[1], raw, constants.apply(raw), truth)
    if real is not None:
        show("essai réel de BROAD :", real)
        draw_bars(axes[2], {"BROAD 05": real})
        axes[2].set(title="Essai réel de BROAD (déjà étalonné)", xlabel="filtre")
    save(figure)

    moved, source = (after, "simulé") if real is None else (real, "BROAD 05 réel")
    claim("I1", "Mahony, mouvement de la main, erreur RMS", moved["Mahony"][0], "°", high=1.5, source=source)
    for name in FILTERS:
        claim("I1", f"{name}, centrale étalonnée, erreur RMS", after[name][0], "°", high=1.5)
    best = min(found[0] for found in before.values())
    claim("I1", "le meilleur des quatre, sans étalonnage", best, "°", low=20)
    if real is not None:  # de vraies mains poussent l'accéléromètre
        assert real["Mahony"][0] < min(real["complémentaire"][0], real["Kalman (angle + biais)"][0])


def broad():
    """Les filtres sur l'essai 05 de BROAD (rotation lente), s'il est là."""
    folder = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "imu/broad"
    found = sorted(folder.glob("05_*.npz"))
    if not found:
        return None
    recording, truth = read_broad(found[0])
    return errors_of(recording, truth.world_q_body, truth.movement)


def draw_bars(axes, columns):
    """Barres groupées : une couleur par colonne, un groupe par filtre."""
    import figures

    places = np.arange(len(FILTERS))
    colours = (figures.ORANGE, figures.BLUE) if len(columns) > 1 else (figures.GREEN,)
    for k, ((label, found), colour) in enumerate(zip(columns.items(), colours, strict=True)):
        shift = 0.4 * (k - 0.5 * (len(columns) - 1))
        values = [found[name][0] for name in FILTERS]
        drawn = axes.bar(places + shift, values, 0.38, color=colour, label=label)
        axes.bar_label(drawn, fmt="%.1f", fontsize=8)
    axes.set(ylabel="erreur RMS (°)", xticks=places)
    axes.set_xticklabels([name.replace(" (", "\n(") for name in FILTERS], fontsize=8)


def draw_errors(axes, before, after):
    """L'effet des étalonnages."""
    draw_bars(axes, {"sans étalonnage": before, "avec": after})
    axes.set(title="Étalonner, puis filtrer", yscale="log")
    axes.set_ylim(top=12 * max(values[0] for values in before.values()))
    axes.legend(loc="upper right")


def draw_yaw(axes, raw, calibrated, truth):
    """Le lacet de Mahony, avant et après, et la vérité."""
    import figures

    from sequential.attitude import roll_pitch_yaw

    t = raw.seconds
    for recording, colour, label in (
        (raw, figures.ORANGE, "sans étalonnage"),
        (calibrated, figures.BLUE, "avec"),
    ):
        yaw = np.unwrap(Mahony().estimate(recording).roll_pitch_yaw()[:, 2])
        axes.plot(t, np.degrees(yaw), color=colour, label=label)
    true = np.unwrap(roll_pitch_yaw(truth.world_q_body)[:, 2])
    axes.plot(t, np.degrees(true), label="vérité", **figures.TRUTH)
    axes.set(title="Le lacet par Mahony", xlabel="temps (s)", ylabel="lacet (°)")
    axes.set_ylim(top=1.45 * axes.get_ylim()[1])
    axes.legend(loc="upper right")


if __name__ == "__main__":
    main()
