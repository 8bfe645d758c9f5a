"""C3 (première partie).  De la lumière au pixel utile : la caméra, puis la préparation de l'image.

- Modèle de caméra : u = fx X/Z + cx, puis la distorsion radiale, x (1 + k₁r² + k₂r⁴), qui courbe les droites.
  On la corrige avant de mesurer quoi que ce soit.
- Gris : 0,299 R + 0,587 V + 0,114 B, et non la moyenne : l'œil, et le capteur, voient surtout le vert.
- Seuil adaptatif : chaque pixel contre la moyenne de son voisinage.  Un seuil unique noircit toute une ombre.
- Flou : le bruit fait des coins partout ; un flou les ôte, et rentre les vrais d'un ou deux pixels.
- Égalisation : elle étale les niveaux, donc le bruit avec eux ; le rapport du contraste au bruit ne gagne
  rien.  Elle ne sert qu'à ce qui a un seuil fixe, comme FAST ; Harris, au seuil relatif, s'en passe.
- Segmentation simple : couleur, puis ouverture et fermeture ; elle se juge à l'intersection sur l'union.

La suite de la chaîne : points d'intérêt et deux vues (`12_c3_deux_vues.py`), puis détection d'objets
(`13_c3_detection.py`).  Avec FACTORLAB_DATA, la page à l'ombre est une vraie photo de journal.
"""

import os
from pathlib import Path

import figures
import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, say

from vision3d.camera import Camera
from vision3d.image import adaptive_threshold, corners, equalise, gaussian_blur, grey, threshold
from vision3d.objects import ColourRange, find_blobs

CAMERA = Camera("brown5", (520.0, 520.0, 319.5, 239.5), (-0.28, 0.09, 0.0, 0.0, -0.02), (640, 480))
NOISE = 4.0  # niveaux
SQUARES = [(70 + 90 * i, 60 + 90 * j) for j in range(3) for i in range(4)]


def bowed_lines():
    """Les droites d'un mur quadrillé, vues par la caméra puis redressées : (droites, points, 2) chacune."""
    along = np.linspace(-1.0, 1.0, 41)
    rows = [np.column_stack([0.55 * along, np.full(41, y), np.ones(41)]) for y in np.linspace(-0.4, 0.4, 7)]
    columns = [
        np.column_stack([np.full(41, x), 0.4 * along, np.ones(41)]) for x in np.linspace(-0.55, 0.55, 9)
    ]
    seen = CAMERA.project(np.concatenate(rows + columns))
    straight = CAMERA.undistort_points(seen) * CAMERA.intrinsics[:2] + CAMERA.intrinsics[2:]
    return seen.reshape(-1, 41, 2), straight.reshape(-1, 41, 2)


def sagitta(lines):
    """Flèche de la ligne la plus courbe : distance (px) du milieu à la corde."""
    chord, middle = lines[:, -1] - lines[:, 0], lines[:, 20] - lines[:, 0]
    across = chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]
    return np.max(np.abs(across) / np.linalg.norm(chord, axis=1))


def shaded_page(rng):
    """Une page imprimée dont un coin est à l'ombre, et d'où elle vient."""
    from vision3d.images import read_image

    path = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv/sudoku.png"
    if path.is_file():
        return read_image(path), "photo réelle"
    y, x = np.mgrid[:480, :480]
    ink = (np.minimum(x % 60, y % 60) < 4) | (np.hypot(x % 60 - 32, y % 60 - 32) < 9)
    light = 0.25 + 0.75 / (1.0 + np.exp(-(x - y + 120) / 60.0))
    image = np.where(ink, 60.0, 170.0) * light + 3 * rng.standard_normal(x.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), "simulé"


def blackest_ninth(mask):
    """La part de noir (%) du neuvième de l'image qui en a le plus : une page imprimée est surtout blanche."""
    ninths = [part for rows in np.array_split(mask, 3) for part in np.array_split(rows, 3, axis=1)]
    return 100 * max(np.mean(part == 0) for part in ninths)


