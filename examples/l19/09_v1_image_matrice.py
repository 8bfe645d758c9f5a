"""V1. Une image est une matrice.

Flouter, dériver, seuiller, nettoyer, compter : chaque opération lit un pixel et ses voisins.

- Convolution : chaque pixel devient une somme pondérée de ses voisins.  Un flou gaussien multiplie
  l'écart-type d'un bruit blanc par Σ k² (k : les poids d'une passe).  Il est séparable : deux passes de n
  poids, et non une de n².
- Gradient (Sobel) : une dérivée lissée.  Sa longueur dit s'il y a un bord, sa direction où l'image s'éclaire.
- Seuil d'Otsu : le niveau qui sépare le mieux deux classes, celui où q₁q₂(μ₁ - μ₂)² est maximal.  Un seul
  niveau suppose un seul éclairage ; le seuil adaptatif compare chaque pixel à la moyenne de son voisinage.
- Érosion : un pixel reste si tous ses voisins sont là ; dilatation : il apparaît si l'un d'eux est là.
  Ouverture (érosion puis dilatation) : ôte les grains ; fermeture (l'inverse) : bouche les trous.
- Composantes connexes par parcours en largeur (BFS) : combien d'objets, de quelle aire, où.

Les trois écritures d'une opération (`backend="numpy"`, à lire ; `"compiled"`, rapide ; `"opencv"`) donnent
la même matrice.  Avec FACTORLAB_DATA, une vraie photo de bonbons s'ajoute à l'image dessinée.
"""

import os
from pathlib import Path

import figures
import numpy as np
from claims import claim
from figures import BLUE, GREEN, ORANGE, say

from vision3d.image import (
    adaptive_threshold,
    closing,
    connected_components,
    convolve,
    gaussian_blur,
    gaussian_kernel,
    gradient,
    grey,
    opening,
    otsu,
    sobel,
    structuring_element,
    threshold,
)

NOISE_SIGMA = 22.0  # niveaux
DISCS = [(60, 60, 26), (150, 50, 20), (250, 70, 30), (70, 170, 22), (165, 160, 34), (265, 175, 24)]
GREY = {"cmap": "gray", "vmin": 0, "vmax": 255}


def scene(rng, dimming=0.0):
    """Six disques clairs sur fond sombre, du bruit, et la lumière qui baisse vers la droite."""
    y, x = np.mgrid[:240, :320]
    inside = np.zeros(x.shape, bool)
    for cx, cy, r in DISCS:
        inside |= np.hypot(x - cx, y - cy) < r
    light = 1.0 - dimming * x / x.shape[1]
    image = np.where(inside, 170.0, 75.0) * light + NOISE_SIGMA * rng.standard_normal(x.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), inside


def photo():
    """La photo de bonbons en gris, ou None sans FACTORLAB_DATA."""
    from vision3d.images import read_image

    path = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv/smarties.png"
    return grey(read_image(path, colour=True)) if path.is_file() else None


def count(image, *, bright):
    """Seuil d'Otsu, nettoyage, composantes d'au moins 100 pixels."""
    mask = threshold(image, otsu(image), rule="binary" if bright else "binary_inv")
    disc = structuring_element(5, "ellipse")
    pieces = connected_components(closing(opening(mask, disc), disc), method="breadth-first")
    return pieces, np.flatnonzero(pieces.areas >= 100)


def differing_pixels(image):
    """Nombre de pixels où NumPy, la boucle compilée et OpenCV ne rendent pas la même chose."""
    taps = [[1, 2, 1], [2, 4, 2], [1, 2, 1]]
    ways = ("numpy", "compiled", "opencv")
    blurs = [convolve(image, taps, dtype=np.int16, backend=way) for way in ways]
    edges = [sobel(image, 1, 0, backend=way) for way in ways]
    return sum(np.sum(three[0] != other) for three in (blurs, edges) for other in three[1:])


def direction_error(slope, disc):
    """Écart RMS, en degrés, entre le gradient au bord d'un disque clair et le chemin vers son centre."""
    cx, cy, r = disc
    angle = np.radians(np.arange(0, 360, 3))
    u, v = np.rint(cx + r * np.cos(angle)).astype(int), np.rint(cy + r * np.sin(angle)).astype(int)
    off = np.angle(np.exp(1j * (slope.direction_rad[v, u] - angle - np.pi)))
    return np.degrees(np.sqrt(np.mean(off**2)))


def variance_between_classes(image):
    """q₁q₂(μ₁ - μ₂)² de chaque niveau, par la définition."""
    between = np.zeros(256)
    for level in range(256):
        low, high = image[image <= level], image[image > level]
        if len(low) and len(high):
            share = len(low) / image.size
            between[level] = share * (1 - share) * (low.mean() - high.mean()) ** 2
    return between


