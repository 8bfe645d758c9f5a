"""V2 (seconde partie).  La profondeur : deux vues, une base connue, et ce que vaut la mesure.

Une caméra qui avance d'un pas connu, ou deux caméras : chaque point vu deux fois est à l'intersection de deux
rayons.  Z = f B / d (d : la disparité, en pixels), donc une erreur σ_d devient σ_Z = Z² σ_d / (f B) : la
profondeur se perd comme le carré de la distance, et se regagne avec la base B.  La triangulation annonce son
écart-type ; on vérifie ici qu'elle dit vrai.  Une caméra 3-D active (lumière structurée, temps de vol) mesure
Z sans chercher de correspondances : elle voit aussi un mur blanc.

Le bureau est rendu, donc la vérité est connue ; avec FACTORLAB_DATA, on triangule aussi le damier des vraies
paires d'OpenCV, dont les cases font 25 mm.
"""

import os
from pathlib import Path

import figures
import numpy as np
from claims import claim
from figures import BLUE, ORANGE, TRUTH

from vision3d.boards import Checkerboard
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.features import detect_features, match_features, refine_matches
from vision3d.images import read_images
from vision3d.render import desk, render_journey, sideways_poses, surface_points
from vision3d.rigid import transform
from vision3d.triangulate import triangulate

CAMERA = Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), (640, 480))
HERE = np.array([1.0, 0, 0, 0, 0, 0, 0])
BOARD = Checkerboard(9, 6, square_m=0.025)
STEP = 0.12  # m, entre les deux vues


def two_views(views, poses, scene):
    """Apparier, affiner, trianguler : pixels, profondeur trouvée et vraie, écart-type annoncé (m)."""
    a, b = (detect_features(view.image, "sift") for view in views)
    pairs = match_features(a, b)
    here, there = pairs.points(a, b)
    there, cov, ok = refine_matches(
        views[0].image, views[1].image, here, there, warps=pairs.warps(a, b), radius_px=5
    )
    pixels, half = np.stack([here[ok], there[ok]]), 0.5 * np.stack([cov[ok], cov[ok]])
    points = triangulate(CAMERA, poses, pixels, sigma_px=half)
    true, _ = surface_points(CAMERA, poses[0], scene, here[ok])
    good = points.ok & (points.chi2 < 6.63) & np.isfinite(true).all(axis=1)
    return here[ok][good], points.points[good, 2], true[good, 2], np.sqrt(points.covs[good, 2, 2])


def squares(rng):
    """Longueurs des cases d'un damier (mm) triangulées par une paire de caméras, et d'où il vient."""
    from vision3d.stereo.fit import calibrate_stereo
    from vision3d.stereo.view_pairs import pairs_of_views

    folder = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"
    sides = [sorted(folder.glob(f"{side}[01]?.jpg")) for side in ("left", "right")]
    if all(sides):
        pairs = pairs_of_views(*(detect_views(read_images(files), BOARD).views for files in sides))
        rig = calibrate_stereo(pairs, "brown5").rig
        cameras, right_T_left = (rig.left, rig.right), rig.right_T_left
        seen = [np.stack([p.left.pixels, p.right.pixels]) for p in pairs if p.left and p.right]
    else:
        cameras, right_T_left = (CAMERA, CAMERA), np.array([1.0, 0, 0, 0, -STEP, 0, 0])
        board = BOARD.points + np.array([-0.1, -0.06, 0.5])
        true = np.stack([CAMERA.project(board), CAMERA.project(transform(right_T_left, board))])
        seen = [true + 0.1 * rng.standard_normal(true.shape) for _ in range(10)]
    lengths = []
    for pixels in seen:
        points = triangulate(cameras, np.stack([HERE, right_T_left]), pixels, sigma_px=0.2).points
        lengths.append(np.linalg.norm(np.diff(points.reshape(6, 9, 3), axis=1), axis=2).ravel())
    return 1000 * np.concatenate(lengths), "photos réelles" if all(sides) else "simulé"


def main():
    rng = np.random.default_rng(4)
    scene, poses = desk(rng), sideways_poses(2, STEP)
    views = render_journey(CAMERA, poses, scene, rng=rng)
    where, z, true, sigma = two_views(views, poses, scene)
    lengths, origin = squares(rng)

    figure, axes = figures.panels(2, 2, size=(11.5, 7.6), title="V2. La profondeur par deux vues")
    axes[0].axis("off")
    draw_depth(figure, axes, views[0].image, (where, z, true, sigma))
    axes[3].hist(lengths, bins=30, color=BLUE, alpha=0.6)
    axes[3].axvline(25.0, label="déclaré : 25 mm", **TRUTH)
    axes[3].set(title=f"Cases d'un damier ({origin})", xlabel="longueur (mm)", ylabel="cases")
    axes[3].legend()
    figures.save(figure)

    error, honest = np.abs(z - true), np.abs(z - true) / sigma
    far, near = true > 2.0, true < 1.2
    growth = np.median(sigma[far]) / np.median(sigma[near])
    square = (np.median(true[far]) / np.median(true[near])) ** 2
    claim("V2", "profondeur par deux vues, erreur médiane", 1000 * np.median(error), "mm", high=3)
    claim("V2", "erreur sur σ annoncé (1 si honnête)", np.median(honest) / 0.6745, low=0.7, high=1.4)
    claim("V2", "croissance de σ avec la distance, sur celle de Z²", growth / square, low=0.5, high=2)
    claim("V2", "case de 25 mm, par deux vues", lengths.mean(), "mm", low=24.9, high=25.1, source=origin)
    assert len(z) > 500


def draw_depth(figure, axes, image, measured):
    """La profondeur, son erreur, et l'erreur en unités de l'écart-type annoncé."""
    where, z, true, sigma = measured
    axes[0].imshow(image, cmap="gray")
    cloud = axes[0].scatter(*where.T, c=z, s=6, cmap="viridis")
    axes[0].set(title="Profondeur des points appariés (m)", xlim=(0, 639), ylim=(479, 0))
    figure.colorbar(cloud, ax=axes[0], shrink=0.8)
    axes[1].plot(true, 1000 * np.abs(z - true), ".", color=BLUE, markersize=3, label="|erreur|")
    line, k = np.linspace(true.min(), true.max(), 50), np.median(sigma / true**2)
    axes[1].plot(line, 1000 * k * line**2, color=ORANGE, label="σ annoncé, ∝ Z²")
    axes[1].set(title="L'erreur croît comme Z²", xlabel="Z (m)", ylabel="erreur (mm)")
    axes[1].set_ylim(0, 5000 * k * line[-1] ** 2)
    axes[1].legend(loc="upper left")
    t = np.linspace(-5, 5, 200)
    axes[2].hist(np.clip((z - true) / sigma, -5, 5), bins=41, density=True, color=BLUE, alpha=0.6)
    axes[2].plot(t, np.exp(-0.5 * t**2) / np.sqrt(2 * np.pi), color=ORANGE, label="loi normale")
    axes[2].set(title="Erreur / σ annoncé", xlabel="erreur / σ (sans unité)", ylabel="densité")
    axes[2].legend()


if __name__ == "__main__":
    main()
