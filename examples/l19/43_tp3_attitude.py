"""TP3. L'inclinaison hors ligne : complémentaire, puis Kalman (angle + biais), et tous deux sous les chocs.

On règle comme en K2 : R est mesuré au repos, où l'angle de l'accéléromètre a l'écart-type σ_a / g ; Q est la
densité du gyromètre qui donne un NIS moyen de 1 sur le mouvement.  Elle sort plus grande que le bruit du
gyromètre au repos : les accélérations de la main, que R ignore, y entrent.  Le complémentaire laisse b·τ
d'erreur pour un biais b ; le Kalman estime b.  Un choc, lui, trompe l'accéléromètre pendant quelques
échantillons : sans portillon, le Kalman réglé sur le mouvement tranquille le croit, plus que le
complémentaire ; avec un portillon de Mahalanobis, il le refuse.

Ce qui se porte en C sur la carte est un pas : `filtre.step(état, gyro, accel, None, dt)`, que le C doit
reproduire à partir du même état.  Avec FACTORLAB_DATA, les bruits sont ceux d'un vrai MPU-6050 immobile.

`python examples/l19/43_tp3_attitude.py MES_CHOCS.csv` lit votre enregistrement : immobile dix secondes, puis
à la main, avec des chocs.  La vérité n'y est pas : on compare au lisseur, qui connaît aussi l'avenir.
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

import sequential as sq
from sequential.attitude import ComplementaryAttitude, TiltKalman, roll_pitch_yaw, tilt
from sequential.readers import read_imu
from sequential.sensors import ImuErrors, ImuRecording, StillDetector, simulate_imu, tumble

RATE_HZ = 100.0
SHOCK_M_S2 = 4.0  # ‖a‖ s'écarte de g de plus que cela : un choc
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


def tune(quiet, rest):
    """R au repos, Q par le NIS : le filtre réglé, et de quoi dessiner le NIS en fonction de q."""
    from figures import say

    sigma = float(np.std(tilt(rest.accel)[:, 0], ddof=1))
    say(f"au repos : σ = {np.degrees(sigma):.3f}°, R = σ² = {sigma**2:.2e} rad² ; biais du gyromètre : "
        f"{np.degrees(rest.gyro.mean(axis=0)).round(2)} °/s")  # fmt: skip
    kalman = TiltKalman(tilt_sigma=sigma, bias_walk=1e-5)
    model, log = kalman.channel(quiet, "roll")
    log = calm(log, quiet)
    declare = with_q(kalman, model)
    q = sq.tune_by_nis(declare, [sq.Knob("q", 1e-3, "rad/s/√Hz")], log).values["q"]
    return replace(kalman, gyro_density=q), lambda q: mean_nis(declare, log, q)


def mean_nis(declare, log, q):
    run = sq.run(sq.KalmanFilter(), declare({"q": q}), log)
    return float(np.mean(run.innovations["roll"].nis()))


def main():
    from claims import table
    from figures import files_given, panels, save, say

    mine = files_given()
    if not mine:
        quiet, knocked, truth, origin = record(np.random.default_rng(3))
        rest = quiet.slice(0.0, 9.5)
        source = f"simulé, bruits {origin}"
    else:
        quiet, source = read_imu(mine[0]), Path(mine[0]).name
        knocked, truth = quiet, None
        rest = quiet.select(max(StillDetector().find(quiet), key=len))
    kalman, nis_of = tune(quiet, rest)
    q, q_rest = kalman.gyro_density, float(np.std(rest.gyro[:, 0])) / np.sqrt(rest.rate)
    say(f"Q par le NIS : {q:.1e} rad/s/√Hz (bruit du gyromètre au repos : {q_rest:.1e})")
    filters = {
        "complémentaire, τ = 1 s": ComplementaryAttitude(time_constant=1.0),
        "Kalman (angle + biais)": kalman,
        "Kalman, portillon à 99,9 %": replace(kalman, gate=0.999),
    }
    truth = smoothed(replace(kalman, gate=0.999), knocked) if truth is None else truth
    paths, rows, after = {}, [], slice(int(15 * quiet.rate), None)
    for name, one in filters.items():
        paths[name] = angles(one, knocked)
        errors = [(path - truth)[after] for path in (angles(one, quiet), paths[name])]
        rows.append([name, *(f(e) for e in errors for f in (rms, worst))])
        say(f"{name:<28} sans choc {rms(errors[0]):.2f}° (pire {worst(errors[0]):.1f}°), "
            f"avec chocs {rms(errors[1]):.2f}° (pire {worst(errors[1]):.1f}°)")  # fmt: skip

    figure, (a, b, c) = panels(1, 3, size=(13.0, 4.0), title="TP3. Inclinaison : R au repos, Q par le NIS")
    draw_q(a, nis_of, q)
    draw_knock(b, knocked, truth, paths, "lisseur" if mine else "vérité")
    draw_bars(c, rows, "Écart RMS au lisseur" if mine else "Erreur RMS")
    save(figure)
    if mine:
        headings = ("filtre", ("écart RMS au lisseur", "°"), ("pire", "°"))
        table("Complémentaire et Kalman sous vos chocs", headings, [row[:3] for row in rows])
        state_own(kalman, nis_of(q), source)
    else:
        headings = ("filtre", ("sans choc, RMS", "°"), ("pire", "°"), ("avec chocs, RMS", "°"), ("pire", "°"))
        table("Complémentaire et Kalman, sans et avec chocs", headings, rows)
        state(rows, nis_of(q), q / q_rest, source)
        found = np.degrees(kalman.estimate(quiet).gyro_bias[-1, :2])
        assert np.abs(found - BIAS_DEG_S[:2]).max() < 0.3, "le Kalman trouve le biais"


def state(rows, nis, ratio, source):
    """Ce que l'exemple affirme."""
    from claims import claim

    (_, complementary, _, shaken, _), (_, plain, _, believed, _), (_, _, _, refused, _) = rows
    claim("TP3", "avec chocs, Kalman et portillon : erreur RMS", refused, "°", high=0.35, source=source)
    claim("TP3", "avec chocs, Kalman sans portillon : erreur RMS", believed, "°", low=0.7, source=source)
    claim("TP3", "avec chocs, complémentaire : erreur RMS", shaken, "°", low=0.8, high=2.0, source=source)
    claim("TP3", "sans choc, Kalman : erreur RMS", plain, "°", high=0.3, source=source)
    claim("TP3", "NIS moyen avec le Q choisi", nis, low=0.9, high=1.1, source=source)
    claim("TP3", "Q choisi / bruit du gyromètre au repos", ratio, low=1.2, source=source)
    assert complementary > 3 * plain, "le complémentaire laisse le biais dans l'angle"
    assert refused < 1.2 * plain, "le portillon refuse les chocs"


