"""TP4 (a). Calibrer une caméra avec un damier : K et la distorsion, et ce qu'on en sait vraiment.

Vingt images d'un damier tenu près et loin, penché de tous côtés, jusque dans les coins de l'image.  Chaque
coin donne deux équations ; les inconnues sont K = (fx, fy, cx, cy), la distorsion (k1, k2, p1, p2, k3) et une
pose de six nombres par image.  On minimise l'écart entre les coins vus et les coins reprojetés.

Un petit résidu ne prouve rien : trois images prises presque de face se reprojettent très bien avec une focale
fausse.  On regarde donc l'écart-type de chaque paramètre, et on prédit chaque image par les autres.  Ici la
caméra est simulée, donc connue ; avec FACTORLAB_DATA, on calibre aussi la vraie caméra des exemples
d'OpenCV, dont le résultat publié vient d'une fenêtre de coins trop grande.

`python examples/l19/45_tp4a_calibration.py damier/*.jpg` calibre la vôtre : 9 × 6 coins intérieurs ; la
taille des cases ne change pas K.
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


def solve(images, title):
    """Coins, ajustement, résidu, et la prédiction de chaque image par les autres."""
    from figures import say

    views = detect_views(images, BOARD).views
    found = calibrate(views, "brown5")
    cross = leave_one_out(found)
    say(f"{title} : {len(views)} images, résidu {found.rms_px:.3f} px, images prédites {cross.rms_px:.3f} px")
    for name, value, sigma in zip(found.names, found.camera.parameters, found.std, strict=True):
        say(f"  {name:<3} = {value:10.4f} ± {sigma:.4f}")
    return found, cross


def main():
    from claims import claim, table
    from figures import panels, save, say

    rng = np.random.default_rng(5)
    images = photographs(rng, 20)
    good, cross = solve(images, "vingt images penchées")
    poor, _ = solve(photographs(rng, 4, tilt_rad=(0.0, 0.2)), "quatre images presque de face")
    print("K =", good.camera.matrix.round(2), sep="\n")
    pose = next_pose(poor, BOARD)
    x, y = pose.outline_px.mean(axis=0)
    say(f"prochaine pose utile aux quatre images : damier vers ({x:.0f}, {y:.0f}) px, "
        f"à {pose.distance_m:.2f} m, penché de {np.degrees(pose.tilt_rad):.0f}°")  # fmt: skip
    real, source = photos()

    figure, axes = panels(2, 2, size=(12.0, 9.0), title="TP4 (a). Calibration par damier")
    draw_corners(axes[0], *images[0], good)
    draw_straight(axes[1], images[0][1], good)
    draw_uncertainty(axes[2], good, "Vingt images : écart-type d'une projection (px)")
    draw_uncertainty(axes[3], poor, "Quatre images presque de face : écart-type (px)")
    save(figure)

    headings = ("paramètre", "vérité (simulée)", "trouvé ± σ", *([f"{source} ± σ"] if real else []))
    found = [told(good), *([told(real)] if real else [])]
    rows = zip(good.names, TRUE.parameters, *found, strict=True)
    table("K et distorsion (fx, fy, cx, cy en pixels)", headings, list(map(list, rows)))
    error = np.max(np.abs(good.camera.intrinsics - TRUE.intrinsics) / good.std[:4])
    if real is not None:
        # le résultat publié par OpenCV pour ses photos : 0,39 px, fenêtre de coins trop grande
        high = 0.2 if source == "photos OpenCV" else None
        claim("TP4a", "résidu RMS des photos", real.rms_px, "px", high=high, source=source)
        claim("TP4a", "écart-type de leur focale", real.std[0], "px", high=high and 1.0, source=source)
    claim("TP4a", "vingt images : pire erreur de K, en σ annoncés", error, "σ", high=4.0)
    claim("TP4a", "images jamais vues / vues : rapport des résidus", cross.rms_px / good.rms_px, high=1.1)
    claim("TP4a", "quatre images de face / vingt : résidus", poor.rms_px / good.rms_px, high=1.2)
    claim("TP4a", "quatre images de face / vingt : σ de la focale", poor.std[0] / good.std[0], low=5.0)


def told(calibration):
    """Chaque paramètre avec son écart-type, deux chiffres à celui-ci."""
    for value, sigma in zip(calibration.camera.parameters, calibration.std, strict=True):
        digits = max(0, 1 - int(np.floor(np.log10(sigma))))
        yield f"{value:.{digits}f} ± {sigma:.{digits}f}".replace(".", ",").replace("-", "−")


def photos():
    """Vos images, ou celles de gauche des exemples d'OpenCV si elles sont là ; et leur nom."""
    from figures import files_given

    if given := files_given():
        return solve(read_images(given), "vos images")[0], f"{len(given)} photos"
    folder = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"
    files = sorted(folder.glob("left[01]?.jpg"))
    return (solve(read_images(files), "images d'OpenCV")[0], "photos OpenCV") if files else (None, "")


def draw_corners(axes, name, image, found):
    """Les coins vus, et leurs résidus agrandis."""
    import figures

    view = next(one for one in found.views if one.name == name)
    residuals = found.residuals[found.views.index(view)]
    axes.imshow(image, cmap="gray", vmin=0, vmax=255)
    axes.plot(*view.pixels.T, "o", color=figures.GREEN, markersize=4, markerfacecolor="none")
    look = {"angles": "xy", "scale_units": "xy", "scale": 1e-3, "width": 0.003, "color": figures.ORANGE}
    axes.quiver(*view.pixels.T, *residuals.T, **look)
    axes.set(title="Les coins, et leurs résidus × 1000", xlabel="x (px)", ylabel="y (px)")
    axes.grid(visible=False)


def draw_straight(axes, image, found):
    """La même image sans distorsion : les droites sont droites."""
    straight, _ = found.camera.undistort(image)
    axes.imshow(straight, cmap="gray", vmin=0, vmax=255)
    axes.set(title="La même image, sans distorsion", xlabel="x (px)", ylabel="y (px)")
    axes.grid(visible=False)


def draw_uncertainty(axes, found, title):
    """À combien de pixels près on sait où tombe un rayon."""
    sure = projection_uncertainty(found, grid=(33, 25))
    x, y = sure.pixels[:33, 0], sure.pixels[::33, 1]
    levels = [0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1, 2, 5, 10]
    axes.contourf(x, y, np.log10(np.clip(sure.map_px, 0.01, 10)), levels=np.log10(levels))
    lines = axes.contour(x, y, sure.map_px, levels=levels, colors="white", linewidths=0.7)
    axes.clabel(lines, levels=levels[::2], fmt="%g")  # une sur deux : les coins sont serrés
    axes.plot(*np.concatenate([view.pixels for view in found.views]).T, ".", color="white", markersize=1.5)
    axes.set(title=title, xlabel="x (px)", ylabel="y (px)", ylim=(479.5, -0.5), aspect="equal")
    axes.grid(visible=False)


if __name__ == "__main__":
    main()
