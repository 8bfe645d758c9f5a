"""P5. Cinquième piège : mesurer dans une image sans en avoir ôté la distorsion.

Un damier plan, dont on connaît les cases (25 mm).  Ses quatre coins extrêmes donnent une homographie, des
pixels aux millimètres ; les cinquante autres devraient alors tomber où ils sont.  Une homographie garde les
droites droites, et une image distordue ne le fait pas : elle ne peut absorber la distorsion, et l'erreur se
compte en millimètres, jamais la même d'un endroit de l'image à l'autre.

- Remède : étalonner une fois (ici sur une image sur deux), corriger les pixels, puis mesurer (sur les
  autres, que l'étalonnage n'a pas vues).
- Corriger les points suffit, et coûte moins que corriger l'image entière.
- Un réglage de l'optique (zoom, mise au point) change la distorsion : étalonner de nouveau.

Avec FACTORLAB_DATA : les photos de damier d'OpenCV ; sans, des photos simulées par une caméra connue.
"""

import os
from pathlib import Path

import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, panels, save, say

from vision3d.boards import Checkerboard
from vision3d.calibrate import calibrate
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.images import read_images
from vision3d.render import render_set
from vision3d.robust import fit_homography, transfer

SQUARE_MM = 25.0
BOARD = Checkerboard(9, 6, square_m=SQUARE_MM / 1000)
TRUE = Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), (640, 480))
CORNERS = [0, 8, 45, 53]  # les quatre coins extrêmes des 9 × 6
GRID_MM = SQUARE_MM * np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), axis=-1).reshape(-1, 2)


def photographs():
    """Images nommées d'un damier, et d'où elles viennent."""
    files = sorted(
        (Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv").glob("left[01]?.jpg")
    )
    if files:
        return read_images(files), "photos d'OpenCV"
    return render_set(TRUE, BOARD, 12, np.random.default_rng(25)).named(), "simulé"


def measure(pixels):
    """Erreur (mm), (54, 2), des coins mesurés par l'homographie des quatre extrêmes."""
    to_mm = fit_homography(pixels[CORNERS], GRID_MM[CORNERS]).model
    return transfer(to_mm, pixels) - GRID_MM


def straight(camera, pixels):
    """Les pixels qu'une caméra sans distorsion aurait vus."""
    return camera.undistort_points(pixels) * camera.intrinsics[:2] + camera.intrinsics[2:]


def bend_px(pixels):
    """Écart le plus grand, en pixels, d'une rangée de coins à la droite de ses deux extrémités."""
    rows = pixels.reshape(6, 9, 2)
    along = rows[:, -1] - rows[:, 0]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.linalg.norm(along, axis=1)[:, None]
    return np.abs(np.einsum("rcj,rj->rc", rows - rows[:, :1], normal)).max()


def main():
    images, source = photographs()
    views = detect_views(images, BOARD).views
    found = calibrate(views[::2], "brown5")
    tests = views[1::2]
    raw = np.array([measure(view.pixels) for view in tests])
    mended = np.array([measure(straight(found.camera, view.pixels)) for view in tests])
    bends = [(bend_px(view.pixels), bend_px(straight(found.camera, view.pixels))) for view in tests]
    say(f"{len(views[::2])} images pour étalonner (résidu {found.rms_px:.2f} px), {len(tests)} pour mesurer")
    for view, (before, after) in zip(tests, bends, strict=True):
        say(f"  {view.name} : une rangée s'écarte d'une droite de {before:.1f} px, puis {after:.1f} px")

    worst = {
        name: np.linalg.norm(e, axis=2).max(axis=1) for name, e in (("oubliée", raw), ("corrigée", mended))
    }
    good, bad = np.median(worst["corrigée"]), np.median(worst["oubliée"])
    claim("P5", "pire erreur sur 200 mm, distorsion corrigée", good, "mm", high=0.6, source=source)
    claim("P5", "pire erreur sur 200 mm, distorsion oubliée", bad, "mm", low=1.0, source=source)
    ratio = np.sqrt(np.mean(raw**2) / np.mean(mended**2))
    claim("P5", "erreur RMS, oubliée sur corrigée", ratio, low=4, source=source)
    bent = np.median(bends, axis=0)
    claim(
        "P5", "courbure d'une rangée de coins, oubliée sur corrigée", bent[0] / bent[1], low=3, source=source
    )
    chosen = int(np.argmax([before for before, _ in bends]))
    draw(dict(images)[tests[chosen].name], tests[chosen], raw, mended, chosen)


def draw(image, view, raw, mended, chosen):
    """Une photo et ses rangées ; les erreurs sur le plan ; toutes les photos."""
    figure, (a, b, c) = panels(
        1, 3, size=(15.0, 4.6), title="P5. La distorsion oubliée fausse les millimètres"
    )
    a.imshow(image, cmap="gray", vmin=0, vmax=255)
    for row in view.pixels.reshape(6, 9, 2):
        a.plot(*row.T, "o", color=BLUE, markersize=3)
        a.plot(*row[[0, -1]].T, color=ORANGE, linewidth=1.2)
    a.set(title="Les coins ne sont pas sur la droite de leurs extrêmes")
    a.axis("off")
    b.plot(*GRID_MM.T, "+", color="black", markersize=9, label="vrais")
    for errors, colour, name in ((raw, ORANGE, "oubliée"), (mended, GREEN, "corrigée")):
        b.plot(*(GRID_MM + 5 * errors[chosen]).T, ".", color=colour, label=f"{name} (× 5)")
    b.set(
        title="La même photo, mesurée sur le plan",
        xlabel="x (mm)",
        ylabel="y (mm)",
        aspect="equal",
        ylim=(140, -62),
    )
    b.legend(loc="upper center", ncols=3, fontsize=8)
    bins = np.linspace(0, np.linalg.norm(raw, axis=2).max() * 1.02, 40)
    for errors, colour, name in ((raw, ORANGE, "distorsion oubliée"), (mended, GREEN, "corrigée")):
        c.hist(np.linalg.norm(errors, axis=2).ravel(), bins, color=colour, alpha=0.7, label=name)
    c.set(title=f"Toutes les mesures ({len(raw)} photos)", xlabel="erreur (mm)", ylabel="coins", yscale="log")
    c.legend()
    save(figure)


if __name__ == "__main__":
    main()
