"""S2. La fiche des formules : lue, affichée, et chaque formule vérifiée numériquement.

Le texte est dans `fiches/s2_formules.md`.  Ici, une fonction par formule : elle compare ce que dit la fiche
avec la bibliothèque, avec une dérivée numérique ou avec une expérience.
"""

from pathlib import Path

import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, panels, save, say
from scipy.stats import chi2

import sequential as sq
from factorlab.l19.sheets import as_text, read_sheet, verified
from sequential.sensors import allan_deviation
from vision3d.camera import Camera
from vision3d.image import sobel
from vision3d.robust import transfer
from vision3d.triangulate import triangulate

SHEET = Path(__file__).parent / "fiches" / "s2_formules.md"
RNG = np.random.default_rng(62)


def moving_mean():
    t, x = np.arange(20_000.0), RNG.standard_normal(20_000)
    mean = sq.MovingMean(25)
    assert abs(mean(t, x).std() - 1 / 5) < 0.01
    late = t[100] - mean(t, t)[100]
    assert np.isclose(late, 12)
    return f"k = 25 : bruit divisé par {1 / mean(t, x).std():.1f}, retard de {late:.0f} mesures"


def low_pass():
    low = sq.LowPass(coefficient=0.05, interval=0.02)
    assert np.isclose(low.tau, -0.02 / np.log(0.95))
    assert abs(low.tau - 0.4) < 0.02
    return f"a = 0,05 à 50 Hz : τ = {low.tau:.2f} s, Δt/a = {0.02 / 0.05:.2f} s"


def complementary():
    dt, alpha = 0.01, 0.98
    tau = dt * alpha / (1 - alpha)
    t = dt * np.arange(1000)
    angle, theta, out = np.sin(t), 0.0, []
    for k in range(1, len(t)):  # les deux capteurs parfaits : rien ne se perd entre eux
        theta = alpha * (theta + angle[k] - angle[k - 1]) + (1 - alpha) * angle[k]
        out.append(theta)
    np.testing.assert_allclose(out, angle[1:], atol=1e-12)
    assert np.isclose(tau, 0.49)
    return f"α = 0,98 à 100 Hz : τ = {tau:.2f} s ; sans bruit, l'angle sort intact"


def double_integral():
    dt, bias = 0.01, 0.01
    position = np.cumsum(np.cumsum(np.full(6000, bias)) * dt) * dt
    assert abs(position[-1] - 0.5 * bias * 60**2) < 0.01
    return f"1 cm/s² pendant 60 s : {position[-1]:.1f} m"


def gain():
    P, R = 4.0, 1.0
    K = P / (P + R)
    assert np.isclose(1 / ((1 - K) * P), 1 / P + 1 / R)
    assert P / (P + 1e9) < 1e-8
    assert 1e9 / (1e9 + R) > 1 - 1e-8
    return f"P = 4, R = 1 : K = {K:.1f}, P⁺ = {(1 - K) * P:.1f}"


def kalman():
    F, H = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    x, P, R = np.zeros(2), np.diag([4.0, 1.0]), 0.25
    rows, seen, z = [np.diag([0.5, 1.0])], [np.zeros(2)], RNG.standard_normal(30)
    for k, measured in enumerate(z):  # Q = 0 : l'état final détermine tout le passé
        x, P = F @ x, F @ P @ F.T
        K = P @ H.T / (H @ P @ H.T + R)
        x, P = x + K[:, 0] * (measured - x[0]), (np.eye(2) - K @ H) @ P
        rows.append(H @ np.linalg.matrix_power(F, k + 1) / np.sqrt(R))
        seen.append([measured / np.sqrt(R)])
    start = np.linalg.lstsq(np.vstack(rows), np.concatenate(seen), rcond=None)[0]
    apart = np.abs(np.linalg.matrix_power(F, 30) @ start - x).max()
    assert apart < 1e-9
    return f"30 mesures : à {apart:.0e} près des moindres carrés"


def constant_velocity():
    dt, q = 0.3, 2.0
    _, Q = sq.van_loan([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], q, dt)
    np.testing.assert_allclose(Q, q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))
    return "Q intégrée numériquement (Van Loan) : la même"


def jacobian():
    def move(x, v=1.2, w=0.4, dt=0.1):
        return np.array([x[0] + v * dt * np.cos(x[2]), x[1] + v * dt * np.sin(x[2]), x[2] + w * dt])

    x, step = np.array([1.0, 2.0, 0.7]), 1e-6 * np.eye(3)
    numeric = np.column_stack([(move(x + e) - move(x - e)) / 2e-6 for e in step])
    F = np.eye(3)
    F[:2, 2] = -0.12 * np.sin(0.7), 0.12 * np.cos(0.7)
    apart = np.abs(numeric - F).max()
    assert apart < 1e-8
    return f"jacobienne et différences finies : {apart:.0e} d'écart"


