"""S4. La fiche des méthodes et des pièges : lue, affichée, et chaque nombre vérifié.

Le texte est dans `fiches/s4_methodes.md`.  Ici, pour chaque méthode et chaque piège, la plus petite
expérience qui montre qu'il faut s'y prendre ainsi.
"""

from pathlib import Path

import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, panels, save, say

import sequential as sq
from factorlab.l19.sheets import as_text, read_sheet, verified
from sequential.sensors import characterize
from vision3d.camera import Camera
from vision3d.image import adaptive_threshold, hsv
from vision3d.robust import RansacSettings, fit_homography, transfer

SHEET = Path(__file__).parent / "fiches" / "s4_methodes.md"
RNG = np.random.default_rng(64)


def sensor():
    spread = {n: RNG.standard_normal((4000, n)).std(axis=1, ddof=1).std() for n in (30, 1000)}
    assert abs(spread[30] - 0.13) < 0.01
    assert abs(spread[1000] - 0.0224) < 0.002
    seen = characterize(0.01 * np.arange(1000), RNG.standard_normal(1000)).noise.sigma
    assert seen.low < 1 < seen.high
    return f"σ à {100 * spread[30]:.0f} % près avec 30 mesures, à {100 * spread[1000]:.1f} % avec 1000"


def simple_filter():
    t = np.arange(4000.0)
    x = RNG.standard_normal(4000)
    x[RNG.random(4000) < 0.02] += 30
    low, reject = sq.LowPass(coefficient=0.1, interval=1.0), sq.Hampel(9, centred=True, threshold=4.0)
    first, never = np.sqrt(np.mean(low(t, reject(t, x)) ** 2)), np.sqrt(np.mean(low(t, x) ** 2))
    late = np.sqrt(np.mean(reject(t, low(t, x)) ** 2))
    assert first < 0.5 * min(never, late)
    return (
        f"erreur : écarter puis lisser {first:.2f} ; lisser puis écarter {late:.2f} ; lisser seul {never:.2f}"
    )


def scalar_filter(Q, R, count=4000):
    """Innovations normalisées d'une marche au hasard (Q = 0,01, R = 1) filtrée avec d'autres Q et R."""
    rng = np.random.default_rng(9)
    truth = np.cumsum(0.1 * rng.standard_normal(count))
    x, P, seen = 0.0, 1.0, []
    for z in truth + rng.standard_normal(count):
        P += Q
        seen.append((z - x) / np.sqrt(P + R))
        x, P = x + P / (P + R) * (z - x), P * R / (P + R)
    return np.array(seen[50:])


def echo(nu):
    """Corrélation d'une innovation à la suivante."""
    return np.mean(nu[1:] * nu[:-1]) / np.mean(nu**2)


def tuning():
    grid = np.logspace(-4, 0, 25)
    nis = [np.mean(scalar_filter(Q, 1.0) ** 2) for Q in grid]
    best = np.exp(np.interp(0.0, -np.log(nis), np.log(grid)))  # le NIS décroît avec Q
    assert 0.3 < best / 0.01 < 3
    return f"NIS = 1 pour Q = {best:.3f} (vrai : 0,01)"


def accelerometer():
    gain, offset = np.array([1.02, 0.98, 1.01]), np.array([0.3, -0.2, 0.1])
    positions = 9.81 * np.vstack([np.eye(3), -np.eye(3)])
    seen = gain * positions + offset + 0.01 * RNG.standard_normal((6, 3))
    fits = [np.polyfit(seen[:, k], positions[:, k], 1) for k in range(3)]
    tilted = gain * (9.81 / np.sqrt(2) * np.array([1.0, 0.0, 1.0])) + offset
    norm = np.linalg.norm([np.polyval(fit, value) for fit, value in zip(fits, tilted, strict=True)])
    assert abs(norm - 9.81) < 0.03 < abs(np.linalg.norm(tilted) - 9.81)
    return f"à 45° : {np.linalg.norm(tilted):.2f} m/s² avant, {norm:.2f} après"


