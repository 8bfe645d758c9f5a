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
`factorlab match A B --features orb`.
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
SEUIL_PX = 3.0
DONNEES = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"


def deux_photos(rng):
    """Une affiche vue de face, puis de biais, de plus près et tournée ; et où chaque pixel est passé."""
    scene = wall(rng)
    vues = [
        render_scene(CAMERA, pose, scene, rng=rng, supersample=2)
        for pose in (
            looking_at((0.0, 0.0, 0.0), (0.0, 0.0, 2.0)),
            looking_at((0.75, -0.3, 0.5), (0.1, 0.0, 2.0)),
        )
    ]
    return vues[0].image, vues[1].image, lambda pixels: transfer(*vues, scene, pixels)


def apparier(image_a, image_b, **reglages):
    """Les couples (xa, ya), (xb, yb), du plus sûr au moins sûr, et leurs descripteurs."""
    a, b = (detect_features(image, "orb", count=2500) for image in (image_a, image_b))
    couples = match_features(a, b, **reglages)
    return couples.points(a, b), couples.warps(a, b)


def moindres_carres(a, b):
    """L'homographie qui passe au mieux par tous les couples, faux compris (DLT, huit inconnues)."""
    un, zero = np.ones(len(a)), np.zeros((len(a), 3))
    p = np.column_stack([a, un])
    rangs = np.vstack([np.hstack([p, zero, -b[:, :1] * p]), np.hstack([zero, p, -b[:, 1:] * p])])
    echelle = np.linalg.norm(rangs, axis=0)
    return (np.linalg.svd(rangs / echelle)[2][-1] / echelle).reshape(3, 3)


def erreur_coins(H, verite, points):
    """Distance moyenne entre où H met des points et où ils sont, px."""
    vrais = verite(points)
    vus = np.isfinite(vrais).all(axis=1)
    return np.linalg.norm(through(H, points)[vus] - vrais[vus], axis=1).mean()


def main():
    from figures import panels, save

    rng = np.random.default_rng(7)
    image_a, image_b, verite = deux_photos(rng)
    tous, _ = apparier(image_a, image_b, ratio=None, cross_check=False)
    (a, b), formes = apparier(image_a, image_b)

    def justes(couples):
        return np.linalg.norm(couples[1] - verite(couples[0]), axis=1) < SEUIL_PX

    print(f"sans test : {len(tous[0])} couples, {100 * justes(tous).mean():.0f} % de justes")
    print(
        f"rapport et vérification croisée : {len(a)} couples, {100 * justes((a, b)).mean():.0f} % de justes"
    )

    fit = fit_homography(a, b, RansacSettings(threshold=SEUIL_PX), rng=rng)
    grille = np.stack(np.meshgrid(np.linspace(60, 420, 7), np.linspace(60, 300, 5)), axis=-1).reshape(-1, 2)
    brute = erreur_coins(moindres_carres(*tous), verite, grille)
    robuste = erreur_coins(fit.model, verite, grille)
    print(f"RANSAC : {fit}")

    # recaler chaque couple : la lumière autour de a, cherchée dans b au centième de pixel
    dedans = fit.inliers
    fin, cov, ok = refine_matches(image_a, image_b, a[dedans], b[dedans], warps=formes[dedans])
    sigma = np.sqrt(0.5 * np.trace(cov[ok], axis1=1, axis2=2))
    net = fit_homography(a[dedans][ok], fin[ok], RansacSettings(threshold=1.0), sigma=sigma, rng=rng)
    recale = erreur_coins(net.model, verite, grille)
    annonce = np.sqrt(np.trace(transfer_cov(net.model, net.cov, grille), axis1=1, axis2=2).mean())
    print(f"erreur sur une grille : moindres carrés {brute:.1f} px, RANSAC {robuste:.2f} px, "
          f"recalé {recale:.3f} px (annoncé {annonce:.3f})")  # fmt: skip

    rangs = 3 if (DONNEES / "box.png").is_file() else 2
    titre = "TP4 (d). ORB, appariement, homographie par RANSAC"
    figure, axes = panels(rangs, 1, size=(9.0, 3.85 * rangs), title=titre)
    coins = np.array([[60.0, 60], [420, 60], [420, 300], [60, 300]])
    part = 100 * justes(tous).mean()
    montrer(axes[0], draw_matches(image_a, image_b, *tous, justes(tous), most=60),
            f"Tous les plus proches voisins : {part:.0f} % de justes, en vert")  # fmt: skip
    cadre = through(fit.model, coins)
    montrer(axes[1], draw_matches(image_a, image_b, a, b, fit.inliers, outline=cadre, most=60),
            f"Après le test du rapport, RANSAC en garde {fit.count} sur {len(a)}")  # fmt: skip
    if rangs == 3:
        boite(axes[2])
    save(figure)

    assert justes((a, b)).mean() > justes(tous).mean() + 0.15, "le test du rapport écarte surtout des faux"
    assert (justes((a, b)) == fit.inliers).mean() > 0.95, "RANSAC retrouve lesquels sont justes"
    assert brute > 20 * robuste, "quelques faux suffisent à perdre les moindres carrés"
    assert robuste < 0.5, "les accordés donnent l'homographie à une fraction de pixel"
    assert recale < 0.5 * robuste, "le recalage la rend plus nette"
    assert recale < 3 * annonce, "et la covariance le dit"


def boite(ax):
    """La boîte d'OpenCV dans sa scène."""
    image_a, image_b = read_image(DONNEES / "box.png"), read_image(DONNEES / "box_in_scene.png")
    (a, b), _ = apparier(image_a, image_b)
    fit = fit_homography(a, b, RansacSettings(threshold=SEUIL_PX), rng=np.random.default_rng(1))
    hauteur, largeur = image_a.shape
    coins = np.array([[0.0, 0], [largeur - 1, 0], [largeur - 1, hauteur - 1], [0, hauteur - 1]])
    print(f"boîte : {fit}")
    montrer(ax, draw_matches(image_a, image_b, a, b, fit.inliers, outline=through(fit.model, coins), most=60),
            f"De vraies photos : la boîte retrouvée par {fit.count} couples sur {len(a)}")  # fmt: skip
    attendus = np.array([(118.1, 160.9), (284.1, 175.5), (267.1, 297.2), (89.7, 271.7)])
    assert np.linalg.norm(through(fit.model, coins) - attendus, axis=1).max() < 8, "ORB la met où SIFT la met"


def montrer(ax, image, titre):
    """Une image en couleurs, sans axes."""
    ax.imshow(image[:, :, ::-1])
    ax.set_title(titre)
    ax.axis("off")


if __name__ == "__main__":
    main()
