"""P4. Quatrième piège : des seuils réglés sous une lumière, employés sous une autre.

- Compter les dragées bleues : des seuils en BGR, réglés à midi, ne voient plus rien à la lampe faible.
- En HSV, la teinte et la saturation ne changent pas quand la lumière ne fait que baisser.  Mais sous une
  ampoule chaude, qui a peu de bleu, le bleu perd sa saturation, et les seuils le perdent.
- Remède : mesurer la lumière sur une feuille blanche (balance des blancs), la corriger, puis seuiller en
  HSV.  Les gains se calculent sur la lumière, non sur les niveaux : ceux-ci suivent la courbe sRGB.
- Une page éclairée de côté : un seul niveau pour toute l'image noircit le coin sombre ; le seuil adaptatif
  compare chaque pixel à la moyenne de son voisinage.

Avec FACTORLAB_DATA, les deux images sont de vraies photographies ; les autres lumières de la première en
sont calculées (gains sur la lumière, bruit), celle de la seconde est la vraie.
"""

import os
from pathlib import Path

import numpy as np
from claims import claim
from figures import GREEN, ORANGE, panels, save

from vision3d.image import adaptive_threshold, gaussian_blur, threshold
from vision3d.images import read_image
from vision3d.objects import ColourRange, find_blobs

PHOTOS = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv"
BLUES = np.array([(377, 82), (348, 238), (294, 320)])  # centres (x, y), lus à l'œil
WHITE = (20, 20, 120, 120)  # du papier blanc : gauche, haut, largeur, hauteur
BGR = ColourRange.from_text("bgr:200-255,60-180,20-100")  # réglés à midi
HSV = ColourRange.from_text("hsv:98-127,170-255,60-255")
LIGHTS = {  # gains bleu, vert, rouge sur la lumière
    "midi": (1.0, 1.0, 1.0),
    "lampe faible": (0.25, 0.25, 0.25),
    "ampoule chaude": (0.20, 0.55, 1.00),
    "à l'ombre": (0.60, 0.45, 0.33),
}


def to_light(levels):
    """Niveaux sRGB (0 à 255) → lumière (0 à 1)."""
    x = np.asarray(levels) / 255.0
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def to_levels(light):
    """Lumière → niveaux sRGB."""
    x = np.clip(light, 0.0, 1.0)
    return np.rint(255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)).astype(np.uint8)


def sweets():
    """La photo des dragées et d'où elle vient ; sans données, des disques ombrés aux mêmes endroits."""
    if (PHOTOS / "smarties.png").is_file():
        return read_image(PHOTOS / "smarties.png", colour=True), "photo réelle, lumières calculées"
    red, orange, blue, green = (25, 15, 225), (0, 105, 245), (220, 110, 60), (80, 225, 30)
    others = [
        ((206, 211), orange),
        ((134, 327), orange),
        ((33, 229), red),
        ((288, 213), red),
        ((268, 117), green),
    ]
    y, x = np.mgrid[:356, :413]
    image = np.full((356, 413, 3), 250.0)
    for (cx, cy), colour in [*((tuple(c), blue) for c in BLUES), *others]:
        shade = np.clip(1.1 - np.hypot(x - cx + 6, y - cy + 8) / 80, 0.6, 1.0)[..., None]
        image = np.where((np.hypot(x - cx, y - cy) < 26)[..., None], shade * np.array(colour), image)
    return gaussian_blur(image.astype(np.uint8), 1.0), "simulé"


def lit(image, gains, rng):
    """La même scène sous une autre lumière, avec le bruit du capteur."""
    levels = to_levels(to_light(image) * np.array(gains)) + 3.0 * rng.standard_normal(image.shape)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def balanced(image):
    """Balance des blancs : le papier redevient blanc."""
    left, top, width, height = WHITE
    light = to_light(image)
    return to_levels(light / np.median(light[top : top + height, left : left + width], axis=(0, 1)))


def blues(image, colour):
    """Nombre de dragées bleues trouvées, nombre d'autres objets pris pour bleus, et le masque."""
    found = find_blobs(image, colour, least_area=300, open_px=7, close_px=7)
    centres = np.array([blob.centroid for blob in found.objects]).reshape(-1, 2)
    far = np.linalg.norm(centres[:, None] - BLUES, axis=2)
    hits = int((far.min(axis=0) < 12).sum()) if len(centres) else 0
    return hits, len(centres) - hits, found.mask


def count(rng):
    """Par méthode et par lumière : (trouvées, fausses, masque) ; et les images."""
    image, source = sweets()
    pictures = {name: lit(image, gains, rng) for name, gains in LIGHTS.items()}
    methods = {
        "BGR": lambda seen: blues(seen, BGR),
        "HSV": lambda seen: blues(seen, HSV),
        "blancs, puis HSV": lambda seen: blues(balanced(seen), HSV),
    }
    return (
        pictures,
        {m: {n: look(seen) for n, seen in pictures.items()} for m, look in methods.items()},
        source,
    )


