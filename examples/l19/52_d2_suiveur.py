"""D2 (★★). Un robot suiveur de ligne, simulé de bout en bout : caméra, détecteur, EKF, PID.

Vingt fois par seconde : une image de 40 × 60 pixels (`image_sol`), le centre de la ligne en bas (ici) et au
milieu (devant), un PID qui commande la vitesse angulaire, deux roues qui obéissent avec un peu de retard.

- **L'image.**  La caméra ne bouge pas sur le robot : l'homographie inverse donne une fois pour toutes le
  point du sol que voit chaque pixel.  Il reste à mesurer sa distance à la ligne.
- **Le PID.**  Sur un cercle de rayon R, la ligne vue à la distance L est décalée de L²/2R, et il faut tourner
  à v/R : kp = 2v/L² suffit, sans intégrale (« poursuite pure »).  Plus petit, le robot sort du virage ; plus
  grand, ou avec une intégrale, c'est le point regardé qui est sur la ligne, et le robot coupe le virage.
- **L'EKF dans la boucle.**  Roues et gyromètre prédisent la pose, la ligne lue sur sa carte la corrige.  Le
  long d'une ligne droite, rien ne dit où l'on est : l'ellipse s'allonge, les virages la resserrent.
- **Jusqu'à quel bruit tient-il ?**  Avec un seuil et la moyenne d'une rangée, jusqu'à σ ≈ 25 niveaux de
  gris : quelques pixels du sol passés sous le seuil, loin de la ligne, tirent la moyenne.  En cherchant une
  bande de la bonne largeur sur cinq rangées, jusqu'à 95.  Avec l'EKF, qui roule sur sa carte entre deux
  lectures, jusqu'à 115.
- **Et quel flou ?**  Le bougé s'étale surtout le long de la ligne, et gêne peu : c'est le retard d'une pose
  longue qui coûte.  Caméra seule : 0,4 s (12 cm de filé) ; l'EKF, qui sait de quand date l'image : 0,8 s.

La page `factorlab l19 suiveur` fait la même chose avec des curseurs.  Le film est écrit en GIF.
"""

import time
from itertools import pairwise

import numpy as np

from factorlab.l19.follower import CAMERA, MOUNT, FollowerSettings, simulate, sweep, write_film
from factorlab.l19.follower.robot import view
from vision3d.lines import plane_homography
from vision3d.render import GroundLine

INK, FLOOR = 0.12 * 235, 0.7 * 235  # niveaux de gris de la ligne et du sol


def image_sol(pose, ligne, largeur=0.02, taille=(40, 60), camera=CAMERA, mount=MOUNT, bruit=0.0, rng=None):
    """L'image du sol (40, 60) que voit un robot en `pose` (x, y, cap), par homographie inverse.

    `ligne` est une courbe y(x), fonction ou points (N, 2) en mètres ; `largeur` est celle de la bande, en
    mètres, et `bruit` un écart-type en niveaux de gris.
    """
    height, width = taille
    fx, fy, cx, cy = camera.intrinsics[:4]
    v, u = np.mgrid[:height, :width]
    rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(taille)])
    ground = np.tensordot(plane_homography(mount.pose)[0], rays, axes=1)  # l'homographie inverse
    ground = ground[:2] / np.where(ground[2] > 0, ground[2], np.nan)  # rien au-dessus de l'horizon
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x, y = pose[0] + c * ground[0] - s * ground[1], pose[1] + s * ground[0] + c * ground[1]
    if callable(ligne):
        at = np.arange(pose[0] - 1.0, pose[0] + 1.0, 0.01)
        ligne = np.column_stack([at, ligne(at)])
    near = ligne[np.hypot(ligne[:, 0] - pose[0], ligne[:, 1] - pose[1]) < 1.0]
    away = np.full(taille, np.inf)
    for start, end in pairwise(near):
        step = end - start
        along = ((x - start[0]) * step[0] + (y - start[1]) * step[1]) / (step @ step)
        foot = np.clip(along, 0.0, 1.0)
        away = np.fmin(away, np.hypot(x - start[0] - foot * step[0], y - start[1] - foot * step[1]))
    grain = np.abs(np.gradient(ground[1], axis=1))  # la largeur d'un pixel au sol
    share = np.nan_to_num(np.clip(0.5 + (0.5 * largeur - away) / grain, 0.0, 1.0))  # bords adoucis
    image = FLOOR + share * (INK - FLOOR)
    if bruit:
        image = image + bruit * (rng or np.random.default_rng()).standard_normal(taille)
    return np.clip(image + 0.5, 0, 255).astype(np.uint8)


