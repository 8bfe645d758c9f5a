"""TP5. Vision + IMU : le gyromètre prédit, le marqueur corrige, et chacun répare le défaut de l'autre.

Un marqueur collé sur une centrale inertielle, devant une caméra fixe.  La caméra donne son orientation à
15 Hz, sans dérive mais bruitée, et parfois retournée : un petit carré admet deux lectures (TP4 b).  Le
gyromètre mesure à 100 Hz, presque sans bruit, mais son biais s'intègre : des dizaines de degrés en une
demi-minute.  L'état du Kalman est l'orientation et le biais ; il prédit avec le gyromètre, corrige avec le
marqueur, et entre deux lectures prend la plus vraisemblable : la prédiction reconnaît l'image retournée.

Le filtre ne connaît que le passé ; le lisseur, sur le même modèle, relit aussi l'avenir.  L'image est rendue,
donc la vérité est connue.  Sur vos fichiers (caméra étalonnée en TP4 a) :
`python examples/l19/49_tp5_vision_imu.py --video film.mp4 --imu imu.csv --camera camera.json --taille 0.05`
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import sequential as sq
from factorlab.markers import MarkersSettings, read_markers
from factorlab.markers.attitudes import attitude_readings
from sequential.attitude import roll_pitch_yaw
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply
from sequential.readers import read_imu
from sequential.sensors import ImuErrors, ImuRecording, simulate_imu, tumble
from vision3d.camera import Camera
from vision3d.markers import detect_markers, marker_poses
from vision3d.render import Plane, marker_texture, render_planes

CAMERA = Camera("brown5", (530, 531, 322, 240), (-0.28, 0.08, 1e-3, -2e-4, 0.02), (640, 480))
DICTIONARY, SIZE_M, FPS, SECONDS = "4x4_50", 0.05, 15.0, 20.0
NOISE = sq.ImuNoise(gyro_density=1e-3, accel_density=1e-2, gyro_bias_walk=3e-4, accel_bias_walk=1e-4)
BIAS = np.radians([2.0, -1.5, 1.0])
ROTATIONS = sq.SO3()


@dataclass
class Recording:
    """Les deux flux, et la vérité (temps en ns -> quaternions) là où elle est connue."""

    gyro: ImuRecording
    marker: sq.Stream
    truth: object = None


def rendered(rng):
    """Vingt secondes à la main : 300 images, 2000 mesures du gyromètre."""
    motion = tumble(SECONDS, rng, angle=0.14, sway=0.0, period=(1.5, 6.0))
    gyro = simulate_imu(motion, rng, rate=100.0, errors=ImuErrors(noise=NOISE, gyro_bias=BIAS)).recording
    t = np.arange(0.0, SECONDS, 1.0 / FPS)
    texture, poses = marker_texture(DICTIONARY, 7, SIZE_M), []
    for q in motion.attitude(t)[0]:
        plane = Plane(np.append(ROTATIONS.normalize(q), [0.12, -0.06, 1.1]), texture)
        image = render_planes(CAMERA, [plane], rng=rng, noise=6.0, blur_px=0.8)
        found = detect_markers(image, DICTIONARY, camera=CAMERA)
        poses.append(marker_poses(CAMERA, found, SIZE_M)[0] if found else None)
    return Recording(gyro, attitude_readings(t, poses), lambda ns: motion.attitude(ns * 1e-9)[0])


def recorded(files):
    """Vos fichiers ; les deux horloges commencent ensemble, à `--decalage` secondes près."""
    settings = MarkersSettings(camera=files.camera, size_m=files.taille, track=False)
    seen = [one for one in read_markers(str(files.video), settings).readings if one.pose is not None]
    number = max({one.id for one in seen}, key=[one.id for one in seen].count)
    seen = [one for one in seen if one.id == number]
    marker = attitude_readings([one.t_s for one in seen], [one.pose for one in seen])
    gyro = read_imu(files.imu)
    start = marker.t[0] + round(files.decalage * 1e9)
    return Recording(ImuRecording(gyro.t - gyro.t[0] + start, gyro.accel, gyro.gyro), marker)


def declare(start, q, cov, *, free):
    """L'état (orientation, biais) et ses modèles ; `free` : apprendre aussi comment le marqueur est collé."""
    mount = {"mount": sq.SO3()} if free else {}
    state = sq.Product(attitude=sq.SO3(), gyro_bias=sq.Vector(3), **mount)
    mean, spread = state.identity(), np.diag(np.repeat([0.0, 0.1**2, 0.2**2], 3)[: state.dim])
    mean[:4], spread[:3, :3] = q, cov
    if free:  # on voit le marqueur : si la centrale est tournée d'un côté, il l'est de l'autre
        spread[:3, :3] += spread[6:, 6:]
        spread[:3, 6:] = spread[6:, :3] = -spread[6:, 6:]
    sensor = sq.TwoModeOrientation(1e-3, mount="mount" if free else None)
    process, static = sq.GyroAttitude(NOISE), tuple(mount)
    return sq.StateSpace(
        state, sq.Gaussian(mean, spread), process, {"marker": sensor}, "gyro", start=start, static=static
    )


