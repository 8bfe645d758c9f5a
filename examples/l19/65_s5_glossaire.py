"""S5. Le glossaire : les mots à retenir, une vignette chacun, et leur nom dans la bibliothèque.

Le texte est dans `fiches/s5_glossaire.md`.  Pour chaque entrée, on vérifie que les noms de code qu'elle
donne existent, puis une petite expérience dessine sa vignette et affirme ce que dit le mot.
"""

import re
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, READINGS, TRUTH, panels, save, say

import sequential as sq
from factorlab.l19.sheets import as_text, read_sheet, verified
from vision3d.camera import Camera
from vision3d.image import canny, hough_lines, sobel, threshold
from vision3d.robust import fit_homography, transfer

SHEET = Path(__file__).parent / "fiches" / "s5_glossaire.md"
CODE = re.compile(r"`((?:sq|sequential|vision3d)\.[\w.]+)`")
T = np.arange(300.0)
RNG = np.random.default_rng(65)
NOISE = RNG.standard_normal(300)


def noise(axis):
    axis.plot(T, 0.3 * NOISE, color="#888888", label="bruit")
    axis.plot(T, 3 + 0 * T, color=BLUE, label="biais")
    axis.plot(T, 6 + 0.01 * T, color=ORANGE, label="dérive")
    assert abs(NOISE.mean()) < 3 / np.sqrt(300)


def simple(axis):
    x = np.where(T > 150, 1.0, 0.0) + 0.1 * NOISE
    x[[60, 220]] = 3
    low, median = sq.LowPass(coefficient=0.1, interval=1.0)(T, x), sq.SlidingMedian(9)(T, x)
    axis.plot(T, x, **READINGS)
    axis.plot(T, low, color=ORANGE, label="passe-bas")
    axis.plot(T, median, color=GREEN, label="médiane")
    assert low[60] - low[59] > 0.2
    assert abs(median[60]) < 0.3


def complementary(axis):
    truth = np.sin(T / 30)
    gyro, angle, seen = np.gradient(truth) + 0.004, 0.0, truth + 0.3 * NOISE
    out = [angle := 0.95 * (angle + rate) + 0.05 * z for rate, z in zip(gyro, seen, strict=True)]
    axis.plot(T, np.cumsum(gyro), color=BLUE, label="gyromètre seul")
    axis.plot(T, seen, **READINGS)
    axis.plot(T, out, color=GREEN, label="complémentaire")
    axis.plot(T, truth, **TRUTH)
    assert np.std(out - truth) < 0.5 * np.std(seen - truth)


def scalar_kalman(z, Q=0.01, R=1.0):
    """Estimations, variances et innovations d'une marche au hasard."""
    x, P, rows = 0.0, 4.0, []
    for measured in z:
        P += Q
        nu, S = measured - x, P + R
        x, P = x + P / S * nu, P * R / S
        rows.append((x, P, nu, S))
    return np.array(rows).T


WALK = 0.1 * np.cumsum(RNG.standard_normal(300))
ESTIMATE, VARIANCE, NU, S = scalar_kalman(WALK + NOISE)


def kalman(axis):
    sigma = np.sqrt(VARIANCE)
    axis.plot(T, WALK + NOISE, **READINGS)
    axis.fill_between(T, ESTIMATE - 2 * sigma, ESTIMATE + 2 * sigma, color=GREEN, alpha=0.3, label="±2σ")
    axis.plot(T, ESTIMATE, color=GREEN, label="estimation")
    axis.plot(T, WALK, **TRUTH)
    assert np.mean(np.abs(ESTIMATE - WALK) < 2 * sigma) > 0.85


def innovation(axis):
    axis.plot(T, NU**2 / S, ".", color=BLUE, markersize=4, label="ν²/S")
    axis.axhline(1, color="black", linewidth=0.8)
    assert abs(np.mean(NU**2 / S) - 1) < 0.25


def mahalanobis(axis):
    cov = np.array([[1.0, 0.8], [0.8, 1.0]])
    x = RNG.multivariate_normal([0, 0], cov, 300)
    far, near = np.array([1.6, -1.6]), np.array([2.2, 2.2])
    d_far, d_near = (np.sqrt(p @ np.linalg.solve(cov, p)) for p in (far, near))
    axis.plot(*x.T, **READINGS)
    axis.plot(*far, "x", color=ORANGE, markersize=9, label=f"d = {d_far:.1f}")
    axis.plot(*near, "o", color=GREEN, label=f"d = {d_near:.1f}")
    axis.set(ylim=(-3.5, 6))
    assert np.linalg.norm(far) < np.linalg.norm(near)
    assert d_far > 2 * d_near


def unscented(axis):
    mean, cov = np.array([1.0, 0.0]), np.diag([0.02, 0.5])  # distance, angle
    polar = RNG.multivariate_normal(mean, cov, 1500)
    root = np.linalg.cholesky(2 * cov)
    points = np.vstack([mean, mean + root.T, mean - root.T])[1:]  # κ = 0 : le centre ne pèse rien

    def bend(p):
        return np.column_stack([p[:, 0] * np.cos(p[:, 1]), p[:, 0] * np.sin(p[:, 1])])

    axis.plot(*bend(polar).T, **READINGS)
    axis.plot(*bend(points).T, "o", color=BLUE, label="points sigma")
    axis.plot(1, 0, "s", color=ORANGE, label="EKF")
    axis.plot(*bend(points).mean(axis=0), "s", color=GREEN, label="UKF")
    true = bend(polar).mean(axis=0)
    assert np.linalg.norm(bend(points).mean(axis=0) - true) < 0.3 * np.linalg.norm([1, 0] - true)
    axis.set(xlim=(-2, 2.6), ylim=(-1.8, 2.8))