def draw_levels(axes, image, between, level):
    """L'histogramme, et ce qu'Otsu maximise."""
    counts = np.bincount(image.ravel(), minlength=256)
    axes.fill_between(np.arange(256), counts, color="#bbbbbb", label="pixels par niveau")
    axes.plot(between / between.max() * counts.max(), color=BLUE, label="q₁q₂(μ₁ − μ₂)²")
    axes.axvline(level, color=ORANGE, label=f"Otsu : {level}")
    axes.set(title="Histogramme et seuil", xlabel="niveau de gris", ylabel="pixels", xlim=(20, 290))
    axes.set_ylim(0, 1.5 * counts.max())
    axes.legend(loc="upper right")


def draw_light(axes, image, adaptive):
    """Les deux seuils sous une lumière inégale."""
    axes.imshow(image, **GREY)
    axes.contour(threshold(image, "otsu"), levels=[128], colors=[ORANGE], linewidths=1.2)
    axes.contour(adaptive, levels=[128], colors=[GREEN], linewidths=1.2)
    axes.set(title="Lumière inégale : Otsu orange,\nadaptatif vert")


def draw_photo(axes, image, adaptive):
    """La vraie photo et ses objets ; sans elle, le seuil adaptatif."""
    if image is None:
        axes.imshow(adaptive, **GREY)
        axes.set(title="Le seuil adaptatif")
        return
    sweets, large = count(gaussian_blur(image, 1.8), bright=False)
    axes.imshow(image, **GREY)
    axes.plot(*sweets.centroids[large].T, "+", color=ORANGE, markersize=9, markeredgewidth=1.8)
    axes.set(title=f"Photo : {len(large)} objets sombres")
    say(f"photo de bonbons : {len(large)} objets sombres (des bonbons qui se touchent n'en font qu'un)")


def main():
    rng = np.random.default_rng(19)
    image, true = scene(rng)
    say(f"une matrice {image.shape} de {image.dtype} ; image[60, 60] = {image[60, 60]}")
    blurred = gaussian_blur(image, 1.8, size=11)
    background = np.s_[205:236, 90:220]  # sans disque
    predicted = NOISE_SIGMA * np.sum(gaussian_kernel(11, 1.8) ** 2)  # deux passes : (√Σ k²)²
    slopes = [gradient(image), gradient(blurred)]
    raw_error, error = (direction_error(slope, DISCS[4]) for slope in slopes)
    level, between = otsu(blurred), variance_between_classes(blurred)
    pieces, kept = count(blurred, bright=True)
    uncleaned = connected_components(threshold(image, otsu(image)))
    dimmed = gaussian_blur(scene(rng, dimming=0.75)[0], 1.8, size=11)
    adaptive = adaptive_threshold(dimmed, 101, -6)
    right = [100 * np.mean((mask > 0) == true) for mask in (threshold(dimmed, "otsu"), adaptive)]

    figure, axes = figures.panels(2, 4, size=(13.0, 6.2), title="V1. Une image est une matrice")
    axes[0].imshow(image, **GREY)
    axes[0].set(title="L'image, bruitée")
    axes[1].imshow(blurred, **GREY)
    axes[1].set(title="Flou gaussien, σ = 1,8 px")
    axes[2].imshow(slopes[1].magnitude, cmap="gray")
    axes[2].set(title="Longueur du gradient (Sobel)")
    draw_levels(axes[3], blurred, between, level)
    axes[4].imshow(threshold(image, otsu(image)), **GREY)
    axes[4].set(title=f"Seuil sans flou :\n{len(uncleaned)} composantes")
    axes[5].imshow(
        np.ma.masked_equal(pieces.labels, 0), cmap="tab10", vmin=0, vmax=9, interpolation="nearest"
    )
    axes[5].plot(*pieces.centroids[kept].T, "k+", markersize=9)
    axes[5].set(title=f"Flou, seuil, ouverture, fermeture :\n{len(kept)} objets")
    draw_light(axes[6], dimmed, adaptive)
    draw_photo(axes[7], photo(), adaptive)
    for k in (0, 1, 2, 4, 5, 6, 7):
        axes[k].axis("off")
    figures.save(figure)

    claim("V1", "objets trouvés (six dessinés)", len(kept), low=6, high=6)
    places = np.array([disc[:2] for disc in DISCS])
    away = np.linalg.norm(pieces.centroids[kept][:, None] - places, axis=2).min(axis=1)
    claim("V1", "erreur de leurs centres, au pire", away.max(), "px", high=0.5)
    claim("V1", "pixels où NumPy, la boucle compilée et OpenCV diffèrent", differing_pixels(image), high=0)
    claim(
        "V1",
        "bruit après le flou, mesuré sur prévu",
        blurred[background].std() / predicted,
        low=0.85,
        high=1.15,
    )
    claim("V1", "pixels justes sous lumière inégale, seuil d'Otsu", right[0], "%", high=96)
    claim("V1", "pixels justes sous lumière inégale, seuil adaptatif", right[1], "%", low=97)
    assert error < 0.5 * raw_error, "un gradient se prend sur une image lissée"
    assert int(np.argmax(between)) == level, "Otsu : le meilleur de tous les niveaux"
    assert len(uncleaned) > 3 * len(DISCS), "sans nettoyage, le bruit compte pour des objets"


if __name__ == "__main__":
    main()
