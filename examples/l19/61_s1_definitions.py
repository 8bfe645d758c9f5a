"""S1. La fiche des définitions : lue, affichée, et chaque phrase vérifiée par le calcul.

Le texte est dans `fiches/s1_definitions.md` ; chaque définition y renvoie à l'exemple qui la montre.  Ici,
une petite fonction par définition : elle refait l'expérience et dit ce qu'elle a trouvé.
"""

from pathlib import Path

import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, panels, save, say

import sequential as sq
from factorlab.l19.sheets import as_text, read_sheet, verified
from sequential.manifold import SO3
from vision3d.camera import Camera

SHEET = Path(__file__).parent / "fiches" / "s1_definitions.md"
RNG = np.random.default_rng(61)
NOISE = RNG.standard_normal(100_000)


def measurement():
    z = np.full(len(NOISE), 20.0) + 1.5 + 0.2 * NOISE
    assert abs(z.mean() - 21.5) < 0.01
    assert abs(z.std() - 0.2) < 0.005
    return f"20 + 1,5 + bruit de 0,2 : moyenne {z.mean():.2f}, écart-type {z.std():.2f}"


def noise():
    gain = NOISE.std() / NOISE.reshape(-1, 100).mean(axis=1).std()
    assert abs(gain - 10) < 0.8
    return f"moyenner 100 mesures divise σ par {gain:.1f}"


def bias():
    left = (3.0 + NOISE).mean()
    assert abs(left - 3.0) < 0.02
    return f"la moyenne de 100 000 mesures garde le biais : {left:.2f} pour 3"


def drift_growth():
    """Mille marches au hasard de 100 pas : leur écart-type à la fin, sur celui au quart."""
    walk = np.cumsum(NOISE.reshape(-1, 100), axis=1)
    return walk[:, 99].std() / walk[:, 24].std()


def drift():
    growth = drift_growth()
    assert abs(growth - 2) < 0.3
    return f"quatre fois plus longtemps : {growth:.2f} fois plus loin"


def resolution():
    x = 100 * NOISE
    share = (np.round(x) - x).std() * np.sqrt(12)
    assert abs(share - 1) < 0.02
    return f"écart-type de l'arrondi : {share:.3f} × LSB/√12"


def time_constant():
    t = 0.001 * np.arange(5000)
    low = sq.LowPass(coefficient=0.002, interval=0.001)
    reached = np.interp(low.tau, t, low(t, np.append(0.0, np.ones(4999))))
    assert abs(reached - 0.632) < 0.005
    return f"après τ = {low.tau:.2f} s, {100 * reached:.0f} % du chemin"


def outlier():
    x = NOISE.copy()
    x[:5000] = 50.0
    robust = 1.4826 * np.median(np.abs(x - np.median(x)))
    assert abs(robust - 1) < 0.1
    assert x.std() > 10
    return f"5 % d'aberrantes : écart-type {x.std():.1f}, 1,4826 × MAD {robust:.2f} (vrai : 1)"


def state():
    t, speeds = 0.1 * np.arange(50), np.array([1.0, -2.0])
    x = 3.0 + speeds[:, None] * t  # deux chariots partis du même point
    both = x[:, :-1] + 0.1 * speeds[:, None]
    np.testing.assert_allclose(both, x[:, 1:], atol=1e-9)
    assert np.ptp(x[:, 0]) == 0.0
    assert np.ptp(x[:, -1]) > 10
    return "même position, autre vitesse : l'avenir diffère ; avec les deux, il est prédit"


def covariance():
    P = np.array([[4.0, 1.5], [1.5, 1.0]])
    x = NOISE.reshape(-1, 2) @ np.linalg.cholesky(P).T
    inside = np.mean(np.einsum("ni,ij,nj->n", x, np.linalg.inv(P), x) < 4)
    np.testing.assert_allclose(np.cov(x.T), P, rtol=0.05)
    assert abs(inside - (1 - np.exp(-2))) < 0.01
    return f"{100 * inside:.0f} % des cas dans l'ellipse à 2σ"


def cart(R=0.25):
    """Un chariot et mille mesures de sa position, filtrés."""
    sensors = {"position": sq.LinearSensor([[1.0, 0.0]], R)}
    prior = sq.Gaussian([0.0, 0.0], [1.0, 1.0])
    model = sq.StateSpace(sq.Vector(2), prior, sq.ConstantVelocity(0.5), sensors, start=0.0)
    drive = sq.simulate(model, 0.1 * np.arange(1000), np.random.default_rng(8))
    return model, drive, sq.run(sq.KalmanFilter(), model, drive.log)


def innovation():
    nu = cart()[2].innovations["position"].whitened()[:, 0]
    echo = np.mean(nu[1:] * nu[:-1])
    assert abs(echo) < 0.1
    assert abs(nu.var() - 1) < 0.15
    return f"corrélation d'une innovation à la suivante : {echo:+.2f} ; variance ν²/S : {nu.var():.2f}"


def nis():
    mean = cart()[2].innovations["position"].nis().mean()
    assert abs(mean - 1) < 0.15
    return f"NIS moyen {mean:.2f} pour une mesure d'une composante"


def mahalanobis():
    nu, S, mm = np.array([0.3, -0.1]), np.array([[0.04, 0.01], [0.01, 0.09]]), 1000.0
    metres = np.sqrt(nu @ np.linalg.solve(S, nu))
    millimetres = np.sqrt(mm * nu @ np.linalg.solve(mm**2 * S, mm * nu))
    assert np.isclose(metres, millimetres)
    return f"{metres:.2f} écarts-types en mètres, {millimetres:.2f} en millimètres"


