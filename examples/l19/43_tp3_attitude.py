"""TP3. L'inclinaison hors ligne : complémentaire, puis Kalman (angle + biais), et tous deux sous les chocs.

On règle comme en K2 : R est mesuré au repos, où l'angle de l'accéléromètre a l'écart-type σ_a / g ; Q est la
densité du gyromètre qui donne un NIS moyen de 1 sur le mouvement.  Elle sort plus grande que le bruit du
gyromètre au repos : les accélérations de la main, que R ignore, y entrent.  Le complémentaire laisse b·τ
d'erreur pour un biais b ; le Kalman estime b.  Un choc, lui, trompe l'accéléromètre pendant quelques
échantillons : sans portillon, le Kalman réglé sur le mouvement tranquille le croit, plus que le
complémentaire ; avec un portillon de Mahalanobis, il le refuse.

Ce qui se porte en C sur la carte est un pas : `filtre.step(état, gyro, accel, None, dt)`, que le C doit
reproduire à partir du même état.  Avec FACTORLAB_DATA, les bruits sont ceux d'un vrai MPU-6050 immobile.
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

import sequential as sq
from sequential.attitude import ComplementaryAttitude, TiltKalman, roll_pitch_yaw, tilt
from sequential.readers import read_imu
from sequential.sensors import ImuErrors, ImuRecording, simulate_imu, tumble

RATE_HZ = 100.0
BIAS_DEG_S = [1.5, -1.0, 0.5]


def noises():
    """Écarts-types par échantillon du gyromètre (rad/s) et de l'accéléromètre (m/s²), et leur origine."""
    recording = Path(os.environ.get("FACTORLAB_DATA") or "") / "imu/mpu6050/imu_static_test.csv"
    if os.environ.get("FACTORLAB_DATA") and recording.is_file():
        still = read_imu(recording)  # les unités sont devinées : 16384 LSB/g, 131 LSB/(°/s)
        return still.gyro.std(axis=0).mean(), still.accel.std(axis=0).mean(), "d'un vrai MPU-6050"
    return np.radians(0.1), 0.03, "simulés"


def record(rng):
    """10 s au repos, 60 s à la main ; le même avec 14 chocs de 50 ms ; les angles vrais (N, 2) en degrés."""
    sigma_gyro, sigma_accel, origin = noises()
    per_root_hz = 1 / np.sqrt(RATE_HZ)
    noise = sq.ImuNoise(sigma_gyro * per_root_hz, sigma_accel * per_root_hz, 1e-5, 0.0)
    errors = ImuErrors(noise=noise, gyro_bias=np.radians(BIAS_DEG_S))
    motion = tumble(70.0, rng, angle=0.1, sway=0.01, period=(2.0, 8.0), rest=10.0)
    quiet, truth = simulate_imu(motion, rng, rate=RATE_HZ, errors=errors, field=None)
    accel = quiet.accel.copy()
    for start in range(2000, 6900, 350):
        accel[start : start + 5] += rng.normal(scale=15.0, size=3) * np.hanning(7)[1:-1, None]
    knocked = ImuRecording(quiet.t, accel, quiet.gyro, name="chocs")
    return quiet, knocked, np.degrees(roll_pitch_yaw(truth.world_q_body)[:, :2]), origin


def with_q(kalman, model):
    """Le modèle du roulis en fonction de q, pour la recherche de Q."""

    def declare(values):
        tuned = replace(kalman, gyro_density=values["q"])
        return replace(tuned.model("roll", float(model.prior.mean[0])), start=model.start)

    return declare


def angles(estimator, recording):
    """Roulis et tangage (N, 2), degrés."""
    return np.degrees(estimator.estimate(recording).roll_pitch_yaw()[:, :2])


