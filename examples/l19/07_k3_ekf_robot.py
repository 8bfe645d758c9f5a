"""K3. EKF sur un robot différentiel, et l'angle qui fait exploser le filtre.

État (x, y, cap), entrée (vitesse, vitesse angulaire).  L'EKF linéarise le modèle autour de l'estimation :
F et H sont des jacobiennes.  Un cap de 359° mesuré quand on attend -1° n'est pas une innovation de 360°,
mais de 0° : il faut replier l'innovation dans ]-π, π].  Ici, il suffit de dire où vit la mesure :
`manifold=SO2()` la replie, `Vector(1)` non, et tout le reste est identique.  Autres choix : l'UKF, qui n'a
pas besoin de jacobiennes, et le filtre particulaire, qui n'a pas besoin de gaussienne ; sur un modèle aussi
doux, ils font jeu égal avec l'EKF, et coûtent plus cher.
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
    from claims import claim
    from figures import BLUE, GREEN, ORANGE, PINK, READINGS, TRUTH, panels, save, say

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
        say(f"{name:28}: {rms[name]:6.2f} m d'erreur, NIS moyen de la boussole {nis[name]:.1f}")
    naive = runs["EKF, innovation non repliée"].innovations["compass"]

    figure, (a, b) = panels(
        1, 2, size=(11.5, 5.0), title="K3. EKF d'un robot différentiel : replier les angles"
    )
    gps = drive.log["gps"].values
    a.plot(gps[:, 0], gps[:, 1], label="GPS", **READINGS)
    for (name, run), colour in zip(runs.items(), (GREEN, ORANGE, BLUE, PINK), strict=True):
        width = 3.5 if colour == GREEN else 1.2
        a.plot(run.mean[:, 0], run.mean[:, 1], color=colour, label=name, linewidth=width)
        seen = run.innovations["compass"]
        if colour in {GREEN, ORANGE}:  # les deux autres se confondent avec la première
            b.plot(seen.t * 1e-9, np.degrees(seen.residual[:, 0]), color=colour, label=name, linewidth=1.0)
    a.plot(drive.truth[:, 0], drive.truth[:, 1], label="vérité", **TRUTH)
    a.set(title="Trajectoire", xlabel="x (m)", ylabel="y (m)")
    a.set_aspect("equal", adjustable="box")
    a.set(xlim=(-7, 8), ylim=(-2, 13))
    a.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    b.set(title="Innovation de la boussole", xlabel="temps (s)", ylabel="innovation (°)", ylim=(-400, 150))
    b.legend(loc="upper left", ncols=2)
    save(figure)

    good, bad, ukf, particles = rms
    claim("K3", "position par l'EKF, erreur RMS", rms[good], "m", high=0.6)
    claim("K3", "position par l'EKF sans replier l'angle, erreur RMS", rms[bad], "m", low=0.8)
    claim("K3", "NIS moyen de la boussole, angle replié", nis[good], low=0.8, high=1.2)
    claim("K3", "NIS moyen de la boussole, sans repli", nis[bad], low=20)
    biggest = np.degrees(np.abs(naive.residual).max())
    claim("K3", "plus grande innovation sans repli", biggest, "°", low=300, high=380)
    assert abs(rms[ukf] - rms[good]) < 0.1, "l'UKF fait jeu égal"
    assert abs(rms[particles] - rms[good]) < 0.15, "et 1000 particules aussi, pour bien plus de calcul"


if __name__ == "__main__":
    main()