def fuse(estimator, recording):
    """Part de chacune des deux lectures de la première image, et garde l'histoire la plus vraisemblable."""
    gyro, marker = recording.gyro, recording.marker
    first, others = marker.select(np.arange(1)), marker.select(np.arange(1, len(marker)))
    # entre deux mesures, la moyenne des deux vitesses : l'intégration devient du second ordre
    rates = sq.Stream(gyro.t[:-1], 0.5 * (gyro.gyro[1:] + gyro.gyro[:-1]))
    at = gyro.t[(gyro.t > first.t[0]) & (gyro.t < marker.t[-1])]
    log, runs = sq.SensorLog({"gyro": rates, "marker": others}), []
    for q in (first.context[0, :4], first.context[0, 4:8]):
        if q.any():
            free = recording.truth is None
            model = declare(int(first.t[0]), q, first.noise_cov[0], free=free)
            runs.append(sq.run(estimator, model, log, at=at))
    return max(runs, key=lambda run: run.log_likelihood)


def marker_of(run):
    """L'orientation du marqueur : celle de la centrale, et comment il y est collé."""
    if "mount" not in run.manifold.parts:
        return run.mean[:, :4]
    return quaternion_multiply(run.mean[:, :4], run.part("mount"))


def integrate(recording):
    """Le gyromètre seul, depuis la première lecture : (temps, quaternions)."""
    gyro, q = recording.gyro, [recording.marker.values[0]]
    rows = np.flatnonzero(gyro.t >= recording.marker.t[0])
    for k, dt in zip(rows, np.diff(gyro.t[rows]) * 1e-9, strict=False):
        q.append(quaternion_multiply(q[-1], quaternion_exp(gyro.gyro[k] * dt)))
    return gyro.t[rows], np.array(q)


def main():
    from claims import claim
    from figures import panels, save, say

    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("video", "imu", "camera"):
        parser.add_argument(f"--{name}", type=Path)
    parser.add_argument("--taille", type=float, default=SIZE_M, help="côté du marqueur, m")
    parser.add_argument("--decalage", type=float, default=0.0, help="retard de l'IMU sur la vidéo, s")
    files, rest = parser.parse_known_args()
    sys.argv[1:] = rest
    recording = recorded(files) if files.video else rendered(np.random.default_rng(5))

    filtered = fuse(sq.ExtendedKalmanFilter(), recording)
    smoothed = fuse(sq.IteratedSmoother(), recording)
    t, alone = integrate(recording)
    curves = {
        "caméra seule": (recording.marker.t, recording.marker.context[:, :4]),
        "gyromètre seul": (t, alone),
        "fusion (filtre)": (filtered.t, marker_of(filtered)),
        "fusion (lisseur)": (smoothed.t, marker_of(smoothed)),
    }
    bias = np.degrees(filtered.mean[-1, 4:7])
    say(f"{len(recording.marker)} images lues, biais trouvé {bias.round(2)} °/s")
    figure, axes = panels(1, 3, size=(13.0, 4.2), title="TP5. Vision + IMU : trois courbes d'une orientation")
    draw_curves(axes[0], curves, recording)
    draw_bias(axes[2], filtered, recording)
    if recording.truth is None:  # pas de vérité : l'écart de chaque image au lisseur
        seen = recording.marker.t[1:]
        gaps = {
            "caméra seule": off(recording.marker.context[1:, :4], marker_of(smoothed)[smoothed.index(seen)])
        }
        draw_errors(axes[1], {"caméra seule": (seen, None)}, gaps, "Écart au lisseur")
        save(figure)
        claim("TP5", "images où le marqueur est lu", len(recording.marker), source=files.video.name)
        claim("TP5", "biais du gyromètre, norme", np.linalg.norm(bias), "°/s", source=files.video.name)
        return
    errors = {name: off(q, recording.truth(t)) for name, (t, q) in curves.items()}
    rmse = {name: np.degrees(np.sqrt(np.mean(np.sum(e**2, axis=1)))) for name, e in errors.items()}
    for name, value in rmse.items():
        say(f"  {name:<17} {value:6.2f}° RMSE")
    flipped = np.mean(np.linalg.norm(errors["caméra seule"], axis=1) > np.radians(12.0))
    found = {"filtre": nees(filtered, recording), "lisseur": nees(smoothed, recording)}
    say(f"lectures retournées {100 * flipped:.0f} % ; NEES (3 attendu) : "
          + ", ".join(f"{name} {value:.1f}" for name, value in found.items()))  # fmt: skip
    draw_errors(axes[1], curves, errors)
    save(figure)

    camera, gyro, fused, both = rmse.values()
    claim("TP5", "fusion (filtre) : erreur d'orientation", fused, "° RMS", high=0.6)
    claim("TP5", "fusion (lisseur), qui connaît l'avenir", both, "° RMS", high=0.3)
    claim("TP5", "caméra seule", camera, "° RMS", low=1.0)
    claim("TP5", "gyromètre seul", gyro, "° RMS", low=10.0)
    claim("TP5", "biais du gyromètre : pire erreur", np.abs(bias - np.degrees(BIAS)).max(), "°/s", high=0.4)
    for name, value in found.items():
        claim("TP5", f"NEES du {name} (3 attendu)", value, low=0.8, high=6.0)