def attitude(axis):
    for turn, alpha in ((0.0, 0.3), (0.6, 1.0)):
        about = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        for arrow, colour in zip(about.T, (ORANGE, GREEN), strict=True):
            axis.annotate("", arrow, (0, 0), arrowprops={"arrowstyle": "->", "color": colour, "alpha": alpha})
        np.testing.assert_allclose(about @ about.T, np.eye(2), atol=1e-12)
    axis.text(0.15, 1.15, "du corps au monde", fontsize=8)
    axis.set(xlim=(-1, 1.4), ylim=(-0.3, 1.4), aspect="equal")


def picture():
    """Un rectangle clair, penché et bruité."""
    y, x = np.mgrid[:80, :80] - 40
    inside = (np.abs(0.9 * x + 0.4 * y) < 20) & (np.abs(-0.4 * x + 0.9 * y) < 14)
    return np.clip(60 + 120 * inside + 8 * RNG.standard_normal(x.shape), 0, 255).astype(np.uint8)


def gradient(axis):
    image = picture()
    size = np.hypot(sobel(image, 1, 0).astype(float), sobel(image, 0, 1).astype(float))
    bright = threshold(image, "otsu")
    axis.imshow(np.hstack([image, np.clip(size / 3, 0, 255), bright]), cmap="gray")
    axis.axis("off")
    assert 0.12 < np.mean(bright > 0) < 0.25


def hough(axis):
    image = picture()
    lines = hough_lines(canny(image, 150, 300), 18, rho_px=1.0)
    axis.imshow(image, cmap="gray")
    for rho, theta in zip(lines.rho_px[:8], lines.theta_rad[:8], strict=True):
        foot, along = (
            rho * np.array([np.cos(theta), np.sin(theta)]),
            np.array([-np.sin(theta), np.cos(theta)]),
        )
        axis.plot(*(foot + np.array([[-120], [120]]) * along).T, color=ORANGE, linewidth=1)
    axis.set(xlim=(0, 79), ylim=(79, 0))
    axis.axis("off")
    degrees = np.degrees(lines.theta_rad[:2]) % 90
    assert (np.abs(degrees - np.degrees(np.arctan2(0.4, 0.9))) < 4).all()


def pinhole(axis):
    camera = Camera("pinhole", (500, 500, 320, 240), (), (640, 480))
    for Z, colour in ((1.0, BLUE), (2.0, GREEN), (4.0, ORANGE)):
        square = np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3)])
        seen = camera.project(np.column_stack([square, np.full(5, Z)]))
        axis.plot(*seen.T, color=colour, label=f"à {Z:g} m")
        assert np.isclose(np.ptp(seen[:, 0]), 500 * 0.6 / Z)
    axis.set(xlim=(0, 640), ylim=(480, 0), aspect="equal")


def homography(axis):
    plane = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0)), -1).reshape(-1, 2)
    H = np.array([[1.0, 0.2, 0.5], [0.05, 0.8, 0.3], [0.01, 0.09, 1.0]])
    seen = transfer(H, plane)
    found = fit_homography(plane, seen + 0.001 * RNG.standard_normal(seen.shape)).model
    for grid in (seen.reshape(6, 6, 2), seen.reshape(6, 6, 2).transpose(1, 0, 2)):
        axis.plot(grid[..., 0].T, grid[..., 1].T, color=BLUE, linewidth=1)
    axis.set(aspect="equal")
    np.testing.assert_allclose(transfer(found, plane), seen, atol=0.01)


VIGNETTES = {
    "Bruit, biais, dérive": noise,
    "Passe-bas, médiane": simple,
    "Filtre complémentaire": complementary,
    "Filtre de Kalman": kalman,
    "Innovation, NIS": innovation,
    "Distance de Mahalanobis": mahalanobis,
    "EKF, UKF": unscented,
    "IMU, attitude": attitude,
    "Convolution, gradient, seuil": gradient,
    "Hough": hough,
    "Sténopé, paramètres intrinsèques": pinhole,
    "Homographie": homography,
}


def exists(name):
    """Trouver ce qu'un nom de code désigne ; AttributeError s'il n'existe pas."""
    room, _, thing = name.replace("sq.", "sequential.").rpartition(".")
    return getattr(import_module(room), thing, None) or import_module(f"{room}.{thing}")


def check(entry, axis):
    """Les noms de code de l'entrée existent, et sa vignette dit vrai."""
    names = CODE.findall(entry.text)
    assert names, f"{entry.title} : aucun nom de code"
    for name in names:
        exists(name)
    VIGNETTES[entry.title](axis)
    axis.set(title=entry.title)
    axis.tick_params(labelbottom=False, labelleft=False)
    if axis.get_legend_handles_labels()[1]:
        axis.legend(fontsize=7, loc="upper left")
    return ", ".join(names)


def main():
    figure, axes = panels(3, 4, size=(13.0, 8.6), title="S5. Les mots à retenir, une vignette chacun")
    sheet = read_sheet(SHEET)
    found = verified(
        sheet, {e.title: partial(check, e, axis) for e, axis in zip(sheet.entries, axes, strict=True)}
    )
    say(as_text(sheet, found))
    words = re.findall(r"\*\*(.+?)\*\*", SHEET.read_text(encoding="utf-8"))
    claim("S5", "entrées du glossaire illustrées et vérifiées", len(found), low=12, high=12)
    claim("S5", "mots définis", len(words), low=19)
    save(figure)


if __name__ == "__main__":
    main()