def against_compiled(drive, count=12):
    """Écart moyen (niveaux de gris) avec le rendu compilé le long d'un trajet, et images par seconde."""
    line = GroundLine(drive.line, 0.02)
    poses = drive.poses[:: len(drive.poses) // count]
    off = [
        np.abs(image_sol(pose, drive.line).astype(float) - view().image(line, pose)).mean() for pose in poses
    ]
    spent = []
    for render in (lambda pose: image_sol(pose, drive.line), lambda pose: view().image(line, pose)):
        began = time.perf_counter()
        for pose in poses:
            render(pose)
        spent.append((time.perf_counter() - began) / len(poses))
    return max(off), 1.0 / np.array(spent)


LOOPS = {
    "seuil et moyenne": (FollowerSettings(detector="threshold", bridging_s=0.0), (20, 25, 30)),
    "bandes": (FollowerSettings(bridging_s=0.0), (80, 95, 110)),
    "bandes et EKF": (FollowerSettings(), (100, 115, 130)),
}


def main():
    from claims import claim
    from figures import BLUE, GREEN, ORANGE, PINK, out_folder, panels, save

    simulate(steps=2)  # la première fois compile
    began = time.perf_counter()
    drive = simulate(steps=500, keep_images=True)
    spent = time.perf_counter() - began
    noisy = [simulate(FollowerSettings(noise=60.0, seed=seed)) for seed in range(6)]
    off, per_second = against_compiled(drive)
    tables = {name: sweep(noises, (0.0,), 4, own, 250) for name, (own, noises) in LOOPS.items()}
    late = {
        name: sweep((0.0,), (0.1, 0.3, 0.6), 1, FollowerSettings(bridging_s=s), 250)
        for name, s in {"caméra seule": 0.0, "avec l'EKF": 1.0}.items()
    }

    figure, axes = panels(2, 3, size=(14.0, 7.6), title="D2. Suivre une ligne avec 40 × 60 pixels")
    draw_way(axes[0], drive)
    draw_cameras(axes[1], (0.0, 25.0, 60.0, 115.0))
    axes[2].plot(drive.t_s, 100 * drive.offsets_m, color=BLUE, label="sans bruit")
    axes[2].plot(noisy[0].t_s, 100 * noisy[0].offsets_m, color=ORANGE, label="bruit σ = 60")
    axes[2].set(title="Écart à la ligne", xlabel="temps (s)", ylabel="écart à gauche (cm)", ylim=(-2, 2))
    axes[2].legend()
    for (name, table), colour in zip(tables.items(), (PINK, BLUE, GREEN), strict=True):
        axes[3].plot(table.noises, 100 * table.kept[:, 0], "o-", color=colour, label=name)
    axes[3].set(title="Jusqu'à quel bruit ?", xlabel="bruit σ (niveaux de gris)", ylabel="ligne gardée (%)")
    axes[3].set(ylim=(-5, 150), yticks=range(0, 101, 20))
    axes[3].legend(loc="upper right")
    for (name, table), colour in zip(late.items(), (BLUE, GREEN), strict=True):
        rms, lost = 100 * table.rms_m[0], table.kept[0] < 1.0
        axes[4].plot(1000 * table.blurs, rms, "o-", color=colour, label=name)
        if lost.any():
            axes[4].plot(1000 * table.blurs[lost], rms[lost], "kX", markersize=9, label="ligne perdue")
    axes[4].set(title="Temps de pose : une image vieille", xlabel="temps de pose (ms)")
    axes[4].set(ylabel="écart RMS (cm)", ylim=(0, None))
    axes[4].legend()
    draw_errors(axes[5], noisy)
    save(figure)
    print(f"film : {write_film(out_folder() / '52_d2_suiveur.gif', drive, 5, faster=3.0)}")

    claim("D2", "écart latéral RMS sur 500 pas, sans bruit", 100 * drive.rms_m, "cm", high=1.0)
    for name, low, high in (("seuil et moyenne", 15, 40), ("bandes", 60, 110), ("bandes et EKF", 80, 130)):
        claim("D2", f"bruit tenu, {name}", tables[name].noise_limit(), "niveaux", low=low, high=high)
    claim("D2", "pose tenue, avec l'EKF", 1000 * late["avec l'EKF"].blur_limit(), "ms", low=300)
    anees = np.mean([one.nees.mean() for one in noisy]) / 3.0
    claim("D2", "NEES moyen de l'EKF par dimension, bruit σ = 60", anees, low=0.6, high=1.5)
    ends = [np.hypot(*(path - one.poses)[-1, :2]) for one in noisy for path in (one.estimates, one.odometry)]
    claim("D2", "erreur finale de l'EKF", 100 * np.mean(ends[::2]), "cm", high=2.0)
    claim("D2", "images par seconde, rendu compilé", per_second[1], "1/s")
    claim("D2", "simulation, fois plus vite que le temps réel", drive.t_s[-1] / spent, "×")
    print(f"image_sol en NumPy : {per_second[0]:.0f} images par seconde")
    assert off < 1.0, "image_sol et le rendu compilé montrent la même chose, en niveaux de gris"
    assert np.mean(ends[1::2]) > 5 * np.mean(ends[::2]), "les roues et le gyromètre seuls dérivent"
    assert (late["avec l'EKF"].rms_m < 0.01).all()
    assert drive.kept
    assert len(drive.t_s) == 500
    assert all(one.kept for one in noisy), "500 pas avec du bruit"


def draw_way(axes, drive):
    """La trajectoire sur la ligne."""
    from figures import BLUE, ORANGE, PINK

    axes.plot(*drive.line.T, color="#cccccc", linewidth=6, label="ligne")
    axes.plot(*drive.odometry[:, :2].T, ":", color=PINK, label="roues et gyromètre seuls")
    axes.plot(*drive.poses[:, :2].T, color=ORANGE, label="vraie")
    axes.plot(*drive.estimates[:, :2].T, "--", color=BLUE, label="estimée (EKF)")
    axes.set(title="Trajectoire, 500 pas", xlabel="x (m)", ylabel="y (m)", xlim=(-0.2, 7.7), ylim=(-0.6, 0.6))
    axes.legend(ncols=2, loc="lower left", fontsize=8)


def draw_cameras(axes, noises):
    """Ce que voit la caméra au même endroit, de plus en plus bruité."""
    from figures import ORANGE

    shown = [simulate(FollowerSettings(noise=noise), 60, keep_images=True) for noise in noises]
    gap = np.full((40, 2), 255, np.uint8)
    rows = [np.hstack([shown[k].images[-1], gap, shown[k + 1].images[-1]]) for k in (0, 2)]
    axes.imshow(
        np.vstack([rows[0], np.full((10, 122), 255, np.uint8), rows[1]]), cmap="gray", vmin=0, vmax=255
    )
    for k, (noise, one) in enumerate(zip(noises, shown, strict=True)):
        right, down = 62 * (k % 2), 50 * (k // 2)
        axes.plot(one.columns[-1] + right, np.array([37, 20]) + down, "o", color=ORANGE, markersize=5)
        said = "" if one.used[-1] else " : rien de sûr"
        axes.text(right, down - 2, f"σ = {noise:.0f}{said}", fontsize=8.5)
    axes.set_title("Ce que voit la caméra, et ce qu'elle y lit", pad=14)
    axes.axis("off")


def draw_errors(axes, drives):
    """Erreur de l'EKF et de l'odométrie, tous trajets."""
    from figures import BLUE, PINK

    for k, one in enumerate(drives):
        for path, colour, name in (
            (one.odometry, PINK, "roues et gyromètre seuls"),
            (one.estimates, BLUE, "EKF"),
        ):
            away = 100 * np.hypot(*(path - one.poses)[:, :2].T)
            axes.semilogy(one.t_s, away, color=colour, linewidth=1.0, label="" if k else name)
    axes.set(title="Où croit-il être ?", xlabel="temps (s)", ylabel="erreur de position (cm)")
    axes.set_ylim(1e-4, None)
    axes.legend(loc="lower right")


if __name__ == "__main__":
    main()
