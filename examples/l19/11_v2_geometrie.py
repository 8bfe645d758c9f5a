"""V2. Du pixel au mètre : droites, sténopé, homographie, étalonnage, et la profondeur par deux vues.

- Hough : chaque pixel de bord vote pour les droites (ρ, θ) qui y passent ; une affiche en montre quatre.
- Sténopé : u = fx X/Z + cx. Une boule deux fois plus grande et deux fois plus loin fait la même image : une
  caméra seule ne mesure pas la distance.
- Homographie : si les points sont sur un plan connu, quatre suffisent pour passer des pixels aux mètres.
- Étalonnage : sans la distorsion, les mètres sont faux ; on la corrige avant de mesurer.
- Deux vues : la caméra avance d'un pas connu, ou il y en a deux ; chaque point vu deux fois est à
  l'intersection de deux rayons. Z = f B / d : l'écart-type de Z croît comme Z²/(f B).

Les images sont rendues, donc la vérité est connue ; avec FACTORLAB_DATA, on triangule aussi le damier des
vraies paires d'OpenCV, dont les cases font 25 mm.
"""

import os
from itertools import combinations
from pathlib import Path

import numpy as np

from vision3d.boards import Checkerboard
from vision3d.calibrate import calibrate
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.features import detect_features, match_features, refine_matches
from vision3d.image import canny, gaussian_blur, hough_lines
from vision3d.images import read_images
from vision3d.render import (
    Scene,
    desk,
    leaves,
    plain,
    rectangle,
    render_journey,
    render_scene,
    render_set,
    sideways_poses,
    sphere,
    surface_points,
)
from vision3d.rigid import transform
from vision3d.robust import fit_homography
from vision3d.triangulate import triangulate

VRAIE = Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), (640, 480))
ICI = np.array([1.0, 0, 0, 0, 0, 0, 0])
AFFICHE = (0.60, 0.40)  # m
COINS = np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)])
DAMIER = Checkerboard(9, 6, square_m=0.025)
PAS = 0.12  # m, entre les deux vues


def affiche(camera):
    """Une affiche claire, de biais sur un mur sombre, et ses coins vrais (px)."""
    pose = np.array([0.95, 0.12, -0.26, 0.1, 0.05, 0.02, 1.1])
    pose[:4] /= np.linalg.norm(pose[:4])
    feuille = rectangle(pose, AFFICHE, plain(0.85))
    coins = camera.project(transform(pose, np.column_stack([COINS, np.zeros(4)])))
    vue = render_scene(camera, ICI, Scene((feuille,), background=0.2), rng=np.random.default_rng(1))
    return vue.image, coins


def quatre_coins(image):
    """Les quatre droites de Hough qui ont le plus de voix, et leurs intersections, en tournant."""
    bords = canny(gaussian_blur(image, 1.0), 60, 120)
    lignes = hough_lines(bords, 60, rho_px=0.5, theta_rad=np.pi / 720)
    gardees = []
    for k in range(len(lignes)):
        # deux voisines de la table sont la même droite : un demi-tour de θ et de ρ près, aussi
        tours = [lignes.theta_rad[k] - lignes.theta_rad[j] for j in gardees]
        pas = [abs(abs(lignes.rho_px[k]) - abs(lignes.rho_px[j])) for j in gardees]
        if all(abs(np.sin(t)) > 0.1 or p > 25 for t, p in zip(tours, pas, strict=True)):
            gardees.append(k)
    gardees = gardees[:4]
    rho, theta = lignes.rho_px[gardees].astype(float), lignes.theta_rad[gardees].astype(float)
    normales = np.column_stack([np.cos(theta), np.sin(theta)])
    coins = [
        np.linalg.solve(normales[[i, j]], rho[[i, j]])
        for i, j in combinations(range(4), 2)
        if abs(np.sin(theta[i] - theta[j])) > 0.5
    ]
    coins = np.array([c for c in coins if (np.abs(c - 300) < 500).all()])
    autour = coins - coins.mean(axis=0)
    return coins[np.argsort(np.arctan2(autour[:, 1], autour[:, 0]))], (rho, theta)


def boules(camera):
    """Deux boules : rayon r à la distance d, 2 r à 2 d ; leurs images."""
    motif = leaves(np.random.default_rng(2), 256, count=1500)
    return [
        render_scene(camera, ICI, Scene((sphere((0.1 * k, 0.05 * k, 1.0 * k), 0.15 * k, motif),))).image
        for k in (1, 2)
    ]


