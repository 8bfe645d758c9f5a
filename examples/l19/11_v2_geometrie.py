"""V2 (première partie).  Du pixel au mètre : droites, sténopé, homographie, étalonnage.

- Hough : chaque pixel de bord vote pour les droites (ρ, θ) qui y passent ; une affiche en montre quatre.
- Sténopé : u = fx X/Z + cx.  Pourquoi une caméra seule ne mesure-t-elle pas la distance ?  Parce que diviser
  par Z la perd : une boule deux fois plus grande et deux fois plus loin fait exactement la même image.
- Homographie : si les points sont sur un plan connu, quatre suffisent pour passer des pixels aux mètres.
- Étalonnage (Zhang) : un damier vu sous plusieurs angles donne les paramètres intrinsèques et la distorsion,
  et dit à combien près : plus il y a de vues, mieux on connaît fx.

Les images sont rendues, donc la vérité est connue ; de vrais damiers sont étalonnés au TP4
(`45_tp4a_calibration.py`).  La profondeur par deux vues est la seconde partie (`14_v2_profondeur.py`).
"""

from itertools import combinations

import figures
import numpy as np
from claims import claim
from figures import BLUE, ORANGE, TRUTH

from vision3d.boards import Checkerboard
from vision3d.calibrate import calibrate
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.image import canny, gaussian_blur, hough_lines
from vision3d.render import Scene, leaves, plain, rectangle, render_scene, render_set, sphere
from vision3d.rigid import transform
from vision3d.robust import fit_homography, transfer

CAMERA = Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), (640, 480))
PINHOLE = Camera("pinhole", CAMERA.intrinsics, (), CAMERA.size)  # la même, sans distorsion
HERE = np.array([1.0, 0, 0, 0, 0, 0, 0])
POSTER = np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)])  # m, coins sur le mur
CARD = np.array([(0.36, -0.1), (0.61, -0.1)])  # m : une carte de 250 mm, à côté
BOARD = Checkerboard(9, 6, square_m=0.025)
VIEWS = (4, 8, 12)  # combien de vues du damier on donne à l'étalonnage


def poster():
    """Une affiche claire sur un mur vu de biais ; les pixels de ses coins, et des bouts de la carte."""
    pose = np.array([0.95, 0.12, -0.26, 0.1, 0.05, 0.02, 1.1])
    pose[:4] /= np.linalg.norm(pose[:4])
    sheet = rectangle(pose, (0.60, 0.40), plain(0.85))
    view = render_scene(PINHOLE, HERE, Scene((sheet,), background=0.2), rng=np.random.default_rng(1))
    on_wall = np.column_stack([np.vstack([POSTER, CARD]), np.zeros(6)])
    pixels = PINHOLE.project(transform(pose, on_wall))
    return view.image, pixels[:4], pixels[4:]


def four_corners(image):
    """Les quatre droites de Hough qui ont le plus de voix, et leurs intersections, en tournant."""
    edges = canny(gaussian_blur(image, 1.0), 60, 120)
    found = hough_lines(edges, 60, rho_px=0.5, theta_rad=np.pi / 720)
    kept = []
    for k in range(len(found)):
        # deux voisines de la table sont la même droite : un demi-tour de θ et de ρ près, aussi
        turns = [found.theta_rad[k] - found.theta_rad[j] for j in kept]
        steps = [abs(abs(found.rho_px[k]) - abs(found.rho_px[j])) for j in kept]
        if all(abs(np.sin(turn)) > 0.1 or step > 25 for turn, step in zip(turns, steps, strict=True)):
            kept.append(k)
    rho, theta = found.rho_px[kept[:4]].astype(float), found.theta_rad[kept[:4]].astype(float)
    normals = np.column_stack([np.cos(theta), np.sin(theta)])
    crossings = [
        np.linalg.solve(normals[[i, j]], rho[[i, j]])
        for i, j in combinations(range(4), 2)
        if abs(np.sin(theta[i] - theta[j])) > 0.5
    ]
    corners = np.array([c for c in crossings if (np.abs(c - 300) < 500).all()])
    around = corners - corners.mean(axis=0)
    return corners[np.argsort(np.arctan2(around[:, 1], around[:, 0]))], (rho, theta)


