"""TP4 (d). Deux photos du bureau : ORB, appariement, homographie par RANSAC.

- ORB décrit chaque coin par 256 comparaisons de niveaux ; deux descriptions se comparent par la distance de
  Hamming, le nombre de bits qui diffèrent.
- Le test du rapport de Lowe garde un couple si le plus proche l'est nettement plus que le second ; la
  vérification croisée, si chacun est le plus proche de l'autre.
- Il reste des faux. RANSAC tire quatre couples, en déduit une homographie, compte ceux qui sont d'accord, et
  recommence ; les moindres carrés sur les accordés finissent le travail, et donnent la covariance.
- Une homographie ne vaut que pour un plan, ou pour une caméra qui tourne sur place.

Les photos sont rendues (une affiche vue de face, puis de biais) et la vérité est connue ; avec
FACTORLAB_DATA, la boîte d'OpenCV est cherchée dans sa scène.  La commande qui fait tout cela :
`factorlab match A B --features orb`.  Vos deux photos :
`python examples/l19/48_tp4d_orb_homographie.py BUREAU1.jpg BUREAU2.jpg`
"""

import os
from pathlib import Path

import numpy as np

from vision3d.camera import Camera
from vision3d.features import detect_features, match_features, refine_matches
from vision3d.features.drawing import draw_matches
from vision3d.images import read_image
from vision3d.render import looking_at, render_scene, transfer, wall
from vision3d.robust import RansacSettings, fit_homography, transfer_cov
from vision3d.robust import transfer as through

CAMERA = Camera("pinhole", (420.0, 420.0, 239.5, 179.5), (), (480, 360))
THRESHOLD_PX = 3.0
DATA = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"


def two_photos(rng):
    """Une affiche vue de face, puis de biais, de plus près et tournée ; et où chaque pixel est passé."""
    scene = wall(rng)
    views = [
        render_scene(CAMERA, pose, scene, rng=rng, supersample=2)
        for pose in (
            looking_at((0.0, 0.0, 0.0), (0.0, 0.0, 2.0)),
            looking_at((0.75, -0.3, 0.5), (0.1, 0.0, 2.0)),
        )
    ]
    return views[0].image, views[1].image, lambda pixels: transfer(*views, scene, pixels)


def matched(image_a, image_b, **settings):
    """Les couples (xa, ya), (xb, yb), du plus sûr au moins sûr, et leurs descripteurs."""
    a, b = (detect_features(image, "orb", count=2500) for image in (image_a, image_b))
    pairs = match_features(a, b, **settings)
    return pairs.points(a, b), pairs.warps(a, b)


def least_squares(a, b):
    """L'homographie qui passe au mieux par tous les couples, faux compris (DLT, huit inconnues)."""
    one, zero = np.ones(len(a)), np.zeros((len(a), 3))
    p = np.column_stack([a, one])
    rows = np.vstack([np.hstack([p, zero, -b[:, :1] * p]), np.hstack([zero, p, -b[:, 1:] * p])])
    scale = np.linalg.norm(rows, axis=0)
    return (np.linalg.svd(rows / scale)[2][-1] / scale).reshape(3, 3)


def grid_error(H, truth, points):
    """Distance moyenne entre où H met des points et où ils sont, px."""
    true = truth(points)
    seen = np.isfinite(true).all(axis=1)
    return np.linalg.norm(through(H, points)[seen] - true[seen], axis=1).mean()