def deux_vues(camera, vues, poses, scene):
    """Apparier, affiner, trianguler avec cette caméra ; l'erreur de profondeur et son écart-type."""
    a, b = (detect_features(vue.image, "sift") for vue in vues)
    paires = match_features(a, b)
    ici, la = paires.points(a, b)
    la, cov, ok = refine_matches(vues[0].image, vues[1].image, ici, la, warps=paires.warps(a, b), radius_px=5)
    pixels, moitie = np.stack([ici[ok], la[ok]]), 0.5 * np.stack([cov[ok], cov[ok]])
    points = triangulate(camera, poses, pixels, sigma_px=moitie)
    vrais, _ = surface_points(VRAIE, poses[0], scene, ici[ok])
    bons = points.ok & (points.chi2 < 6.63) & np.isfinite(vrais).all(axis=1)
    return ici[ok][bons], points.points[bons, 2], vrais[bons, 2], np.sqrt(points.covs[bons, 2, 2])


def cases_reelles():
    """Le damier des vraies paires d'OpenCV : la longueur des cases triangulées (m), image par image."""
    from vision3d.stereo.fit import calibrate_stereo
    from vision3d.stereo.view_pairs import pairs_of_views

    dossier = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"
    cotes = [sorted(dossier.glob(f"{cote}[01]?.jpg")) for cote in ("left", "right")]
    if not all(cotes):
        return None
    paires = pairs_of_views(*(detect_views(read_images(fichiers), DAMIER).views for fichiers in cotes))
    stereo = calibrate_stereo(paires, "brown5")
    cases = []
    for paire in paires:
        if paire.left is None or paire.right is None:
            continue
        poses = np.stack([ICI, stereo.rig.right_T_left])
        pixels = np.stack([paire.left.pixels, paire.right.pixels])
        points = triangulate((stereo.rig.left, stereo.rig.right), poses, pixels, sigma_px=0.2).points
        cases.append(np.linalg.norm(np.diff(points.reshape(6, 9, 3), axis=1), axis=2).ravel())
    return np.array(cases)


def mesurer_sur_le_plan(droite, coins):
    """La largeur de l'affiche (mm) par l'homographie des coins de Hough, selon la caméra qui la voit."""
    plan = fit_homography(coins, 1000 * COINS).model
    largeurs = {}
    for nom, camera in (("sans distorsion", droite), ("distorsion oubliée", VRAIE), ("corrigée", VRAIE)):
        vus = affiche(camera)[1]
        if nom == "corrigée":
            vus = camera.undistort_points(vus) * camera.intrinsics[:2] + camera.intrinsics[2:]
        mm = np.column_stack([vus, np.ones(4)]) @ plan.T
        mm = mm[:, :2] / mm[:, 2:]
        largeurs[nom] = np.linalg.norm(mm[1] - mm[0])
        print(f"homographie, {nom:18} : l'affiche de 600 mm en mesure {largeurs[nom]:.1f}")
    return largeurs


def dessiner(image, coins, droites, deux_boules, largeurs, vue, mesures):
    """Une figure, six volets."""
    from figures import BLUE, GREEN, ORANGE, panels, save

    figure, axes = panels(2, 3, size=(13.0, 7.4), title="V2. Du pixel au mètre")
    axes[0].imshow(image, cmap="gray", vmin=0, vmax=255)
    for r, t in zip(*droites, strict=True):
        pied, sens = r * np.array([np.cos(t), np.sin(t)]), np.array([-np.sin(t), np.cos(t)])
        axes[0].plot(*(pied + np.array([[-900.0], [900.0]]) * sens).T, color=ORANGE, linewidth=1.0)
    axes[0].plot(*coins.T, "o", color=BLUE, markerfacecolor="none", markersize=8)
    axes[0].set(title="Hough : quatre droites, quatre coins", xlim=(0, 639), ylim=(479, 0))
    axes[1].imshow(np.hstack([boule[120:400, 290:550] for boule in deux_boules]), cmap="gray")
    axes[1].axvline(259.5, color="white")
    axes[1].set(title="boule de 30 cm à 1 m ; de 60 cm à 2 m")
    axes[2].barh(list(largeurs), [v - 600 for v in largeurs.values()], color=[GREEN, ORANGE, BLUE])
    axes[2].set(title="600 mm mesurés sur le plan : l'erreur", xlabel="mm")
    ou, z, vrai, sigma = mesures
    erreur = z - vrai
    axes[3].imshow(vue, cmap="gray")
    nuage = axes[3].scatter(*ou.T, c=z, s=6, cmap="viridis")
    axes[3].set(title="profondeur des points appariés (m)", xlim=(0, 639), ylim=(479, 0))
    figure.colorbar(nuage, ax=axes[3], shrink=0.8)
    axes[4].plot(vrai, 1000 * np.abs(erreur), ".", color=BLUE, markersize=3, label="|erreur|")
    ligne, k = np.linspace(vrai.min(), vrai.max(), 50), np.median(sigma / vrai**2)
    axes[4].plot(ligne, 1000 * k * ligne**2, color=ORANGE, label="σ annoncé, ∝ Z²")
    haut = 5000 * k * ligne[-1] ** 2
    axes[4].set(title="l'erreur croît comme Z²", xlabel="Z (m)", ylabel="mm", ylim=(0, haut))
    axes[4].legend()
    axes[5].hist(np.clip(erreur / sigma, -5, 5), bins=41, density=True, color=BLUE, alpha=0.6)
    t = np.linspace(-5, 5, 200)
    axes[5].plot(t, np.exp(-0.5 * t**2) / np.sqrt(2 * np.pi), color=ORANGE, label="loi normale")
    axes[5].set(title="erreur / σ annoncé", xlabel="écarts-types")
    axes[5].legend()
    for ax in (axes[0], axes[1], axes[3]):
        ax.axis("off")
    save(figure)


