"""V1. Une image est une matrice.

Flouter, dériver, seuiller, nettoyer, compter : chaque opération lit un pixel et ses voisins.

- Convolution : chaque pixel devient une somme pondérée de ses voisins. Un flou gaussien divise l'écart-type
  d'un bruit blanc par 1/√(Σ k²). Il est séparable : deux passes de n poids au lieu de n².
- Gradient (Sobel) : une dérivée lissée. Sa longueur dit s'il y a un bord, sa direction où l'image s'éclaire.
- Seuil d'Otsu : le niveau qui sépare le mieux deux classes, celui où q₁q₂(μ₁ - μ₂)² est maximal. Un seul
  niveau suppose un seul éclairage ; le seuil adaptatif compare chaque pixel à la moyenne de son voisinage.
- Ouverture (érosion puis dilatation) : ôte les grains ; fermeture : bouche les trous.
- Composantes connexes par parcours en largeur (BFS) : combien d'objets, de quelle aire, où.

Les trois écritures d'une opération (`backend="numpy"`, à lire ; `"compiled"`, rapide ; `"opencv"`) donnent
la même matrice. Avec FACTORLAB_DATA, une vraie photo de bonbons s'ajoute à l'image dessinée.
"""

import os
from pathlib import Path

import numpy as np

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

SIGMA_BRUIT = 22.0  # niveaux
DISQUES = [(60, 60, 26), (150, 50, 20), (250, 70, 30), (70, 170, 22), (165, 160, 34), (265, 175, 24)]


def scene(rng, gradient_de_lumiere=0.0):
    """Six disques clairs sur fond sombre, du bruit, et la lumière qui baisse vers la droite."""
    y, x = np.mgrid[:240, :320]
    disques = np.zeros(x.shape, bool)
    for cx, cy, r in DISQUES:
        disques |= np.hypot(x - cx, y - cy) < r
    lumiere = 1.0 - gradient_de_lumiere * x / x.shape[1]
    image = np.where(disques, 170.0, 75.0) * lumiere + SIGMA_BRUIT * rng.standard_normal(x.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), disques


def photo():
    """La photo de bonbons en gris, ou None sans FACTORLAB_DATA."""
    from vision3d.images import read_image

    path = Path(os.environ.get("FACTORLAB_DATA", "")) / "vision/opencv/smarties.png"
    return grey(read_image(path, colour=True)) if path.is_file() else None


def compter(image, *, clair):
    """Seuil d'Otsu, nettoyage, composantes d'au moins 100 pixels."""
    masque = threshold(image, otsu(image), rule="binary" if clair else "binary_inv")
    disque = structuring_element(5, "ellipse")
    propre = closing(opening(masque, disque), disque)
    pieces = connected_components(propre, method="breadth-first")
    return masque, pieces, np.flatnonzero(pieces.areas >= 100)


def memes_pixels(image):
    """Si NumPy, la boucle compilée et OpenCV rendent la même matrice."""
    taps = [[1, 2, 1], [2, 4, 2], [1, 2, 1]]
    flous = [convolve(image, taps, dtype=np.int16, backend=b) for b in ("numpy", "compiled", "opencv")]
    bords = [sobel(image, 1, 0, backend=b) for b in ("numpy", "compiled", "opencv")]
    return all(np.array_equal(trio[0], autre) for trio in (flous, bords) for autre in trio[1:])


def erreur_de_direction(pente, disque):
    """Écart efficace, en degrés, entre le gradient au bord d'un disque clair et le chemin vers son centre."""
    cx, cy, r = disque
    angle = np.radians(np.arange(0, 360, 3))
    u, v = np.rint(cx + r * np.cos(angle)).astype(int), np.rint(cy + r * np.sin(angle)).astype(int)
    ecart = np.angle(np.exp(1j * (pente.direction_rad[v, u] - angle - np.pi)))
    return np.degrees(np.sqrt(np.mean(ecart**2)))


def variance_entre_classes(image):
    """q₁q₂(μ₁ - μ₂)² de chaque niveau, par la définition."""
    entre = np.zeros(256)
    for niveau in range(256):
        basse, haute = image[image <= niveau], image[image > niveau]
        if len(basse) and len(haute):
            part = len(basse) / image.size
            entre[niveau] = part * (1 - part) * (basse.mean() - haute.mean()) ** 2
    return entre


def dessiner_seuil(axes, image, entre, niveau):
    from figures import BLUE, ORANGE

    comptes = np.bincount(image.ravel(), minlength=256)
    axes.fill_between(np.arange(256), comptes, color="#bbbbbb", label="pixels par niveau")
    axes.plot(entre / entre.max() * comptes.max(), color=BLUE, label="q₁q₂(μ₁ - μ₂)²")
    axes.axvline(niveau, color=ORANGE, label=f"Otsu : {niveau}")
    axes.set(title="histogramme et seuil", xlabel="niveau", xlim=(20, 220), ylim=(0, 1.45 * comptes.max()))
    axes.legend(loc="upper right")


def dessiner_pieces(axes, pieces, gardees):
    axes.imshow(np.ma.masked_equal(pieces.labels, 0), cmap="tab10", vmin=0, vmax=9, interpolation="nearest")
    axes.plot(*pieces.centroids[gardees].T, "k+", markersize=9)
    axes.set(title=f"flou, seuil, ouverture : {len(gardees)} objets")


