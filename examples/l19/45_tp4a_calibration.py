"""TP4 (a). Étalonner une caméra avec un damier : K et la distorsion, et ce qu'on en sait vraiment.

Vingt images d'un damier tenu près et loin, penché de tous côtés, jusque dans les coins de l'image.  Chaque
coin donne deux équations ; les inconnues sont K = (fx, fy, cx, cy), la distorsion (k1, k2, p1, p2, k3) et une
pose de six nombres par image.  On minimise l'écart entre les coins vus et les coins reprojetés.

Un petit résidu ne prouve rien : trois images prises presque de face se reprojettent très bien avec une focale
fausse.  On regarde donc l'écart-type de chaque paramètre, et on prédit chaque image par les autres.  Ici la
caméra est simulée, donc connue ; avec FACTORLAB_DATA, on étalonne aussi la vraie caméra des exemples
d'OpenCV, dont le résultat publié vient d'une fenêtre de coins trop grande.
"""

import os
from pathlib import Path

import numpy as np

from vision3d.boards import Checkerboard
from vision3d.calibrate import calibrate, leave_one_out, next_pose, projection_uncertainty
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.images import read_images
from vision3d.render import board_poses, render_set

BOARD = Checkerboard(9, 6, square_m=0.025)  # coins intérieurs, cases de 25 mm
TRUE = Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), (640, 480))


def photographs(rng, n, **how):
    """n images du damier par la caméra connue."""
    return render_set(TRUE, BOARD, n, rng, poses=board_poses(TRUE, BOARD, n, rng, **how)).named()


def etalonner(images, title):
    """Coins, ajustement, résidu, et la prédiction de chaque image par les autres."""
    views = detect_views(images, BOARD).views
    found = calibrate(views, "brown5")
    cross = leave_one_out(found)
    print(
        f"{title} : {len(views)} images, résidu {found.rms_px:.3f} px, images prédites {cross.rms_px:.3f} px"
    )
    for name, value, sigma in zip(found.names, found.camera.parameters, found.std, strict=True):
        print(f"  {name:<3} = {value:10.4f} ± {sigma:.4f}")
    return found, cross


def main():
    from figures import panels, save

    rng = np.random.default_rng(5)
    images = photographs(rng, 20)
    good, cross = etalonner(images, "vingt images penchées")
    poor, _ = etalonner(photographs(rng, 4, tilt_rad=(0.0, 0.2)), "quatre images presque de face")
    print("K =", good.camera.matrix.round(2), sep="\n")
    print("prochaine pose utile :", next_pose(poor, BOARD).words)
    real = sample_images()

    figure, axes = panels(2, 2, size=(12.0, 9.0), title="TP4 (a). Étalonnage par damier")
    draw_corners(axes[0], *images[0], good)
    draw_straight(axes[1], *images[0], good)
    draw_uncertainty(axes[2], good, "vingt images : écart-type d'une projection (px)")
    draw_uncertainty(axes[3], poor, "quatre images presque de face : écart-type (px)")
    save(figure)

    error = np.abs(good.camera.intrinsics - TRUE.intrinsics)
    assert (error < 4 * good.std[:4]).all(), "l'erreur est de l'ordre de l'écart-type annoncé"
    assert cross.rms_px < 1.1 * good.rms_px, "une image jamais vue est prédite aussi bien"
    assert poor.rms_px < 1.2 * good.rms_px, "quatre images : le résidu est aussi petit,"
    assert poor.std[0] > 5 * good.std[0], "mais la focale est bien moins sûre"
    if real is not None:
        assert len(real.views) == 13
        assert real.rms_px < 0.20, "le résultat publié par OpenCV : 0,39 px, fenêtre de 11 trop grande"


def sample_images():
    """La caméra de gauche des exemples d'OpenCV, si elle est là."""
    folder = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"
    files = sorted(folder.glob("left[01]?.jpg"))
    if not files:
        return None
    return etalonner(read_images(files), "images d'OpenCV")[0]


def draw_corners(axes, name, image, found):
    """Les coins vus, et leurs résidus agrandis."""
    import figures

    view = next(one for one in found.views if one.name == name)
    residuals = found.residuals[found.views.index(view)]
    axes.imshow(image, cmap="gray", vmin=0, vmax=255)
    axes.plot(*view.pixels.T, "o", color=figures.GREEN, markersize=4, markerfacecolor="none")
    look = {"angles": "xy", "scale_units": "xy", "scale": 1e-3, "width": 0.003, "color": figures.ORANGE}
    axes.quiver(*view.pixels.T, *residuals.T, **look)
    axes.set(title="les coins, et leurs résidus × 1000", xlabel="x (px)", ylabel="y (px)")
    axes.grid(visible=False)


def draw_straight(axes, name, image, found):
    """La même image sans distorsion : les droites sont droites."""
    straight, _ = found.camera.undistort(image)
    axes.imshow(straight, cmap="gray", vmin=0, vmax=255)
    axes.set(title=f"{name} sans distorsion", xlabel="x (px)", ylabel="y (px)")
    axes.grid(visible=False)


def draw_uncertainty(axes, found, title):
    """À combien de pixels près on sait où tombe un rayon."""
    sure = projection_uncertainty(found, grid=(33, 25))
    x, y = sure.pixels[:33, 0], sure.pixels[::33, 1]
    levels = [0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1, 2, 5, 10]
    axes.contourf(x, y, np.log10(np.clip(sure.map_px, 0.01, 10)), levels=np.log10(levels))
    lines = axes.contour(x, y, sure.map_px, levels=levels, colors="white", linewidths=0.7)
    axes.clabel(lines, fmt="%g")
    axes.plot(*np.concatenate([view.pixels for view in found.views]).T, ".", color="white", markersize=1.5)
    axes.set(title=title, xlabel="x (px)", ylabel="y (px)", ylim=(479.5, -0.5), aspect="equal")
    axes.grid(visible=False)


if __name__ == "__main__":
    main()
