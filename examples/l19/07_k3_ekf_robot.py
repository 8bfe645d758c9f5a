"""K3. EKF sur un robot différentiel, et l'angle qui fait exploser le filtre.

État (x, y, cap), entrée (vitesse, vitesse angulaire).  L'EKF linéarise le modèle autour de l'estimation :
F et H sont des jacobiennes.  Un cap de 359° mesuré quand on attend -1° n'est pas une innovation de 360°,
mais de 0° : il faut replier l'innovation dans ]-π, π].  Ici il suffit de dire où vit la mesure :
`manifold=SO2()` la replie, `Vector(1)` non, et tout le reste est identique.  Autres choix : UKF (sans
jacobiennes), filtre particulaire (sans gaussienne).
"""

import numpy as np

import sequential as sq

COMPASS_SIGMA = np.radians(5.0)
START = np.array([0.0, 0.0, 0.0])


def heading(x):
    """Ce que lit une boussole."""
    return x[2:3]


def heading_jacobian(x):
    """Dérivée selon (x, y, cap)."""
    return np.array([[0.0, 0.0, 1.0]])


def robot(compass_manifold):
    """Un robot qui tourne en rond, avec GPS (1 m) et boussole (5°)."""
    compass = sq.Sensor(heading, COMPASS_SIGMA**2, jacobian=heading_jacobian, manifold=compass_manifold)
    return sq.StateSpace(
        manifold=sq.SE2(),
        prior=sq.Gaussian(START, np.array([0.5, 0.5, 0.1]) ** 2),
        process=sq.Unicycle(along=0.1, across=0.02, heading=0.05),
        sensors={"gps": sq.Position(1.0, axes=2), "compass": compass},
        input="wheels",
    )


def main():
    from figures import BLUE, GREEN, ORANGE, PINK, READINGS, TRUTH, panels, save

    rng = np.random.default_rng(4)
    right, wrong = robot(sq.SO2()), robot(sq.Vector(1))
    t = np.arange(0, 60, 0.1)
    wheels = np.column_stack([np.full(len(t), 1.0), np.full(len(t), 0.25)])
    drive = sq.simulate(right, t, rng, inputs=wheels, readings={"gps": 10})

    runs = {
        "EKF, innovation repliée": sq.run(sq.ExtendedKalmanFilter(), right, drive.log, at=t),
        "EKF, innovation non repliée": sq.run(sq.ExtendedKalmanFilter(), wrong, drive.log, at=t),
        "UKF, innovation repliée": sq.run(sq.UnscentedKalmanFilter(), right, drive.log, at=t),
        "filtre particulaire": sq.run(sq.ParticleFilter(1000, rng), right, drive.log, at=t),
    }
    rms, nis = {}, {}
    for name, run in runs.items():
        rms[name] = np.sqrt(np.mean(np.sum((run.mean - drive.truth)[:, :2] ** 2, axis=1)))
        nis[name] = np.mean(run.innovations["compass"].nis())
        print(f"{name:28}: {rms[name]:6.2f} m d'erreur, NIS moyen de la boussole {nis[name]:.1f}")
    naive = runs["EKF, innovation non repliée"].innovations["compass"]
    print(f"plus grande innovation non repliée : {np.degrees(np.abs(naive.residual).max()):.0f}°")

    figure, (a, b) = panels(
        1, 2, size=(11.5, 4.6), title="K3. EKF d'un robot différentiel : replier les angles"
    )
    gps = drive.log["gps"].values
    a.plot(gps[:, 0], gps[:, 1], label="GPS", **READINGS)
    for (name, run), colour in zip(runs.items(), (GREEN, ORANGE, BLUE, PINK), strict=True):
        a.plot(
            run.mean[:, 0],
            run.mean[:, 1],
            color=colour,
            label=name,
            linewidth=3.0 if colour == GREEN else 1.2,
        )
        seen = run.innovations["compass"]
        b.plot(seen.t * 1e-9, np.degrees(seen.residual[:, 0]), color=colour, label=name, linewidth=1.0)
    a.plot(drive.truth[:, 0], drive.truth[:, 1], label="vérité", **TRUTH)
    a.set(title="Trajectoire", xlabel="x (m)", ylabel="y (m)")
    a.set_aspect("equal", adjustable="datalim")
    a.update_datalim([(0, -1), (0, 18)])
    a.legend(fontsize=8, loc="upper left")
    b.set(title="Innovation de la boussole", xlabel="temps (s)", ylabel="innovation (°)", ylim=(-400, 520))
    b.legend(loc="upper left")
    save(figure)

    good, bad, ukf, particles = rms
    assert rms[good] < 0.8, "l'EKF suit le robot"
    assert np.degrees(np.abs(naive.residual).max()) > 180, "359° pour -1°"
    assert rms[bad] > 2 * rms[good], "sans repli, le filtre explose"
    assert nis[bad] > 20 * nis[good]
    assert abs(rms[ukf] - rms[good]) < 0.1, "sur un modèle aussi doux, l'UKF fait jeu égal"
    assert abs(rms[particles] - rms[good]) < 0.15, "et 1000 particules aussi, pour bien plus de calcul"


if __name__ == "__main__":
    main()