def state_own(kalman, nis, source):
    """Le réglage de votre capteur."""
    from claims import claim

    claim("TP3", "NIS moyen avec le Q choisi", nis, low=0.9, high=1.1, source=source)
    claim("TP3", "R : σ de l'angle au repos", np.degrees(kalman.tilt_sigma), "°", source=source)
    claim("TP3", "Q : densité du gyromètre choisie", kalman.gyro_density, "rad/s/√Hz", source=source)


def calm(log, recording):
    """Sans les angles lus pendant un choc : Q se règle sur le mouvement tranquille."""
    off = np.abs(np.linalg.norm(recording.accel, axis=1) - 9.81) > SHOCK_M_S2
    width = int(0.1 * recording.rate)
    near = np.convolve(off, np.ones(2 * width + 1), "same") > 0
    kept = np.flatnonzero(~near[1:])
    return sq.SensorLog({"rate": log["rate"], "roll": log["roll"].select(kept)}, log.name)


def smoothed(gated, recording):
    """Roulis et tangage (N, 2) du lisseur, degrés."""
    runs = [sq.run(sq.RauchTungStriebel(), *gated.channel(recording, name)) for name in ("roll", "pitch")]
    paths = [np.interp(recording.t, run.t, run.mean[:, 0]) for run in runs]
    return np.degrees(np.column_stack(paths))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def worst(values):
    return float(np.abs(values).max())


def draw_q(a, nis_of, q):
    """Le NIS moyen en fonction de q."""
    import figures

    grid = np.logspace(-4, -1.5, 16)
    a.semilogx(grid, [nis_of(value) for value in grid], ".-", color=figures.BLUE, label="NIS moyen")
    a.axhline(1.0, color="black", linewidth=0.8)
    a.plot(q, 1.0, "o", color=figures.ORANGE, label=f"q choisi : {q:.1e}")
    a.set(title="Q : un NIS moyen de 1", xlabel="densité du gyromètre q (rad/s/√Hz)", ylabel="NIS moyen")
    a.legend()


def draw_knock(b, recording, truth, paths, reference):
    """Le pire choc de près : l'accéléromètre, les filtres, la référence."""
    import figures

    t, angle = recording.seconds, np.degrees(tilt(recording.accel)[:, 0])
    start = int(15 * recording.rate)
    middle = start + int(np.argmax(np.abs(angle - truth[:, 0])[start:]))
    rows = slice(max(middle - int(0.6 * recording.rate), 0), middle + int(1.8 * recording.rate))
    b.plot(t[rows], angle[rows], label="accéléromètre", **figures.READINGS)
    for (name, path), colour in zip(paths.items(), (figures.SKY, figures.ORANGE, figures.GREEN), strict=True):
        b.plot(t[rows], path[rows, 0], color=colour, label=name)
    b.plot(t[rows], truth[rows, 0], label=reference, **figures.TRUTH)
    centre = float(truth[rows, 0].mean())
    b.set(title="Un choc", xlabel="temps (s)", ylabel="roulis (°)", ylim=(centre - 22, centre + 36))
    b.legend(loc="upper right", fontsize=7.5)


def draw_bars(c, rows, title):
    """Erreurs RMS avec et sans chocs."""
    import figures

    places = np.arange(len(rows))
    quiet, shaken = ([row[k] for row in rows] for k in (1, 3))
    if quiet != shaken:  # votre enregistrement, lui, n'existe qu'avec ses chocs
        c.bar(places - 0.2, quiet, 0.38, color=figures.BLUE, label="sans choc")
    c.bar(places + (0.2 if quiet != shaken else 0.0), shaken, 0.38, color=figures.ORANGE, label="avec chocs")
    c.set(title=title, ylabel="erreur (°)", xticks=places)
    c.set_xticklabels([row[0].replace(", ", ",\n").replace(" (", "\n(") for row in rows], fontsize=8)
    c.legend()


if __name__ == "__main__":
    main()