def wrapping():
    def replier(a):
        return np.pi - (np.pi - a) % (2 * np.pi)

    assert np.isclose(replier(np.radians(359 + 1)), 0)
    assert replier(np.pi) == np.pi
    assert replier(-np.pi) == np.pi
    many = RNG.uniform(-50, 50, 1000)
    assert np.abs(np.exp(1j * replier(many)) - np.exp(1j * many)).max() < 1e-9
    return "359° - (-1°) → 0° ; -180° → 180° ; mille angles intacts"


def sigma_points():
    x, P, kappa, n = np.array([1.0, -2.0, 0.5]), np.diag([1.0, 2.0, 0.3]) + 0.2, 1.0, 3
    root = np.linalg.cholesky((n + kappa) * P)
    points = np.vstack([x, x + root.T, x - root.T])
    weights = np.append(kappa, np.full(2 * n, 0.5)) / (n + kappa)
    np.testing.assert_allclose(weights @ points, x)
    np.testing.assert_allclose((points - x).T @ np.diag(weights) @ (points - x), P)
    return f"{len(points)} points : la moyenne et la covariance sont exactes"


def gate():
    levels = chi2.ppf(0.999, [1, 2, 3])
    np.testing.assert_allclose(levels, [10.8, 13.8, 16.3], atol=0.05)
    return "χ² à 99,9 % : " + ", ".join(f"{level:.1f}" for level in levels)


def tilt():
    roll, pitch = 0.3, -0.5
    about_y = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    ax, ay, az = (about_y @ about_x).T @ [0, 0, 9.81]
    found = np.arctan2(ay, az), np.arctan2(-ax, np.hypot(ay, az))
    np.testing.assert_allclose(found, [roll, pitch])
    return "roulis {:.2f} et tangage {:.2f} rad, retrouvés".format(*found)


def allan():
    seen = allan_deviation(0.01 * np.sqrt(100) * RNG.standard_normal(200_000), 100.0)
    short = (seen.tau > 0.05) & (seen.tau < 20)
    slope = np.polyfit(np.log(seen.tau[short]), np.log(seen.deviation[short]), 1)[0]
    level = np.interp(1.0, seen.tau, seen.deviation)
    assert abs(slope + 0.5) < 0.05
    assert abs(level / 0.01 - 1) < 0.1
    return f"bruit blanc N = 0,01 : pente {slope:.2f}, σ(1 s) = {level:.4f}"


def infrared():
    a, b, c, d = 0.22, 0.04, 0.1, 0.6
    v = a / (d + b) + c
    assert np.isclose(a / (v - c) - b, d)
    slope = abs(a / (v + 1e-6 - c) - a / (v - 1e-6 - c)) / 2e-6
    assert np.isclose(slope, (d + b) ** 2 / a, rtol=1e-6)
    return f"à 60 cm, 1 mV de bruit fait {0.1 * slope:.2f} cm"


def convolution():
    ramp = np.tile(np.arange(20, dtype=np.uint8), (20, 1))
    gx = sobel(ramp, 1, 0)[10, 10]
    assert gx == 8
    return f"rampe d'un niveau par pixel : Gx = {gx:g}"


def camera():
    lens = Camera("brown5", (500.0, 510.0, 320.0, 240.0), (-0.2, 0.05, 0.0, 0.0, 0.0), (640, 480))
    x, y = 0.3, -0.2
    r2 = x * x + y * y
    bent = 1 - 0.2 * r2 + 0.05 * r2**2
    np.testing.assert_allclose(
        lens.project(np.array([0.6, -0.4, 2.0])), [500 * x * bent + 320, 510 * y * bent + 240]
    )
    return f"à r = {np.sqrt(r2):.2f}, la distorsion rapproche le point du centre de {100 * (1 - bent):.1f} %"


def homography():
    H = np.array([[0.9, 0.15, 30.0], [-0.1, 1.05, 12.0], [2e-4, -1e-4, 1.0]])
    plane = np.array([[0.0, 0], [100, 0], [100, 80], [0, 80]])
    rows = []
    for (X, Y), (u, v) in zip(plane, transfer(H, plane), strict=True):
        rows += [[X, Y, 1, 0, 0, 0, -u * X, -u * Y, -u], [0, 0, 0, X, Y, 1, -v * X, -v * Y, -v]]
    found = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    np.testing.assert_allclose(found / found[2, 2], H, atol=1e-6)
    return "quatre points la donnent exactement"