def main():
    from figures import panels, save

    quiet, knocked, truth, origin = record(np.random.default_rng(3))
    rest = quiet.slice(0.0, 9.5)
    sigma = float(np.std(tilt(rest.accel)[:, 0], ddof=1))
    bias = rest.gyro.mean(axis=0)
    print(f"au repos (bruits {origin}) : σ = {np.degrees(sigma):.3f}°, R = σ² = {sigma**2:.2e} rad²")
    print(f"biais du gyromètre : {np.degrees(bias).round(2)} °/s")

    kalman = TiltKalman(tilt_sigma=sigma, bias_walk=1e-5)
    model, log = kalman.channel(quiet, "roll")
    declare = with_q(kalman, model)
    tuned = sq.tune_by_nis(declare, [sq.Knob("q", 1e-3, "rad/s/√Hz")], log)
    q = tuned.values["q"]
    nis = np.mean(sq.run(sq.KalmanFilter(), declare(tuned.values), log).innovations["roll"].nis())
    q_rest = float(np.std(rest.gyro[:, 0])) / np.sqrt(RATE_HZ)
    print(f"Q par le NIS : {q:.1e} rad/s/√Hz (bruit du gyromètre au repos : {q_rest:.1e}), NIS = {nis:.2f}")

    kalman = replace(kalman, gyro_density=q)
    filters = {
        "complémentaire, τ = 1 s": ComplementaryAttitude(time_constant=1.0),
        "Kalman (angle + biais)": kalman,
        "Kalman, portillon à 99,9 %": replace(kalman, gate=0.999),
    }
    paths, rms = {}, {}
    for name, one in filters.items():
        paths[name] = angles(one, knocked)
        errors = [(angles(one, quiet) - truth)[1500:], (paths[name] - truth)[1500:]]
        rms[name] = [float(np.sqrt(np.mean(e**2))) for e in errors]
        worst = [float(np.abs(e).max()) for e in errors]
        print(f"{name:<28} sans choc {rms[name][0]:.2f}° (pire {worst[0]:.1f}°), "
              f"avec chocs {rms[name][1]:.2f}° (pire {worst[1]:.1f}°)")  # fmt: skip

    figure, (a, b, c) = panels(1, 3, size=(13.0, 4.0), title="TP3. Inclinaison : R au repos, Q par le NIS")
    draw_q(a, declare, log, q)
    draw_knock(b, knocked, truth, paths)
    draw_bars(c, rms)
    save(figure)

    complementary, plain, gated = rms.values()
    found = np.degrees(kalman.estimate(quiet).gyro_bias[-1, :2])
    assert np.abs(found - BIAS_DEG_S[:2]).max() < 0.3, "le Kalman trouve le biais"
    assert complementary[0] > 3 * plain[0], "que le complémentaire laisse dans l'angle"
    assert abs(nis - 1) < 0.1, "NIS moyen de 1"
    assert q > 1.2 * q_rest, "Q doit couvrir aussi les accélérations de la main"
    assert plain[1] > 3 * plain[0], "un choc trompe le Kalman"
    assert gated[1] < 1.2 * plain[0], "le portillon le refuse"


def draw_q(a, declare, log, q):
    """Le NIS moyen en fonction de q."""
    import figures

    grid = np.logspace(-4, -1.5, 16)
    runs = [sq.run(sq.KalmanFilter(), declare({"q": value}), log) for value in grid]
    mean = [np.mean(run.innovations["roll"].nis()) for run in runs]
    a.semilogx(grid, mean, ".-", color=figures.BLUE, label="NIS moyen")
    a.axhline(1.0, color="black", linewidth=0.8)
    a.plot(q, 1.0, "o", color=figures.ORANGE, label=f"q choisi : {q:.1e}")
    a.set(title="Q : un NIS moyen de 1", xlabel="densité du gyromètre q (rad/s/√Hz)", ylabel="NIS moyen")
    a.legend()


def draw_knock(b, recording, truth, paths):
    """Un choc de près : l'accéléromètre, les filtres, la vérité."""
    import figures

    t = recording.seconds
    worst = 2000 + 350 * int(np.argmax([np.abs(tilt(recording.accel[k : k + 5]) - np.radians(truth[k])).max()
                                        for k in range(2000, 6900, 350)]))  # fmt: skip
    rows = slice(worst - 60, worst + 180)
    b.plot(t[rows], np.degrees(tilt(recording.accel[rows])[:, 0]), label="accéléromètre", **figures.READINGS)
    for (name, path), colour in zip(paths.items(), (figures.SKY, figures.ORANGE, figures.GREEN), strict=True):
        b.plot(t[rows], path[rows, 0], color=colour, label=name)
    b.plot(t[rows], truth[rows, 0], label="vérité", **figures.TRUTH)
    middle = float(truth[rows, 0].mean())
    b.set(title="Un choc", xlabel="temps (s)", ylabel="roulis (°)", ylim=(middle - 22, middle + 30))
    b.legend(loc="upper right", fontsize=7.5)


def draw_bars(c, rms):
    """Erreurs RMS avec et sans chocs."""
    import figures

    places = np.arange(len(rms))
    values = np.array(list(rms.values()))
    c.bar(places - 0.2, values[:, 0], 0.38, color=figures.BLUE, label="sans choc")
    c.bar(places + 0.2, values[:, 1], 0.38, color=figures.ORANGE, label="avec chocs")
    c.set(title="Erreur RMS", ylabel="erreur (°)", xticks=places)
    c.set_xticklabels([name.replace(", ", ",\n").replace(" (", "\n(") for name in rms], fontsize=8)
    c.legend()


if __name__ == "__main__":
    main()