def dessiner_lumiere(axes, image, adaptatif):
    from figures import GREEN, ORANGE

    axes.imshow(image, cmap="gray", vmin=0, vmax=255)
    axes.contour(threshold(image, "otsu"), levels=[128], colors=[ORANGE], linewidths=1.2)
    axes.contour(adaptatif, levels=[128], colors=[GREEN], linewidths=1.2)
    axes.set(title="lumière inégale : Otsu orange, adaptatif vert")


def dessiner_photo(axes, image, adaptatif):
    from figures import ORANGE

    if image is None:
        axes.imshow(adaptatif, cmap="gray", vmin=0, vmax=255)
        axes.set(title="le seuil adaptatif")
        return
    _, bonbons, gros = compter(gaussian_blur(image, 1.8), clair=False)
    axes.imshow(image, cmap="gray", vmin=0, vmax=255)
    axes.plot(*bonbons.centroids[gros].T, "+", color=ORANGE, markersize=9, markeredgewidth=1.8)
    axes.set(title=f"photo : {len(gros)} objets sombres")
    print(f"photo de bonbons : {len(gros)} objets sombres (des bonbons qui se touchent n'en font qu'un)")


def main():
    from figures import panels, save

    rng = np.random.default_rng(19)
    image, vrais = scene(rng)
    print(f"une matrice {image.shape} de {image.dtype} ; image[60, 60] = {image[60, 60]}")
    egales = memes_pixels(image)
    print(f"trois écritures, mêmes pixels : {'oui' if egales else 'non'}")

    flou = gaussian_blur(image, 1.8, size=11)
    fond = np.s_[205:236, 90:220]  # sans disque
    prevu = SIGMA_BRUIT * np.sum(gaussian_kernel(11, 1.8) ** 2)  # Σ des poids 2-D au carré : (Σ k²)²
    mesure = flou[fond].std()
    print(f"bruit du fond : {image[fond].std():.2f} niveaux ; flou : {mesure:.2f}, prévu {prevu:.2f}")

    pentes = {"brute": gradient(image), "floue": gradient(flou)}
    erreurs = {nom: erreur_de_direction(pente, DISQUES[4]) for nom, pente in pentes.items()}
    for nom, erreur in erreurs.items():
        print(f"direction du gradient au bord, image {nom} : à {erreur:.0f}° près")

    niveau, entre = otsu(flou), variance_entre_classes(flou)
    _, pieces, gardees = compter(flou, clair=True)
    brut = connected_components(threshold(image, otsu(image)))
    print(f"Otsu : {niveau} ; composantes : {len(brut)} sans nettoyage, {len(gardees)} après")

    penchee = gaussian_blur(scene(rng, gradient_de_lumiere=0.75)[0], 1.8, size=11)
    adaptatif = adaptive_threshold(penchee, 101, -6)
    masques = {"Otsu": threshold(penchee, "otsu"), "adaptatif": adaptatif}
    juste = {nom: np.mean((masque > 0) == vrais) for nom, masque in masques.items()}
    for nom, part in juste.items():
        print(f"lumière qui baisse de 75 % : {100 * part:.1f} % de pixels justes, seuil {nom}")

    figure, axes = panels(2, 4, size=(13.0, 6.0), title="V1. Une image est une matrice")
    gris = {"cmap": "gray", "vmin": 0, "vmax": 255}
    seuil_seul = f"seuil sans flou : {len(brut)} composantes"
    montrees = {
        0: (image, "l'image, bruitée"),
        1: (flou, "flou gaussien, σ = 1,8 px"),
        4: (threshold(image, otsu(image)), seuil_seul),
    }
    for k, (montree, titre) in montrees.items():
        axes[k].imshow(montree, **gris)
        axes[k].set(title=titre)
    axes[2].imshow(pentes["floue"].magnitude, cmap="gray")
    axes[2].set(title="longueur du gradient (Sobel)")
    dessiner_seuil(axes[3], flou, entre, niveau)
    dessiner_pieces(axes[5], pieces, gardees)
    dessiner_lumiere(axes[6], penchee, adaptatif)
    dessiner_photo(axes[7], photo(), adaptatif)
    for k in (0, 1, 2, 4, 5, 6, 7):
        axes[k].axis("off")
    save(figure)

    assert egales, "NumPy, la boucle compilée et OpenCV donnent les mêmes pixels"
    assert abs(mesure / prevu - 1) < 0.15, "le flou ôte au bruit ce que disent ses poids"
    assert erreurs["floue"] < 0.5 * erreurs["brute"], "un gradient se prend sur une image lissée"
    assert int(np.argmax(entre)) == niveau, "Otsu : le meilleur de tous les niveaux"
    assert len(gardees) == len(DISQUES), "chaque disque est un objet, et il n'y en a pas d'autre"
    places = np.array([d[:2] for d in DISQUES])
    distances = np.linalg.norm(pieces.centroids[gardees][:, None] - places, axis=2).min(axis=1)
    assert distances.max() < 0.5, "les centres sont trouvés au demi-pixel"
    assert len(brut) > 3 * len(DISQUES), "sans nettoyage, le bruit compte pour des objets"
    assert juste["adaptatif"] > 0.97 > juste["Otsu"], "un seul niveau ne suit pas la lumière"


if __name__ == "__main__":
    main()