def balls():
    """Deux boules : de rayon r à la distance d, de rayon 2 r à 2 d ; leurs images."""
    pattern = leaves(np.random.default_rng(2), 256, count=1500)
    return [
        render_scene(CAMERA, HERE, Scene((sphere((0.1 * k, 0.05 * k, k), 0.15 * k, pattern),))).image
        for k in (1.0, 2.0)
    ]


def focal_lengths(rng):
    """fx et son écart-type (px), étalonnés avec de plus en plus de vues du damier."""
    views = detect_views(render_set(CAMERA, BOARD, max(VIEWS), rng).named(), BOARD).views
    found = [calibrate(views[:count], "brown5") for count in VIEWS]
    return np.array([(one.camera.intrinsics[0], one.std[0]) for one in found])


def main():
    image, true_corners, card = poster()
    corners, lines = four_corners(image)
    off = np.linalg.norm(corners - true_corners, axis=1)
    ends = transfer(fit_homography(corners, 1000 * POSTER).model, card)
    width = np.linalg.norm(ends[1] - ends[0])
    near, far = balls()
    change = np.abs(near - far.astype(float)).max()
    fx, sigma = focal_lengths(np.random.default_rng(4)).T

    figure, axes = figures.panels(1, 3, size=(14.0, 4.2), title="V2. Du pixel au mètre")
    draw_plane(axes[0], image, corners, lines, card)
    axes[1].imshow(np.hstack([ball[120:400, 290:550] for ball in (near, far)]), cmap="gray")
    axes[1].axvline(259.5, color="white")
    axes[1].set(title="Boule de 30 cm à 1 m ; de 60 cm à 2 m")
    for ax in axes[:2]:
        ax.axis("off")
    axes[2].errorbar(VIEWS, fx, 2 * sigma, fmt="o", color=BLUE, capsize=4, label="étalonné, ± 2 σ")
    axes[2].axhline(CAMERA.intrinsics[0], label="vrai : 532,8 px", **TRUTH)
    axes[2].set(
        title="Étalonner : fx selon les vues", xlabel="vues du damier", ylabel="fx (px)", xticks=VIEWS
    )
    axes[2].legend()
    figures.save(figure)

    claim("V2", "carte de 250 mm, mesurée par l'homographie", width, "mm", low=247, high=253)
    claim("V2", "coins de l'affiche par Hough, au pire", off.max(), "px", high=1.5)
    claim("V2", "boule double deux fois plus loin, écart des images", change, "niveaux", high=2)
    claim("V2", "fx étalonné (vrai : 532,8)", fx[-1], "px", low=532.3, high=533.3)
    claim("V2", "σ annoncé de fx, 12 vues sur 4 vues", sigma[-1] / sigma[0], high=0.8)
    assert abs(fx[-1] - CAMERA.intrinsics[0]) < 4 * sigma[-1]


def draw_plane(axes, image, corners, lines, card):
    """L'affiche, ses droites, ses coins, et la carte à mesurer."""
    axes.imshow(image, cmap="gray", vmin=0, vmax=255)
    for rho, theta in zip(*lines, strict=True):
        foot, along = (
            rho * np.array([np.cos(theta), np.sin(theta)]),
            np.array([-np.sin(theta), np.cos(theta)]),
        )
        axes.plot(*(foot + np.array([[-900.0], [900.0]]) * along).T, color=ORANGE, linewidth=1.0)
    axes.plot(*corners.T, "o", color=BLUE, markerfacecolor="none", markersize=8)
    axes.plot(*card.T, "w|-", markersize=9)
    axes.text(*card.mean(axis=0) - (0, 14), "250 mm ?", color="white", ha="center", fontsize=8)
    axes.set(title="Hough : quatre droites, quatre coins", xlim=(0, 639), ylim=(479, 0))


if __name__ == "__main__":
    main()
