"""C3 (seconde moitié). Points d'intérêt, appariement, et ce que deux vues disent de l'espace.

- Harris et FAST trouvent des coins d'une seule taille ; ORB les cherche sur une pyramide ; SIFT cherche des
  taches de toute taille.  Quand la caméra s'approche, seuls les deux derniers retrouvent leurs points.
- Les bits d'ORB se comparent par Hamming, les nombres de SIFT par la distance euclidienne ; dans les deux cas
  le test du rapport écarte l'ambigu.
- RANSAC tolère 50 % de faux couples et bien davantage ; les moindres carrés n'en tolèrent pas un seul.
- Un mur : une homographie suffit.  Un bureau : il a du relief, et c'est la matrice essentielle, E = [t]x R,
  qui relie les vues.  `recover_pose` choisit, des quatre mouvements possibles, celui qui met les points
  devant les deux caméras ; la triangulation donne leur profondeur, à une échelle près : une caméra seule ne
  la mesure pas.

Les vues sont rendues, donc tout se vérifie.
"""

import numpy as np

from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_inverse, quaternion_log, quaternion_multiply
from vision3d.camera import Camera
from vision3d.features import detect_features, match_features, refine_matches
from vision3d.features.drawing import draw_matches
from vision3d.render import desk, looking_at, render_scene, transfer, wall
from vision3d.robust import RansacSettings, fit_homography
from vision3d.robust import transfer as through
from vision3d.triangulate import triangulate
from vision3d.two_view import essential_matrix, estimate_two_view, recover_pose

CAMERA = Camera("pinhole", (420.0, 420.0, 239.5, 179.5), (), (480, 360))
DEPART = SE3().identity()
GENRES = ("harris", "fast", "orb", "sift")


def vues(scene, pose, rng):
    """Deux photos : du départ, et d'une autre pose."""
    return [render_scene(CAMERA, p, scene, rng=rng, supersample=2) for p in (DEPART, pose)]


def apparier(a, b, genre):
    """Couples de pixels, et comment le voisinage de l'un se retrouve dans l'autre."""
    de_a, de_b = (detect_features(vue.image, genre, count=1200) for vue in (a, b))
    couples = match_features(de_a, de_b)
    return couples.points(de_a, de_b), couples.warps(de_a, de_b)


def retrouves(scene, rng):
    """Nombre de couples justes de chaque genre, selon combien la caméra s'est approchée."""
    zooms, comptes = (1.0, 1.25, 1.6, 2.0), {genre: [] for genre in GENRES}
    for zoom in zooms:
        a, b = vues(scene, looking_at((0.1, 0.0, 2.0 - 2.0 / zoom), (0.1, 0.0, 2.0)), rng)
        for genre in GENRES:
            (pa, pb), _ = apparier(a, b, genre)
            vrais = transfer(a, b, scene, pa)
            comptes[genre].append(int((np.linalg.norm(pb - vrais, axis=1) < 3.0).sum()))
    return np.array(zooms), comptes


def dlt(a, b):
    """L'homographie des moindres carrés, par tous les couples."""
    un, zero = np.ones(len(a)), np.zeros((len(a), 3))
    p = np.column_stack([a, un])
    rangs = np.vstack([np.hstack([p, zero, -b[:, :1] * p]), np.hstack([zero, p, -b[:, 1:] * p])])
    echelle = np.linalg.norm(rangs, axis=0)
    return (np.linalg.svd(rangs / echelle)[2][-1] / echelle).reshape(3, 3)


def faux_couples(rng, parts, essais=5):
    """Erreur médiane (px) de RANSAC et des moindres carrés, selon la part de faux parmi 300 couples."""
    H = np.array([[0.9, 0.15, 30.0], [-0.1, 1.05, 12.0], [2e-4, -1e-4, 1.0]])
    grille = np.stack(np.meshgrid(np.linspace(0, 479, 6), np.linspace(0, 359, 5)), axis=-1).reshape(-1, 2)
    erreurs = np.empty((2, len(parts), essais))
    for i, part in enumerate(parts):
        for j in range(essais):
            a = rng.uniform((0, 0), (480, 360), (300, 2))
            b = through(H, a) + rng.normal(0.0, 0.5, a.shape)
            n = round(part * len(a))
            b[:n] = rng.uniform((0, 0), (480, 360), (n, 2))
            for k, modele in enumerate(
                (fit_homography(a, b, RansacSettings(threshold=2.0)).model, dlt(a, b))
            ):
                erreurs[k, i, j] = np.linalg.norm(through(modele, grille) - through(H, grille), axis=1).mean()
    return np.median(erreurs, axis=2)