def stereo():
    f, B, Z, sigma = 500.0, 0.12, 2.0, 0.3
    pair = Camera("pinhole", (f, f, 320.0, 240.0), (), (640, 480))
    poses = np.array([[1.0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, -B, 0, 0]])  # camera_T_world : la droite est à +B
    left = np.column_stack([np.full(4000, 320.0), np.full(4000, 240.0)])
    right = left - [f * B / Z, 0] + np.column_stack([sigma * RNG.standard_normal(4000), np.zeros(4000)])
    depth = triangulate(pair, poses, np.stack([left, right]), sigma_px=sigma).points[:, 2]
    expected = Z**2 / (f * B) * sigma
    assert abs(np.median(depth) - Z) < 0.01
    assert abs(depth.std() / expected - 1) < 0.1
    return f"à 2 m : σ = {100 * depth.std():.1f} cm, formule {100 * expected:.1f} cm"


def ransac():
    draws = np.log(1 - 0.999) / np.log(1 - 0.5**4)
    good = (RNG.random((20_000, int(np.ceil(draws)), 4)) < 0.5).all(axis=2).any(axis=1).mean()
    assert np.ceil(draws) == 108
    assert good > 0.998
    return f"{np.ceil(draws):.0f} tirages ; un bon au moins dans {100 * good:.2f} % des essais"


CHECKS = {
    "Moyenne glissante": moving_mean,
    "Passe-bas": low_pass,
    "Filtre complémentaire": complementary,
    "Biais intégré": double_integral,
    "Gain de Kalman à une dimension": gain,
    "Filtre de Kalman": kalman,
    "Bruit d'un modèle à vitesse constante": constant_velocity,
    "EKF": jacobian,
    "Repli d'un angle": wrapping,
    "Points sigma": sigma_points,
    "Portillon": gate,
    "Inclinaison": tilt,
    "Variance d'Allan": allan,
    "Télémètre infrarouge": infrared,
    "Convolution et Sobel": convolution,
    "Caméra": camera,
    "Homographie": homography,
    "Stéréo": stereo,
    "RANSAC": ransac,
}


def main():
    sheet = read_sheet(SHEET)
    found = verified(sheet, CHECKS)
    say(as_text(sheet, found))
    claim("S2", "formules vérifiées numériquement", len(found), low=19, high=19)
    tau = sq.LowPass(coefficient=0.05, interval=0.02).tau
    claim("S2", "constante de temps du passe-bas a = 0,05 à 50 Hz", tau, "s", low=0.38, high=0.42)
    draw()


def draw():
    """Quatre courbes à avoir en tête."""
    figure, (a, b, c, d) = panels(1, 4, size=(16.0, 3.9), title="S2. Quatre formules à avoir en tête")
    t = np.linspace(0, 2.0, 200)
    for share, colour in ((0.02, BLUE), (0.05, GREEN), (0.2, ORANGE)):
        tau = -0.02 / np.log(1 - share)
        a.plot(t, 1 - np.exp(-t / tau), color=colour, label=f"a = {share:g} : τ = {tau:.2f} s")
    a.set(title="Passe-bas à 50 Hz : l'échelon", xlabel="temps (s)", ylabel="sortie")
    ratio = np.logspace(-2, 2, 100)
    b.semilogx(ratio, 1 / (1 + ratio), color=BLUE, label="K = P/(P + R)")
    b.semilogx(ratio, ratio / (1 + ratio), color=GREEN, label="P⁺/P = R/(P + R)")
    b.set(title="Le gain", xlabel="R / P", ylabel="sans unité")
    t = np.linspace(0, 60, 100)
    for bias, colour in ((0.01, BLUE), (0.05, GREEN), (0.1, ORANGE)):
        c.plot(t, 0.5 * bias * t**2, color=colour, label=f"{100 * bias:.0f} cm/s²")
    c.set(title="½ b t² : l'accéléromètre intégré deux fois", xlabel="temps (s)", ylabel="erreur (m)")
    Z = np.linspace(0.3, 5, 100)
    for base, colour in ((0.06, ORANGE), (0.12, GREEN), (0.24, BLUE)):
        d.plot(Z, 100 * Z**2 / (500 * base) * 0.3, color=colour, label=f"B = {100 * base:.0f} cm")
    d.set(title="Stéréo : σ_Z pour 0,3 px, f = 500 px", xlabel="Z (m)", ylabel="σ (cm)")
    for axes in (a, b, c, d):
        axes.legend()
    save(figure)


if __name__ == "__main__":
    main()