def off(q, truth):
    """Vecteurs de rotation (N, 3) de l'estimée à la vérité, rad."""
    return ROTATIONS.local(ROTATIONS.normalize(q), ROTATIONS.normalize(truth))


def nees(run, recording):
    """Erreur d'orientation au carré, en écarts-types annoncés : 3 en moyenne."""
    error = off(run.mean[:, :4], recording.truth(run.t))
    return np.mean(np.einsum("ni,nij,nj->n", error, np.linalg.inv(run.cov[:, :3, :3]), error))


def draw_curves(axes, curves, recording):
    """L'angle autour de x (roulis) : caméra, gyromètre, fusion."""
    import figures

    style = (figures.READINGS, {"color": figures.ORANGE}, {"color": figures.BLUE})
    for (name, (t, q)), look in zip(list(curves.items())[:3], style, strict=True):
        axes.plot(t * 1e-9, np.degrees(np.unwrap(roll_pitch_yaw(q)[:, 0])), label=name, **look)
    t = curves["fusion (filtre)"][0]
    if recording.truth is not None:
        angle = np.degrees(roll_pitch_yaw(recording.truth(t))[:, 0])
        axes.plot(t * 1e-9, angle, label="vérité", **figures.TRUTH)
    low, high = axes.get_ylim()
    axes.set(title="Rotation autour de x", xlabel="temps (s)", ylabel="angle (°)")
    axes.set_ylim(low, high + 0.35 * (high - low))
    axes.legend(loc="upper left", ncols=2)


def draw_errors(axes, curves, errors, title="Erreur"):
    """L'angle d'erreur des quatre, en échelle logarithmique."""
    import figures

    style = (figures.READINGS, {"color": figures.ORANGE}, {"color": figures.BLUE}, {"color": figures.GREEN})
    for (name, error), look in zip(errors.items(), style, strict=False):
        size = np.degrees(np.linalg.norm(error, axis=1))
        axes.plot(curves[name][0] * 1e-9, np.maximum(size, 1e-2), label=name, **look)
    axes.set(title=title, xlabel="temps (s)", ylabel="erreur (°)", yscale="log", ylim=(2e-2, 2e3))
    axes.legend(loc="upper left", ncols=2)


def draw_bias(axes, run, recording):
    """Le biais appris, avec ± 3 σ."""
    import figures

    t, band = run.t * 1e-9, 3.0 * np.degrees(run.sigmas()[:, 3:6])
    for k, colour in enumerate((figures.BLUE, figures.ORANGE, figures.GREEN)):
        bias = np.degrees(run.mean[:, 4 + k])
        axes.plot(t, bias, color=colour, label="xyz"[k])
        axes.fill_between(t, bias - band[:, k], bias + band[:, k], color=colour, alpha=0.2, linewidth=0)
        if recording.truth is not None:
            axes.axhline(np.degrees(BIAS[k]), color=colour, linestyle="--", linewidth=1.0)
    axes.set(title="Biais du gyromètre, ± 3 σ", xlabel="temps (s)", ylabel="biais (°/s)", ylim=(-5.0, 6.0))
    axes.legend(loc="upper right", ncols=3)


if __name__ == "__main__":
    main()