def squares(rng):
    """Douze carrés tournés, à peine plus clairs que le fond, et leurs 48 coins (x, y)."""
    y, x = np.mgrid[:300, :400].astype(float)
    image, true = 20.0 + 0.03 * x, []
    for cx, cy in SQUARES:
        angle, half = rng.uniform(0, np.pi / 2), rng.uniform(16, 26)
        axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        u, v = np.tensordot(axes, np.array([x - cx, y - cy]), axes=1)
        # un bord de deux pixels, comme en donne un objectif
        image += 16.0 * np.clip(half - np.abs(u) + 0.5, 0, 1) * np.clip(half - np.abs(v) + 0.5, 0, 1)
        true.append(np.array([cx, cy]) + half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) @ axes)
    image += NOISE * rng.standard_normal(image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), np.concatenate(true)


def judge(found, true, radius=3.0):
    """Part (%) des vrais coins retrouvés, et part de vrais parmi les trouvés."""
    if len(found) == 0:
        return 0.0, 0.0
    near = np.linalg.norm(found[:, None] - true, axis=2) <= radius
    return 100 * near.any(axis=0).mean(), 100 * near.any(axis=1).mean()


def fast(image, level=20):
    """Les coins de FAST (OpenCV) : un arc de cercle plus clair ou plus sombre, d'un seuil fixe."""
    import cv2

    points = cv2.FastFeatureDetector_create(level).detect(image)
    return np.array([p.pt for p in points]).reshape(-1, 2)


def contrast_to_noise(image):
    """Différence entre un carré et le fond, sur l'écart-type du fond."""
    x, y = SQUARES[5]
    square, background = image[y - 8 : y + 9, x - 8 : x + 9].astype(float), image[:12, 180:220].astype(float)
    return (square.mean() - background.mean()) / background.std()


def red_ball(rng):
    """Une balle rouge ombrée, un reflet blanc, du bruit ; et le masque vrai."""
    y, x = np.mgrid[:160, :200]
    true = np.hypot(x - 100, y - 80) < 45
    shade = np.clip(1.15 - np.hypot(x - 85, y - 65) / 110, 0.35, 1.0)
    image = np.where(true[..., None], np.array([30, 25, 215]) * shade[..., None], np.array([95, 110, 90]))
    image[np.hypot(x - 84, y - 62) < 4] = 250
    image[rng.random(true.shape) < 0.01] = (40, 30, 200)
    return np.clip(image + 8 * rng.standard_normal(image.shape), 0, 255).astype(np.uint8), true