def main():
    droite = Camera("pinhole", VRAIE.intrinsics, (), VRAIE.size)  # la même, sans distorsion
    image, vrais_coins = affiche(droite)
    coins, droites = quatre_coins(image)
    ecart = np.linalg.norm(coins - vrais_coins, axis=1)
    print(f"Hough : coins de l'affiche à {ecart.max():.2f} px au pire")
    pres, loin = boules(VRAIE)
    pareil = np.abs(pres - loin.astype(float)).max()
    print(f"boule, et boule double deux fois plus loin : {pareil:.0f} niveau d'écart au plus")
    largeurs = mesurer_sur_le_plan(droite, coins)

    rng = np.random.default_rng(4)
    trouvee = calibrate(detect_views(render_set(VRAIE, DAMIER, 12, rng).named(), DAMIER).views, "brown5")
    print(f"étalonnage : fx = {trouvee.camera.intrinsics[0]:.2f} ± {trouvee.std[0]:.2f} px (vrai : 532,80)")
    scene, poses = desk(rng), sideways_poses(2, PAS)
    vues = render_journey(VRAIE, poses, scene, rng=rng)
    mesures = deux_vues(trouvee.camera, vues, poses, scene)
    _, z, vrai, sigma = mesures
    oubliee = Camera("pinhole", trouvee.camera.intrinsics, (), VRAIE.size)
    _, z_faux, vrai_faux, _ = deux_vues(oubliee, vues, poses, scene)
    mediane, biais = np.median(np.abs(z - vrai)), np.median(np.abs(z_faux - vrai_faux))
    print(f"deux vues : {len(z)} points, |erreur| médiane {1000 * mediane:.2f} mm "
          f"(distorsion oubliée : {1000 * biais:.0f} mm)")  # fmt: skip
    cases = cases_reelles()
    if cases is not None:
        print(f"damier réel : cases de {1000 * cases.mean():.2f} ± {1000 * cases.std():.2f} mm (25 déclarés)")
    dessiner(image, coins, droites, (pres, loin), largeurs, vues[0].image, mesures)

    assert ecart.max() < 1.5, "quatre droites de Hough donnent les coins à un pixel près"
    assert pareil <= 2, "une caméra seule ne mesure pas la distance"
    assert abs(largeurs["sans distorsion"] - 600) < 2, "sur un plan connu, l'homographie mesure en mètres"
    assert abs(largeurs["corrigée"] - 600) < 2, "et la distorsion corrigée aussi"
    assert abs(largeurs["distorsion oubliée"] - 600) > 5, "oubliée, elle fausse les mètres"
    assert abs(trouvee.camera.intrinsics[0] - 532.8) < 4 * trouvee.std[0]
    assert len(z) > 500
    assert mediane < 0.003, "deux vues mesurent un bureau au millimètre"
    assert 0.7 < np.median(np.abs(z - vrai) / sigma) / 0.6745 < 1.4, "et savent de combien elles se trompent"
    proche, lointain = vrai < 1.2, vrai > 2.0
    attendu = (np.median(vrai[lointain]) / np.median(vrai[proche])) ** 2
    croissance = np.median(sigma[lointain]) / np.median(sigma[proche])
    assert 0.5 < croissance / attendu < 2.0, "σ croît comme Z²"
    assert biais > 10 * mediane, "la distorsion oubliée coûte bien plus que le bruit"
    if cases is not None:
        assert abs(cases.mean() - 0.025) < 1e-4, "les cases réelles font 25 mm"


if __name__ == "__main__":
    main()