def relief(rng):
    """Le mouvement entre deux vues d'un bureau, et la profondeur de ce qui s'y trouve."""
    scene, pose = desk(rng), looking_at((0.28, -0.1, 0.05), (0.0, 0.1, 1.5))
    a, b = vues(scene, pose, rng)
    (pa, pb), formes = apparier(a, b, "sift")
    pb, cov, ok = refine_matches(a.image, b.image, pa, pb, warps=formes)
    pa, pb, cov = pa[ok], pb[ok], cov[ok]
    sigma = np.sqrt(0.5 * np.trace(cov, axis1=1, axis2=2))
    vue = estimate_two_view(CAMERA, CAMERA, pa, pb, sigma_px=sigma)
    print(f"deux vues du bureau : {vue.words}")

    # les quatre mouvements d'une même matrice essentielle, départagés par les points
    rayons = [CAMERA.unproject(pixels[vue.inliers]) for pixels in (pa, pb)]
    choisi = recover_pose(essential_matrix(vue.b_T_a), *rayons)
    print(f"recover_pose : {choisi.votes.tolist()} points devant les deux caméras, selon le mouvement")

    angle, ecart = ecarts(vue.b_T_a, pose)
    print(f"rotation à {angle:.3f}°, direction du déplacement à {ecart:.3f}° près")
    base = np.linalg.norm(pose[4:])  # l'échelle, que rien dans les images ne dit
    mouvement = np.concatenate([vue.b_T_a[:4], base * vue.b_T_a[4:]])
    dedans = vue.inliers
    points = triangulate(
        CAMERA,
        np.array([DEPART, mouvement]),
        np.array([pa[dedans], pb[dedans]]),
        sigma_px=np.tile(sigma[dedans], (2, 1)),
    )
    colonne, rang = np.rint(pa[dedans]).astype(int).T
    vraie = a.depth[rang, colonne]
    return a, b, pa, pb, vue, choisi, points.points[:, 2], vraie, (angle, ecart)


def ecarts(b_T_a, pose):
    """Angle entre rotations, et entre directions de déplacement, °."""
    tourne = quaternion_log(quaternion_multiply(quaternion_inverse(pose[:4]), b_T_a[:4]))
    t = pose[4:] / np.linalg.norm(pose[4:])
    return np.degrees(np.linalg.norm(tourne)), np.degrees(np.arccos(np.clip(t @ b_T_a[4:], -1.0, 1.0)))


def main():
    from figures import BLUE, GREEN, ORANGE, PINK, panels, save

    rng = np.random.default_rng(12)
    mur = wall(rng, tilt_rad=0.0)
    zooms, comptes = retrouves(mur, rng)
    for genre, justes in comptes.items():
        print(f"{genre:7} : couples justes en s'approchant de {zooms[-1]:.0f} fois : {justes}")

    parts = np.array([0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.8])
    ransac, carres = faux_couples(rng, parts)
    for part, robuste, naif in zip(parts, ransac, carres, strict=True):
        print(f"{100 * part:3.0f} % de faux : RANSAC {robuste:6.2f} px, moindres carrés {naif:8.2f} px")

    a, b, pa, pb, vue, choisi, profondeur, vraie, (angle, ecart) = relief(rng)
    erreur = np.median(np.abs(profondeur - vraie) / vraie)
    print(f"profondeur de {len(vraie)} points : erreur médiane {100 * erreur:.2f} %")

    figure, axes = panels(2, 2, size=(12.5, 8.0), title="C3. Deux vues")
    for genre, couleur, forme in zip(GENRES, (PINK, GREEN, ORANGE, BLUE), "os^d", strict=True):
        axes[0].plot(zooms, comptes[genre], marker=forme, color=couleur, label=genre)
    axes[0].set(title="Se rapprocher : qui retrouve ses points ?", xlabel="agrandissement",
                ylabel="couples justes")  # fmt: skip
    axes[0].legend()
    axes[1].plot(100 * parts, carres, "s-", color=ORANGE, label="moindres carrés")
    axes[1].plot(100 * parts, ransac, "o-", color=BLUE, label="RANSAC")
    axes[1].set(title="Des faux couples parmi les vrais", xlabel="part de faux, %", yscale="log",
                ylabel="erreur de l'homographie, px")  # fmt: skip
    axes[1].legend()
    axes[2].imshow(draw_matches(a.image, b.image, pa, pb, vue.inliers, most=50)[..., ::-1])
    axes[2].set_title(f"Bureau : {vue.inliers.sum()} couples d'accord avec une matrice essentielle")
    axes[2].axis("off")
    axes[3].plot([0.6, 2.4], [0.6, 2.4], color="black", linewidth=0.8)
    axes[3].plot(vraie, profondeur, ".", color=BLUE, markersize=3)
    axes[3].set(title=f"Profondeur triangulée : {100 * erreur:.2f} % d'erreur médiane".replace(".", ","),
                xlabel="vraie, m", ylabel="triangulée, m", xlim=(0.6, 2.4), ylim=(0.6, 2.4))  # fmt: skip
    save(figure)

    assert comptes["sift"][-1] > 5 * max(comptes["harris"][-1], comptes["fast"][-1]), (
        "une seule taille ne suit pas"
    )
    assert comptes["orb"][-1] > 2 * max(comptes["harris"][-1], comptes["fast"][-1])
    assert ransac[parts <= 0.8].max() < 0.5, "RANSAC tient à 80 % de faux"
    assert carres[1] > 5 * ransac[1], "trois faux sur trois cents perdent les moindres carrés"
    assert carres[4] > 100 * ransac[4]
    assert vue.verdict == "general", "un bureau n'est pas un plan"
    assert choisi.votes.max() > 0.95 * vue.inliers.sum(), "un seul des quatre mouvements a ses points devant"
    assert np.sort(choisi.votes)[-2] < 0.2 * choisi.votes.max()
    assert angle < 0.2, "la rotation"
    assert ecart < 1.0, "et la direction du déplacement"
    assert erreur < 0.01, "donc la profondeur, une fois l'échelle connue"


if __name__ == "__main__":
    main()
