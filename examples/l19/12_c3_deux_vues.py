"""C3 (deuxième partie).  Points d'intérêt, appariement, et ce que deux vues disent de l'espace.

- Harris et FAST trouvent des coins d'une seule taille ; ORB les cherche sur une pyramide ; SIFT cherche des
  taches de toute taille.  Quand la caméra s'approche, seuls les deux derniers retrouvent leurs points.
- Les bits d'ORB se comparent par Hamming, les nombres de SIFT par la distance euclidienne ; dans les deux cas
  le test du rapport écarte l'ambigu.
- RANSAC tolère 50 % de faux couples et bien davantage ; trois faux couples sur trois cents perdent les
  moindres carrés.
- Un mur : une homographie suffit.  Un bureau : il a du relief, et c'est la matrice essentielle, E = [t]x R,
  qui relie les vues.  `recover_pose` choisit, des quatre mouvements possibles, celui qui met les points
  devant les deux caméras ; la triangulation donne leur profondeur, à une échelle près : une caméra seule ne
  la mesure pas.

Les vues sont rendues, donc tout se vérifie ; le TP4 (`48_tp4d_orb_homographie.py`) fait de même sur de vraies
photos.
"""

import figures
import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, PINK, say

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
START = SE3().identity()
KINDS = {"Harris": "harris", "FAST": "fast", "ORB": "orb", "SIFT": "sift"}
FALSE_SHARES = np.array([0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.8])


def two_photos(scene, pose, rng):
    """Deux photos : du départ, et d'une autre pose."""
    return [render_scene(CAMERA, p, scene, rng=rng, supersample=2) for p in (START, pose)]


def match(a, b, kind):
    """Couples de pixels, et comment le voisinage de l'un se retrouve dans l'autre."""
    in_a, in_b = (detect_features(view.image, kind, count=1200) for view in (a, b))
    pairs = match_features(in_a, in_b)
    return pairs.points(in_a, in_b), pairs.warps(in_a, in_b)


def count_right(scene, rng):
    """Nombre de couples justes de chaque genre, selon combien la caméra s'est approchée."""
    zooms, counts = (1.0, 1.25, 1.6, 2.0), {name: [] for name in KINDS}
    for zoom in zooms:
        a, b = two_photos(scene, looking_at((0.1, 0.0, 2.0 - 2.0 / zoom), (0.1, 0.0, 2.0)), rng)
        for name, kind in KINDS.items():
            (pa, pb), _ = match(a, b, kind)
            true = transfer(a, b, scene, pa)
            counts[name].append(int((np.linalg.norm(pb - true, axis=1) < 3.0).sum()))
    return np.array(zooms), counts


def dlt(a, b):
    """L'homographie des moindres carrés, par tous les couples."""
    one, zero = np.ones(len(a)), np.zeros((len(a), 3))
    p = np.column_stack([a, one])
    rows = np.vstack([np.hstack([p, zero, -b[:, :1] * p]), np.hstack([zero, p, -b[:, 1:] * p])])
    scale = np.linalg.norm(rows, axis=0)
    return (np.linalg.svd(rows / scale)[2][-1] / scale).reshape(3, 3)


def false_pairs(rng, trials=5):
    """Erreur médiane (px) de RANSAC et des moindres carrés, selon la part de faux parmi 300 couples."""
    H = np.array([[0.9, 0.15, 30.0], [-0.1, 1.05, 12.0], [2e-4, -1e-4, 1.0]])
    grid = np.stack(np.meshgrid(np.linspace(0, 479, 6), np.linspace(0, 359, 5)), axis=-1).reshape(-1, 2)
    errors = np.empty((2, len(FALSE_SHARES), trials))
    for i, share in enumerate(FALSE_SHARES):
        for j in range(trials):
            a = rng.uniform((0, 0), (480, 360), (300, 2))
            b = through(H, a) + rng.normal(0.0, 0.5, a.shape)
            n = round(share * len(a))
            b[:n] = rng.uniform((0, 0), (480, 360), (n, 2))
            robust = fit_homography(a, b, RansacSettings(threshold=2.0)).model
            for k, model in enumerate((robust, dlt(a, b))):
                errors[k, i, j] = np.linalg.norm(through(model, grid) - through(H, grid), axis=1).mean()
    return np.median(errors, axis=2)


def depth_of_desk(rng):
    """Le mouvement entre deux vues d'un bureau, et la profondeur de ce qui s'y trouve."""
    scene, pose = desk(rng), looking_at((0.28, -0.1, 0.05), (0.0, 0.1, 1.5))
    a, b = two_photos(scene, pose, rng)
    (pa, pb), warps = match(a, b, "sift")
    pb, cov, ok = refine_matches(a.image, b.image, pa, pb, warps=warps)
    pa, pb, cov = pa[ok], pb[ok], cov[ok]
    sigma = np.sqrt(0.5 * np.trace(cov, axis1=1, axis2=2))
    view = estimate_two_view(CAMERA, CAMERA, pa, pb, sigma_px=sigma)
    say(f"deux vues du bureau : {view.inliers.sum()} couples sur {len(pa)} suivent un même mouvement")

    # les quatre mouvements d'une même matrice essentielle, départagés par les points
    rays = [CAMERA.unproject(pixels[view.inliers]) for pixels in (pa, pb)]
    chosen = recover_pose(essential_matrix(view.b_T_a), *rays)
    say(f"recover_pose : {chosen.votes.tolist()} points devant les deux caméras, selon le mouvement")

    base = np.linalg.norm(pose[4:])  # l'échelle, que rien dans les images ne dit
    motion = np.concatenate([view.b_T_a[:4], base * view.b_T_a[4:]])
    inside = view.inliers
    points = triangulate(
        CAMERA,
        np.array([START, motion]),
        np.array([pa[inside], pb[inside]]),
        sigma_px=np.tile(sigma[inside], (2, 1)),
    )
    column, row = np.rint(pa[inside]).astype(int).T
    depths = points.points[:, 2], a.depth[row, column]
    picture = draw_matches(a.image, b.image, pa, pb, inside, most=50)
    return picture, view, chosen, depths, angles_off(view.b_T_a, pose)