def calibration():
    def own_effect(tilt):
        board = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 5), np.linspace(-0.1, 0.1, 5)), -1).reshape(-1, 2)
        rotated = np.column_stack([board[:, 0] * np.cos(tilt), board[:, 1], board[:, 0] * np.sin(tilt)])

        def seen(f, Z):
            place = rotated + np.array([0, 0, Z])
            return Camera("pinhole", (f, f, 320, 240), (), (640, 480)).project(place).ravel()

        focal, far = seen(501, 0.5) - seen(499, 0.5), seen(500, 0.501) - seen(500, 0.499)
        return np.sqrt(max(1 - (focal @ far) ** 2 / (focal @ focal) / (far @ far), 0))

    front, leaning = own_effect(0.0), own_effect(np.radians(40))
    assert front < 1e-3
    assert leaning > 0.05
    return f"focale et recul, effets distincts à {100 * front:.0f} % de face, {100 * leaning:.0f} % à 40°"


def line():
    x = np.arange(60)
    image = np.tile((60 + 2.5 * x - 45.0 * (np.abs(x - 22) < 4)), (40, 1)).astype(np.uint8)
    dark = np.flatnonzero(adaptive_threshold(image, 21, 8, inverted=True)[39])
    fixed = np.flatnonzero(image[39] < 100)
    assert abs(dark.mean() - 22) <= 0.5
    assert abs(fixed.mean() - 22) > 3
    return (
        f"ligne en x = 22, lumière de côté : {dark.mean():.1f} (seuil adaptatif), {fixed.mean():.1f} (fixe)"
    )


def matching():
    H = np.array([[0.9, 0.15, 30.0], [-0.1, 1.05, 12.0], [2e-4, -1e-4, 1.0]])
    a = RNG.uniform((0, 0), (480, 360), (200, 2))
    b = transfer(H, a) + 0.5 * RNG.standard_normal(a.shape)
    b[:100] = RNG.uniform((0, 0), (480, 360), (100, 2))
    off = np.abs(
        transfer(fit_homography(a, b, RansacSettings(threshold=2.0)).model, a) - transfer(H, a)
    ).max()
    assert off < 1
    return f"la moitié de faux couples : RANSAC à {off:.2f} px près"


def dating(latency=0.05, speed=1.0):
    t = 0.01 * np.arange(100)
    seen = speed * (t - latency) + 1e-3 * RNG.standard_normal(100)  # ce que le capteur livre à l'instant t
    now, truth = t[-1], speed * t[-1]
    arrival, taken = (np.polyval(np.polyfit(stamps, seen, 1), now) - truth for stamps in (t, t - latency))
    assert abs(arrival + latency * speed) < 0.002
    assert abs(taken) < 0.002
    return (
        f"50 ms à 1 m/s : {100 * arrival:.1f} cm (datée à l'arrivée), {100 * abs(taken):.1f} cm (à la prise)"
    )


def too_small():
    small_r, small_q = scalar_filter(0.01, 0.01), scalar_filter(1e-5, 1.0)
    assert min(np.mean(small_r**2), np.mean(small_q**2)) > 2
    assert echo(small_r) < -0.1 < 0.1 < echo(small_q)
    return (f"R ÷ 100 : NIS {np.mean(small_r**2):.0f}, écho {echo(small_r):+.2f} ; "
            f"Q ÷ 1000 : NIS {np.mean(small_q**2):.1f}, écho {echo(small_q):+.2f}")  # fmt: skip


def angle():
    a, b = RNG.uniform(-720, 720, (2, 1000))
    wrapped = 180 - (180 - (a - b)) % 360
    np.testing.assert_allclose(np.cos(np.radians(wrapped)), np.cos(np.radians(a - b)), atol=1e-9)
    assert np.abs(wrapped).max() <= 180 < np.abs(a - b).max()
    return f"mille différences : {np.abs(a - b).max():.0f}° au plus, repliées {np.abs(wrapped).max():.0f}°"


def correlated(rho=0.6):
    errors = RNG.multivariate_normal([0, 0], [[1, rho], [rho, 1]], 50_000).mean(axis=1)
    assert abs(errors.var() - (1 + rho) / 2) < 0.02
    return f"ρ = {rho:g} : variance vraie {errors.var():.2f} σ², et non 0,50 σ²"