def main():
    rng = np.random.default_rng(3)
    sheet = np.array([[[40, 160, 40], [40, 40, 160]]], np.uint8)  # BGR : vert, rouge ; même moyenne
    green, red = grey(sheet)[0].tolist()
    say(f"vert et rouge de même moyenne (80) : {green} et {red} en gris")
    seen, straight = bowed_lines()
    page, origin = shaded_page(rng)
    masks = threshold(page, "otsu"), adaptive_threshold(page, 31, 10)
    image, true = squares(rng)
    blurred = gaussian_blur(image, 1.5)
    stretched = equalise(blurred)
    tries = {
        "Harris, image brute": (image, corners(image, quality=0.1, min_distance_px=6), ORANGE),
        "Harris, image floue": (blurred, corners(blurred, quality=0.1, min_distance_px=6), BLUE),
        "FAST, image floue": (blurred, fast(blurred), GREEN),
        "FAST, floue puis égalisée": (stretched, fast(stretched), GREEN),
    }
    marks = {name: judge(points, true) for name, (_, points, _) in tries.items()}
    for name, (recall, precision) in marks.items():
        say(f"{name:26}: {recall:3.0f} % des vrais coins, {precision:3.0f} % de justes")
    ball, truth = red_ball(rng)
    reds = ColourRange.from_text("hsv:172-8,130-255,50-255")
    found = [reds.mask(ball) > 0, find_blobs(ball, reds, open_px=5, close_px=11, least_area=200).mask > 0]
    raw_iou, iou = ((mask & truth).sum() / (mask | truth).sum() for mask in found)

    draw(seen, straight, page, masks, tries, ball, found)
    otsu, adaptive = map(blackest_ninth, masks)
    found_right, raw_right = marks["Harris, image floue"][0], marks["Harris, image brute"][1]
    claim("C3", "page à l'ombre : noir du pire neuvième, adaptatif", adaptive, "%", high=40, source=origin)
    claim("C3", "page à l'ombre : noir du pire neuvième, Otsu", otsu, "%", low=60, source=origin)
    claim("C3", "flèche de la droite la plus courbe, distorsion radiale", sagitta(seen), "px", low=5)
    claim("C3", "flèche de la droite la plus courbe, redressée", round(sagitta(straight), 6), "px", high=1e-3)
    claim("C3", "vrais coins que Harris retrouve dans l'image floue", found_right, "%", low=90)
    claim("C3", "coins justes parmi ceux de Harris, image brute", raw_right, "%", high=50)
    claim("C3", "balle rouge, couleur et morphologie, intersection sur union", iou, low=0.98)
    assert green > red + 30, "la moyenne des canaux les confondrait"
    assert marks["Harris, image floue"][1] > 90, "et peu d'autres"
    assert marks["FAST, image floue"][0] < 10, "un seuil fixe ne voit rien dans le sombre"
    assert marks["FAST, floue puis égalisée"][0] > 70, "l'égalisation lui rend les coins"
    assert marks["FAST, floue puis égalisée"][1] < 50, "et lui donne ceux du bruit étalé"
    assert contrast_to_noise(stretched) < 1.2 * contrast_to_noise(blurred), "sans ajouter d'information"
    assert raw_iou < 0.97, "la couleur seule garde les grains et perd le reflet"


def draw(seen, straight, page, masks, tries, ball, found):
    """Une figure, huit volets : un par étape."""
    figure, axes = figures.panels(2, 4, size=(15.0, 7.0), title="C3. De la lumière au pixel utile")
    for lines, colour, name in ((seen, ORANGE, "vues"), (straight, BLUE, "redressées")):
        axes[0].plot(*lines.transpose(2, 1, 0), color=colour, linewidth=0.9)
        axes[0].plot([], color=colour, label=name)
    axes[0].set(title="Distorsion radiale", xlabel="u (px)", ylabel="v (px)", aspect="equal")
    axes[0].set(xlim=(0, 640), ylim=(560, -10))
    axes[0].legend(loc="lower center", ncols=2)
    titles = ("Une page à l'ombre", "Seuil d'Otsu", "Seuil adaptatif")
    for ax, picture, title in zip(axes[1:4], (page, *masks), titles, strict=True):
        ax.imshow(picture, cmap="gray")
        ax.set(title=title)
    shown = [tries[name] for name in tries if name != "FAST, image floue"]
    names = ("Sombre et bruitée : Harris", "Floue : Harris", "Floue, égalisée : FAST")
    for ax, (picture, points, colour), name in zip(axes[4:7], shown, names, strict=True):
        ax.imshow(picture, cmap="gray", vmin=0, vmax=max(60, int(picture.max())))
        ax.plot(*points.T, "o", color=colour, markerfacecolor="none", markersize=5)
        ax.set(title=name)
    axes[7].imshow(ball[:, :, ::-1])
    axes[7].contour(found[1], levels=[0.5], colors="white", linewidths=1.5)
    axes[7].set(title="Couleur, puis morphologie")
    for ax in axes[1:]:
        ax.axis("off")
    figures.save(figure)


if __name__ == "__main__":
    main()