def smoother():
    model, drive, filtered = cart()
    smoothed = sq.run(sq.RauchTungStriebel(), model, drive.log)
    ratio = smoothed.cov[:, 0, 0] / filtered.cov[:, 0, 0]
    assert (ratio < 1 + 1e-9).all()
    return f"variance du lisseur : {np.median(ratio):.2f} fois celle du filtre"


def attitude():
    q, space = np.array([0.5, 0.5, -0.5, 0.5]), SO3()
    assert np.isclose(np.linalg.norm(q), 1)
    apart = np.linalg.norm(space.local(q, -q))
    assert apart < 1e-9
    return f"de q à -q : {np.degrees(apart):.0f}°"


def image():
    picture = np.zeros((480, 640), np.uint8)
    picture[10, 600] = 255  # ligne 10, colonne 600 : en haut à droite
    (y,), (x,) = np.nonzero(picture)
    assert (x, y) == (600, 10)
    return f"{picture.shape[0]} lignes, {picture.shape[1]} colonnes ; image[10, 600] est en haut à droite"


def pinhole():
    camera = Camera("pinhole", (500.0, 500.0, 319.5, 239.5), (), (640, 480))
    ray = np.array([0.2, -0.1, 1.0])
    pixels = camera.project(np.array([ray, 2 * ray, 7 * ray]))
    np.testing.assert_allclose(pixels, [[419.5, 189.5]] * 3)
    return "trois points du même rayon : un seul pixel"


CHECKS = {
    "Mesure": measurement,
    "Bruit": noise,
    "Biais": bias,
    "Dérive": drift,
    "Résolution": resolution,
    "Latence et constante de temps": time_constant,
    "Valeur aberrante": outlier,
    "État": state,
    "Covariance": covariance,
    "Innovation": innovation,
    "NIS": nis,
    "Distance de Mahalanobis": mahalanobis,
    "Filtre et lisseur": smoother,
    "Attitude": attitude,
    "Image": image,
    "Sténopé": pinhole,
}


def main():
    sheet = read_sheet(SHEET)
    found = verified(sheet, CHECKS)
    say(as_text(sheet, found))
    claim("S1", "définitions vérifiées par le calcul", len(found), low=16, high=16)
    growth = drift_growth()
    claim("S1", "dérive après quatre fois plus de temps", growth, "fois", low=1.7, high=2.3)
    draw()


def draw():
    """Bruit, biais, dérive, aberrantes ; la covariance ; le filtre et le lisseur."""
    figure, (a, b, c) = panels(1, 3, size=(14.5, 4.2), title="S1. Les mots du cours en trois images")
    t, clean = np.arange(400), 0.5 * NOISE[:400]
    spikes = clean.copy()
    spikes[[60, 210, 330]] += (6, -6, 6)
    kinds = {
        "bruit": clean,
        "biais": clean + 3,
        "dérive": clean + 0.35 * np.cumsum(NOISE[1000:1400]),
        "aberrantes": spikes,
    }
    for k, (name, y) in enumerate(kinds.items()):
        a.plot(t, y - 18 * k, color=("#777777", BLUE, ORANGE, GREEN)[k], linewidth=0.8)
        a.plot([0, 400], [-18 * k, -18 * k], color="black", linewidth=0.8, linestyle=":")
        a.text(-8, -18 * k, name, ha="right", va="center")
    a.set(title="Ce qui s'ajoute à la grandeur (pointillé)", xlabel="mesure", yticks=[], xlim=(-90, 400))
    P = np.array([[4.0, 1.5], [1.5, 1.0]])
    root, turn = np.linalg.cholesky(P), np.linspace(0, 2 * np.pi, 100)
    b.plot(*(root @ NOISE[:2000].reshape(2, -1)), ".", color="#9a9a9a", markersize=3)
    for radius, share in ((1, "39 %"), (2, "86 %"), (3, "99 %")):
        b.plot(
            *(radius * root @ [np.cos(turn), np.sin(turn)]),
            color=BLUE,
            label=f"{radius}σ : {share}",
            alpha=0.3 * radius,
        )
    b.set(
        title="Covariance : les ellipses à 1, 2 et 3σ", xlabel="x₁", ylabel="x₂", aspect="equal", ylim=(-4, 6)
    )
    b.legend(loc="upper left", ncols=3)
    model, drive, filtered = cart()
    smoothed = sq.run(sq.RauchTungStriebel(), model, drive.log)
    seconds = drive.log["position"].t * 1e-9
    for run, name, colour in ((filtered, "filtre", ORANGE), (smoothed, "lisseur", GREEN)):
        sigma, error = np.sqrt(run.cov[:, 0, 0]), run.mean[:, 0] - drive.truth[:, 0]
        c.plot(seconds, error, color=colour, linewidth=1.0, label=f"erreur, {name}")
        c.plot(seconds, 2 * sigma, color=colour, linestyle="--")
        c.plot(seconds, -2 * sigma, color=colour, linestyle="--")
    c.set(
        title="Filtre et lisseur, et leurs ±2σ",
        xlabel="temps (s)",
        ylabel="erreur (m)",
        xlim=(0, 40),
        ylim=(-1, 1.3),
    )
    c.legend(loc="upper center", ncols=2)
    save(figure)


if __name__ == "__main__":
    main()