def angles_off(b_T_a, pose):
    """Angle entre rotations, et entre directions de déplacement, °."""
    turned = quaternion_log(quaternion_multiply(quaternion_inverse(pose[:4]), b_T_a[:4]))
    t = pose[4:] / np.linalg.norm(pose[4:])
    return np.degrees(np.linalg.norm(turned)), np.degrees(np.arccos(np.clip(t @ b_T_a[4:], -1.0, 1.0)))


def main():
    rng = np.random.default_rng(12)
    zooms, counts = count_right(wall(rng, tilt_rad=0.0), rng)
    for name, right in counts.items():
        say(f"{name:7}: couples justes en s'approchant jusqu'à {zooms[-1]:.0f} fois : {right}")
    ransac, squares = false_pairs(rng)
    for share, robust, naive in zip(FALSE_SHARES, ransac, squares, strict=True):
        say(f"{100 * share:3.0f} % de faux : RANSAC {robust:6.2f} px, moindres carrés {naive:8.2f} px")
    picture, view, chosen, (depth, true_depth), (turn, turn_t) = depth_of_desk(rng)
    error = 100 * np.median(np.abs(depth - true_depth) / true_depth)

    figure, axes = figures.panels(2, 2, size=(12.5, 8.0), title="C3. Deux vues")
    for name, colour, mark in zip(KINDS, (PINK, GREEN, ORANGE, BLUE), "os^d", strict=True):
        axes[0].plot(zooms, counts[name], marker=mark, color=colour, label=name)
    axes[0].set(title="Se rapprocher : qui retrouve ses points ?")
    axes[0].set(xlabel="agrandissement (sans unité)", ylabel="couples justes")
    axes[0].legend()
    axes[1].plot(100 * FALSE_SHARES, squares, "s-", color=ORANGE, label="moindres carrés")
    axes[1].plot(100 * FALSE_SHARES, ransac, "o-", color=BLUE, label="RANSAC")
    axes[1].set(title="Des faux couples parmi les vrais", xlabel="part de faux couples (%)", yscale="log")
    axes[1].set_ylabel("erreur de l'homographie (px)")
    axes[1].legend(loc="center right")
    axes[2].imshow(picture[..., ::-1])
    axes[2].set_title(f"Bureau : {view.inliers.sum()} couples d'accord avec une matrice essentielle")
    axes[2].axis("off")
    axes[3].plot([0.8, 2.4], [0.8, 2.4], color="black", linewidth=0.8)
    axes[3].plot(true_depth, depth, ".", color=BLUE, markersize=3)
    axes[3].set(title=f"Profondeur triangulée : {error:.2f} % d'erreur médiane", xlabel="vraie (m)")
    axes[3].set(ylabel="triangulée (m)", xlim=(0.8, 2.4), ylim=(0.8, 2.4))
    figures.save(figure)

    one_size = max(counts["Harris"][-1], counts["FAST"][-1])
    half = FALSE_SHARES == 0.5
    claim("C3", "homographie par RANSAC, 50 % de faux couples, erreur", ransac[half][0], "px", high=0.5)
    claim(
        "C3", "homographie par moindres carrés, 50 % de faux couples, erreur", squares[half][0], "px", low=20
    )
    claim("C3", "homographie par RANSAC, 80 % de faux couples, erreur", ransac[-1], "px", high=1)
    claim("C3", "deux fois plus près : couples justes de SIFT", counts["SIFT"][-1], low=60)
    claim("C3", "deux fois plus près : couples justes de Harris ou de FAST", one_size, high=12)
    claim("C3", "mouvement entre deux vues, erreur de rotation", turn, "°", high=0.2)
    claim("C3", "mouvement entre deux vues, erreur de direction", turn_t, "°", high=1)
    claim("C3", "profondeur triangulée, erreur médiane", error, "%", high=1)
    assert counts["ORB"][-1] > 2 * one_size, "une pyramide suit, une seule taille ne suit pas"
    assert squares[1] > 5 * ransac[1], "trois faux sur trois cents perdent les moindres carrés"
    assert view.verdict == "general", "un bureau n'est pas un plan"
    assert chosen.votes.max() > 0.95 * view.inliers.sum(), "un seul des quatre mouvements a ses points devant"
    assert np.sort(chosen.votes)[-2] < 0.2 * chosen.votes.max()


if __name__ == "__main__":
    main()
