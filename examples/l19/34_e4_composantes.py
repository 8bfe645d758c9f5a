"""E4. Composantes connexes et plus gros objet.

`composantes(masque)` : la liste des composantes 4-connexes, (aire, centre), la plus grande d'abord ; le
centre est (x, y), en pixels depuis le centre du pixel en haut à gauche. Parcours en largeur (BFS) : un pixel
entre dans la file au moment où on le marque, donc une seule fois ; le coût est celui du nombre de pixels.

`plus_gros_objet(masque, aire_min)` : le centre de la plus grande, ou None si aucune n'atteint `aire_min`.

Des pièges : marquer un pixel quand on le sort de la file et non quand il y entre (il y entre alors jusqu'à
quatre fois) ; une récursion, qui dépasse la pile sur une grande tache ; oublier `aire_min`, et suivre un
grain.
"""

import time
from collections import deque

import numpy as np

from vision3d.image import connected_components
from vision3d.objects import ColourRange, find_blobs, largest_object


def composantes(masque):
    """Liste de (aire, (x, y)), la plus grande d'abord ; à aire égale, dans l'ordre de lecture."""
    pieces = connected_components(masque, connectivity=4, method="breadth-first")
    return [(int(pieces.areas[k]), tuple(pieces.centroids[k].tolist())) for k in pieces.by_area()]


def plus_gros_objet(masque, aire_min):
    """Le centre (x, y) de la plus grande composante d'au moins `aire_min` pixels, ou None."""
    return largest_object(masque, aire_min)


def composantes_naives(masque):
    """Les mêmes, en Python pur, comme on les lit."""
    reste = np.array(masque) != 0
    hauteur, largeur = reste.shape
    trouvees = []
    for depart in zip(*np.nonzero(reste), strict=True):
        if not reste[depart]:
            continue  # déjà dans une composante
        reste[depart] = False
        file, pixels = deque([depart]), []
        while file:
            i, j = file.popleft()
            pixels.append((j, i))
            for voisin in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
                if 0 <= voisin[0] < hauteur and 0 <= voisin[1] < largeur and reste[voisin]:
                    reste[voisin] = False
                    file.append(voisin)
        trouvees.append((len(pixels), tuple(np.mean(pixels, axis=0).tolist())))
    return sorted(trouvees, key=lambda une: -une[0])


def balle(rng, centre, *, visible=True):
    """Une image BGR bruitée : une balle orange à moitié éclairée, du bois, des grains de la même couleur."""
    y, x = np.mgrid[:120, :160]
    image = np.full((120, 160, 3), (70, 95, 120), float) + 12 * np.sin(x / 9.0)[..., None]
    if visible:
        distance = np.hypot(x - centre[0], y - centre[1])
        ombre = 0.75 + 0.25 * np.clip((centre[0] - x) / 14 + 0.5, 0, 1)
        image = np.where((distance < 13)[..., None], np.array([20, 110, 240]) * ombre[..., None], image)
    grains = rng.random(x.shape) < 0.002
    image[grains] = (20, 110, 240)
    return np.clip(image + 6 * rng.standard_normal(image.shape), 0, 255).astype(np.uint8)


def comparer(rng):
    """La bibliothèque contre la version naïve : mêmes composantes ; durées de chacune."""
    for densite in (0.0, 0.2, 0.59, 0.9, 1.0):
        masque = rng.random((40, 50)) < densite
        ours, naives = composantes(masque), composantes_naives(masque)
        assert [a for a, _ in ours] == [a for a, _ in naives], "mêmes aires"
        np.testing.assert_allclose([c for _, c in ours], [c for _, c in naives], atol=1e-9)

    grand = rng.random((480, 640)) < 0.55
    durees = {}
    for nom, function in (("Python pur", composantes_naives), ("bibliothèque", composantes)):
        debut = time.perf_counter()
        function(grand)
        durees[nom] = time.perf_counter() - debut
        print(f"{nom:12} : {1e3 * durees[nom]:7.1f} ms pour 640 x 480")
    return durees


def main():
    from figures import BLUE, ORANGE, TRUTH, panels, save

    rng = np.random.default_rng(4)
    durees = comparer(rng)

    # suivre la balle : couleur, puis la plus grande composante
    orange = ColourRange.from_text("hsv:5-22,150-255,80-255")
    t = np.arange(60)
    vrais = np.column_stack([20 + 2.0 * t, 70 - 45 * np.abs(np.sin(t / 9.5))])
    cachee = (t >= 35) & (t < 42)
    naif, suivi = np.full(vrais.shape, np.nan), np.full(vrais.shape, np.nan)
    for k, centre in enumerate(vrais):
        image = balle(rng, centre, visible=not cachee[k])
        masque = orange.mask(image)
        y, x = np.nonzero(masque)
        naif[k] = (x.mean(), y.mean()) if len(x) else np.nan
        trouve = plus_gros_objet(masque, aire_min=100)
        suivi[k] = trouve if trouve is not None else np.nan
    erreur = np.linalg.norm(suivi - vrais, axis=1)
    erreur_naive = np.linalg.norm(naif - vrais, axis=1)
    print(f"centre de la plus grande composante : à {np.nanmean(erreur):.2f} px près ; "
          f"centre de tous les pixels orange : {np.nanmean(erreur_naive[~cachee]):.2f} px")  # fmt: skip
    print(f"balle cachée pendant {cachee.sum()} images : None {np.isnan(erreur[cachee]).sum()} fois")

    figure, (gauche, milieu, droite) = panels(1, 3, size=(12.5, 3.9), title="E4. Suivre le plus gros objet")
    image = balle(rng, vrais[12])
    masque = orange.mask(image)
    gauche.imshow(image[:, :, ::-1])
    gauche.set(title="l'image : une balle, et des grains orange")
    pieces = connected_components(masque)
    milieu.imshow(np.ma.masked_equal(pieces.labels, 0), cmap="prism", interpolation="nearest")
    milieu.plot(*plus_gros_objet(masque, 100), "k+", markersize=14, markeredgewidth=2)
    milieu.set(title=f"{len(pieces)} composantes, la plus grande a {pieces.areas.max()} pixels")
    for one in (gauche, milieu):
        one.axis("off")
    droite.plot(*vrais.T, label="vrai chemin", **TRUTH)
    droite.plot(*naif.T, ".", color=ORANGE, label="tous les pixels orange")
    droite.plot(*suivi.T, ".-", color=BLUE, label="plus gros objet, 100 px au moins")
    droite.set(xlabel="x (px)", ylabel="y (px)", title="60 images", xlim=(0, 160), ylim=(120, 0))
    droite.legend(loc="lower left")
    save(figure)

    net = find_blobs(image, orange, least_area=100)
    assert len(net) == 1, "après ouverture et fermeture, il ne reste que la balle"
    assert durees["bibliothèque"] < durees["Python pur"] / 10
    assert np.nanmax(erreur) < 1.0, "au pixel près"
    assert np.nanmean(erreur_naive[~cachee]) > 5 * np.nanmean(erreur), "les grains tirent la moyenne à eux"
    assert np.isnan(erreur).tolist() == cachee.tolist(), "None quand la balle est cachée, et seulement alors"
    assert plus_gros_objet(np.zeros((5, 5)), 1) is None
    assert composantes([[1, 1, 0], [0, 0, 1]]) == [(2, (0.5, 0.0)), (1, (2.0, 1.0))]


if __name__ == "__main__":
    main()