def page():
    """Une page éclairée de côté, la grille qu'elle porte (tranches), et d'où elle vient."""
    if (PHOTOS / "sudoku.png").is_file():
        return read_image(PHOTOS / "sudoku.png"), (slice(360, 500), slice(60, 200)), "photo réelle"
    y, x = np.mgrid[:400, :400]
    ink = np.where((x % 40 < 3) | (y % 40 < 3), 0.25, 1.0)
    light = np.clip(0.15 + 0.8 * (x + 400 - y) / 800, 0, 1)
    return to_levels(0.7 * ink * light), (slice(260, 400), slice(0, 140)), "simulé"


def main():
    rng = np.random.default_rng(24)
    pictures, seen, source = count(rng)
    right = {}
    for method, by_light in seen.items():
        told = ", ".join(f"{name} {hits} et {wrong} fausses" for name, (hits, wrong, _) in by_light.items())
        print(f"{method:16}: {told}")
        right[method] = sum(hits == len(BLUES) and wrong == 0 for hits, wrong, _ in by_light.values())
    whole = f"lumières sur {len(LIGHTS)} où l'on trouve les 3 bleues et rien d'autre"
    claim("P4", f"{whole}, balance des blancs puis HSV", right["blancs, puis HSV"], low=4, source=source)
    claim("P4", f"{whole}, HSV seul", right["HSV"], low=2, high=3, source=source)
    claim("P4", f"{whole}, seuils BGR", right["BGR"], low=1, high=1, source=source)

    grey, corner, where = page()
    fixed = threshold(grey, "otsu", rule="binary_inv")
    adaptive = adaptive_threshold(grey, 21, 7, weights="gaussian", inverted=True)
    ink = {name: 100 * np.mean(mask[corner] > 0) for name, mask in (("fixe", fixed), ("adaptatif", adaptive))}
    claim(
        "P4",
        "pixels du coin sombre pris pour de l'encre, seuil adaptatif",
        ink["adaptatif"],
        "%",
        high=25,
        source=where,
    )
    claim(
        "P4",
        "pixels du coin sombre pris pour de l'encre, seuil d'Otsu",
        ink["fixe"],
        "%",
        low=60,
        source=where,
    )
    draw(pictures, seen, grey, fixed, adaptive)


def draw(pictures, seen, grey, fixed, adaptive):
    """Les quatre lumières et ce que deux méthodes y trouvent ; puis la page."""
    figure, axes = panels(
        2, 4, size=(15.0, 7.4), title="P4. Des seuils réglés sous une lumière, employés sous une autre"
    )
    for axis, (name, picture) in zip(axes, pictures.items(), strict=False):
        axis.imshow(picture[:, :, ::-1])
        for method, colour in (("BGR", ORANGE), ("blancs, puis HSV", GREEN)):
            if seen[method][name][2].any():
                axis.contour(seen[method][name][2] > 0, levels=[0.5], colors=colour, linewidths=2.2)
        counts = [f"{m} {seen[m][name][0]}/3" for m in ("BGR", "blancs, puis HSV")]
        axis.set(title=f"{name} : {', '.join(counts)}")
    axes[4].imshow(grey, cmap="gray", vmin=0, vmax=255)
    axes[4].set(title="Une page éclairée de côté")
    axes[5].imshow(255 - fixed, cmap="gray")
    axes[5].set(title="Un seul niveau (Otsu)")
    axes[6].imshow(255 - adaptive, cmap="gray")
    axes[6].set(title="Seuil adaptatif")
    for axis in axes[:7]:
        axis.axis("off")
    draw_counts(axes[7], seen)
    save(figure)


def draw_counts(axis, seen):
    """Dragées bleues trouvées moins les fausses, par lumière et par méthode."""
    for k, (method, by_light) in enumerate(seen.items()):
        score = [hits - wrong for hits, wrong, _ in by_light.values()]
        axis.bar(
            np.arange(len(score)) + 0.27 * (k - 1),
            score,
            0.25,
            color=(ORANGE, "#56B4E9", GREEN)[k],
            label=method,
        )
    axis.axhline(0, color="black", linewidth=0.8)
    axis.set_xticks(range(len(LIGHTS)), [name.replace(" ", "\n") for name in LIGHTS])
    axis.set_yticks(range(5))
    axis.set(title="Bleues trouvées moins fausses (3 au mieux)", ylabel="dragées", ylim=(-0.5, 4))
    axis.legend(loc="upper center", ncols=3, fontsize=8)


if __name__ == "__main__":
    main()