def main():
    from claims import claim
    from figures import panels, save, say

    rng = np.random.default_rng(7)
    image_a, image_b, truth = two_photos(rng)
    everyone, _ = matched(image_a, image_b, ratio=None, cross_check=False)
    (a, b), warps = matched(image_a, image_b)

    def correct(pairs):
        return np.linalg.norm(pairs[1] - truth(pairs[0]), axis=1) < THRESHOLD_PX

    say(f"sans test : {len(everyone[0])} couples, {100 * correct(everyone).mean():.0f} % de justes")
    say(f"rapport et vérification croisée : {len(a)} couples, {100 * correct((a, b)).mean():.0f} % de justes")

    fit = fit_homography(a, b, RansacSettings(threshold=THRESHOLD_PX), rng=rng)
    grid = np.stack(np.meshgrid(np.linspace(60, 420, 7), np.linspace(60, 300, 5)), axis=-1).reshape(-1, 2)
    plain = grid_error(least_squares(*everyone), truth, grid)
    robust = grid_error(fit.model, truth, grid)
    print(f"RANSAC : {fit.count} couples d'accord sur {len(a)}")

    # recaler chaque couple : la lumière autour de a, cherchée dans b au centième de pixel
    inside = fit.inliers
    refined, cov, ok = refine_matches(image_a, image_b, a[inside], b[inside], warps=warps[inside])
    sigma = np.sqrt(0.5 * np.trace(cov[ok], axis1=1, axis2=2))
    sharp = fit_homography(a[inside][ok], refined[ok], RansacSettings(threshold=1.0), sigma=sigma, rng=rng)
    sharp_error = grid_error(sharp.model, truth, grid)
    stated = np.sqrt(np.trace(transfer_cov(sharp.model, sharp.cov, grid), axis1=1, axis2=2).mean())
    say(f"erreur sur une grille : moindres carrés {plain:.1f} px, RANSAC {robust:.2f} px, "
          f"recalé {sharp_error:.3f} px (annoncé {stated:.3f})")  # fmt: skip

    real = photos()
    rows = 2 if real is None else 3
    title = "TP4 (d). ORB, appariement, homographie par RANSAC"
    figure, axes = panels(rows, 1, size=(9.0, 3.85 * rows), title=title)
    corners = np.array([[60.0, 60], [420, 60], [420, 300], [60, 300]])
    share = 100 * correct(everyone).mean()
    show(axes[0], draw_matches(image_a, image_b, *everyone, correct(everyone), most=60),
            f"Tous les plus proches voisins : {share:.0f} % de justes, en vert")  # fmt: skip
    outline = through(fit.model, corners)
    show(axes[1], draw_matches(image_a, image_b, a, b, fit.inliers, outline=outline, most=60),
            f"Après le test du rapport, RANSAC en garde {fit.count} sur {len(a)}")  # fmt: skip
    found = None if real is None else real_photos(axes[2], *real)
    save(figure)

    right = correct((a, b))
    claim("TP4d", "homographie recalée : erreur moyenne sur une grille", sharp_error, "px", high=0.05)
    claim("TP4d", "homographie par RANSAC : erreur moyenne", robust, "px", high=0.3)
    claim("TP4d", "moindres carrés sur tous les couples : erreur moyenne", plain, "px", low=5.0)
    claim("TP4d", "couples justes avant le test du rapport", share, "%", high=60.0)
    claim("TP4d", "couples justes après", 100 * right.mean(), "%", low=75.0)
    if found is not None:
        state_real(*found)
    assert (right == fit.inliers).mean() > 0.95, "RANSAC retrouve lesquels sont justes"
    assert sharp_error < 3 * stated, "et la covariance le dit"


def photos():
    """Vos deux photos, ou la boîte d'OpenCV et sa scène ; rien s'il n'y en a pas."""
    from figures import files_given

    given = files_given()
    if len(given) == 2:
        return (*given, "vos photos")
    if (DATA / "box.png").is_file():
        return DATA / "box.png", DATA / "box_in_scene.png", "photos OpenCV"
    return None


def real_photos(ax, path_a, path_b, source):
    """De vraies photos : la première retrouvée dans la seconde."""
    image_a, image_b = read_image(path_a), read_image(path_b)
    (a, b), _ = matched(image_a, image_b)
    fit = fit_homography(a, b, RansacSettings(threshold=THRESHOLD_PX), rng=np.random.default_rng(1))
    height, width = image_a.shape
    corners = np.array([[0.0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]])
    print(f"{source} : {fit.count} couples d'accord sur {len(a)}")
    show(ax, draw_matches(image_a, image_b, a, b, fit.inliers, outline=through(fit.model, corners), most=60),
            f"De vraies photos : {fit.count} couples d'accord sur {len(a)}")  # fmt: skip
    return fit.count, through(fit.model, corners), source


def state_real(count, corners, source):
    """Ce que l'on sait des vraies photos."""
    from claims import claim

    known = source == "photos OpenCV"
    claim("TP4d", "couples d'accord", count, low=30 if known else None, source=source)
    if known:
        expected = np.array([(118.1, 160.9), (284.1, 175.5), (267.1, 297.2), (89.7, 271.7)])
        gap = np.linalg.norm(corners - expected, axis=1).max()
        claim("TP4d", "coins de la boîte : pire écart d'ORB à SIFT", gap, "px", high=8.0, source=source)


def show(ax, image, title):
    """Une image en couleurs, sans axes."""
    ax.imshow(image[:, :, ::-1])
    ax.set_title(title)
    ax.axis("off")


if __name__ == "__main__":
    main()