def colour():
    bright = np.full((4, 4, 3), (40, 90, 230), np.uint8)
    dim = np.rint(0.4 * bright).astype(np.uint8)
    (h, s, v), (h2, s2, v2) = hsv(bright)[0, 0].astype(int), hsv(dim)[0, 0].astype(int)
    assert max(abs(h - h2), abs(s - s2)) <= 3
    assert v2 < 0.5 * v
    return f"lumière × 0,4 : teinte {h} et {h2}, saturation {s} et {s2}, valeur {v} et {v2}"


def distortion():
    lens = Camera("brown5", (500, 500, 320, 240), (-0.28, 0.09, 0, 0, 0), (640, 480))
    points = np.column_stack([np.linspace(-0.55, 0.55, 9), np.full(9, -0.4), np.ones(9)])
    seen = lens.project(points)
    bend = np.ptp(seen[:, 1])
    mended = np.ptp(lens.undistort_points(seen)[:, 1] * 500)
    assert bend > 3
    assert mended < 0.01
    return f"une droite au bord s'écarte de {bend:.0f} px ; corrigée, de {mended:.2f} px"


CHECKS = {
    "Caractériser un capteur": sensor,
    "Choisir un filtre simple": simple_filter,
    "Régler un Kalman": tuning,
    "Étalonner un accéléromètre": accelerometer,
    "Étalonner une caméra": calibration,
    "Suivre une ligne": line,
    "Apparier deux images": matching,
    "Dater les mesures": dating,
    "Piège : R ou Q trop petit": too_small,
    "Piège : angle non replié": angle,
    "Piège : capteurs corrélés": correlated,
    "Piège : seuil de couleur": colour,
    "Piège : distorsion oubliée": distortion,
}


def main():
    sheet = read_sheet(SHEET)
    found = verified(sheet, CHECKS)
    say(as_text(sheet, found))
    claim("S4", "méthodes et pièges vérifiés par une expérience", len(found), low=13, high=13)
    claim("S4", "NIS moyen, R déclaré 100 fois trop petit", np.mean(scalar_filter(0.01, 0.01) ** 2), low=10)
    draw()


def draw():
    """Quatre courbes qui décident d'une méthode."""
    figure, (a, b, c, d) = panels(
        1, 4, size=(16.0, 4.0), title="S4. Quatre courbes qui décident d'une méthode"
    )
    n = np.logspace(1, 4, 50)
    a.loglog(n, 100 / np.sqrt(2 * n), color=BLUE)
    a.plot([30, 1000], [13, 2.2], "o", color=ORANGE)
    a.set(title="À combien près connaît-on σ ?", xlabel="nombre de mesures", ylabel="erreur sur σ (%)")
    grid = np.logspace(-4, 0, 25)
    b.loglog(grid, [np.mean(scalar_filter(Q, 1.0) ** 2) for Q in grid], color=BLUE, label="R juste")
    b.loglog(grid, [np.mean(scalar_filter(Q, 0.1) ** 2) for Q in grid], color=ORANGE, label="R ÷ 10")
    b.axhline(1, color="black", linewidth=0.8)
    b.axvline(0.01, color=GREEN, linestyle="--", label="Q vrai")
    b.set(title="Q se règle là où le NIS vaut 1", xlabel="Q déclaré", ylabel="NIS moyen")
    rho = np.linspace(0, 1, 50)
    c.plot(rho, (1 + rho) / 2, color=GREEN, label="vraie : (1 + ρ)/2")
    c.plot(rho, np.full(50, 0.5), color=ORANGE, label="crus indépendants : 1/2")
    c.plot(rho, np.ones(50), color=BLUE, linestyle="--", label="intersection : 1")
    c.set(
        title="Variance de deux capteurs fusionnés",
        xlabel="corrélation ρ",
        ylabel="variance (σ²)",
        ylim=(0, 1.5),
    )
    wrong = np.linspace(0.05, 0.8, 50)
    for count, name, colour in (
        (4, "homographie", BLUE),
        (5, "essentielle", GREEN),
        (8, "fondamentale", ORANGE),
    ):
        d.semilogy(
            100 * wrong,
            np.log(0.001) / np.log1p(-((1 - wrong) ** count)),
            color=colour,
            label=f"{name} ({count})",
        )
    d.set(title="RANSAC : tirages pour 99,9 %", xlabel="part de faux couples (%)", ylabel="tirages")
    for axes in (b, c, d):
        axes.legend()
    save(figure)


if __name__ == "__main__":
    main()
