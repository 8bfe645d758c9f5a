"""E4. Composantes connexes et plus gros objet.

`composantes(masque)` : la liste des composantes 4-connexes, (aire, centre), la plus grande d'abord ; le
centre est (x, y), en pixels depuis le centre du pixel en haut à gauche.  Parcours en largeur (BFS) : un pixel
entre dans la file au moment où on le marque, donc une seule fois ; le coût est celui du nombre de pixels.

`plus_gros_objet(masque, aire_min)` : le centre de la plus grande, ou None si aucune n'atteint `aire_min`.

Des pièges : marquer un pixel quand on le sort de la file et non quand il y entre (il y entre alors jusqu'à
quatre fois) ; une récursion, qui dépasse la pile sur une grande tache ; oublier `aire_min`, et suivre un
grain.

Votre solution se vérifie par `factorlab l19 check MON_FICHIER.py`.
"""

import time
from collections import deque

import numpy as np

from vision3d.image import connected_components
from vision3d.objects import ColourRange, find_blobs, largest_object

COLOUR = ColourRange.from_text("hsv:5-22,150-255,80-255")  # l'orange de la balle


def composantes(masque):
    """Liste de (aire, (x, y)), la plus grande d'abord ; à aire égale, dans l'ordre de lecture."""
    pieces = connected_components(masque, connectivity=4, method="breadth-first")
    return [(int(pieces.areas[k]), tuple(pieces.centroids[k].tolist())) for k in pieces.by_area()]


def plus_gros_objet(masque, aire_min):
    """Le centre (x, y) de la plus grande composante d'au moins `aire_min` pixels, ou None."""
    return largest_object(masque, aire_min)


def naive_components(mask):
    """Les mêmes, en Python pur, comme on les lit."""
    left = np.array(mask) != 0
    height, width = left.shape
    found = []
    for start in zip(*np.nonzero(left), strict=True):
        if not left[start]:
            continue  # déjà dans une composante
        left[start] = False
        queue, pixels = deque([start]), []
        while queue:
            i, j = queue.popleft()
            pixels.append((j, i))
            for near in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
                if 0 <= near[0] < height and 0 <= near[1] < width and left[near]:
                    left[near] = False
                    queue.append(near)
        found.append((len(pixels), tuple(np.mean(pixels, axis=0).tolist())))
    return sorted(found, key=lambda one: -one[0])


def ball(rng, centre, *, visible=True):
    """Une image BGR bruitée : une balle orange à moitié éclairée, du bois, des grains de la même couleur."""
    y, x = np.mgrid[:120, :160]
    image = np.full((120, 160, 3), (70, 95, 120), float) + 12 * np.sin(x / 9.0)[..., None]
    if visible:
        distance = np.hypot(x - centre[0], y - centre[1])
        shade = 0.75 + 0.25 * np.clip((centre[0] - x) / 14 + 0.5, 0, 1)
        image = np.where((distance < 13)[..., None], np.array([20, 110, 240]) * shade[..., None], image)
    image[rng.random(x.shape) < 0.002] = (20, 110, 240)
    return np.clip(image + 6 * rng.standard_normal(image.shape), 0, 255).astype(np.uint8)


def compare(rng):
    """La bibliothèque contre la version naïve : mêmes composantes ; durée de chacune (s)."""
    for density in (0.0, 0.2, 0.59, 0.9, 1.0):
        mask = rng.random((40, 50)) < density
        ours, naive = composantes(mask), naive_components(mask)
        assert [a for a, _ in ours] == [a for a, _ in naive], "mêmes aires"
        np.testing.assert_allclose([c for _, c in ours], [c for _, c in naive], atol=1e-9)
    large, seconds = rng.random((480, 640)) < 0.55, []
    for function in (composantes, naive_components):
        began = time.perf_counter()
        function(large)
        seconds.append(time.perf_counter() - began)
    return seconds


def follow(rng):
    """Soixante images d'une balle qui rebondit, cachée sept fois : chemins vrai, naïf et suivi, et cachée."""
    t = np.arange(60)
    true = np.column_stack([20 + 2.0 * t, 70 - 45 * np.abs(np.sin(t / 9.5))])
    hidden = (t >= 35) & (t < 42)
    naive, tracked = np.full(true.shape, np.nan), np.full(true.shape, np.nan)
    for k, centre in enumerate(true):
        mask = COLOUR.mask(ball(rng, centre, visible=not hidden[k]))
        y, x = np.nonzero(mask)
        naive[k] = (x.mean(), y.mean()) if len(x) else np.nan
        found = plus_gros_objet(mask, aire_min=100)
        tracked[k] = found if found is not None else np.nan
    return true, naive, tracked, hidden


def main():
    from claims import claim
    from figures import say

    rng = np.random.default_rng(4)
    ours_s, naive_s = compare(rng)
    say(f"640 × 480 : bibliothèque {1e3 * ours_s:.1f} ms, Python pur {1e3 * naive_s:.0f} ms")
    true, naive, tracked, hidden = follow(rng)
    image = ball(rng, true[12])
    draw(image, true, naive, tracked)

    error, naive_error = (np.linalg.norm(one - true, axis=1) for one in (tracked, naive))
    claim("E4", "centre du plus gros objet, pire erreur", np.nanmax(error), "px", high=1)
    claim(
        "E4",
        "centre de tous les pixels orange, erreur moyenne",
        np.nanmean(naive_error[~hidden]),
        "px",
        low=3,
    )
    claim(
        "E4", "images où la balle est cachée et la réponse None, sur 7", np.isnan(error[hidden]).sum(), low=7
    )
    claim("E4", "durée, Python pur sur bibliothèque", naive_s / ours_s)
    assert np.isnan(error).tolist() == hidden.tolist(), "None quand la balle est cachée, et seulement alors"
    assert len(find_blobs(image, COLOUR, least_area=100)) == 1, "après ouverture et fermeture, la balle seule"
    assert plus_gros_objet(np.zeros((5, 5)), 1) is None
    assert composantes([[1, 1, 0], [0, 0, 1]]) == [(2, (0.5, 0.0)), (1, (2.0, 1.0))]


def draw(image, true, naive, tracked):
    """L'image, ses composantes, et les chemins."""
    from figures import BLUE, ORANGE, TRUTH, panels, save

    figure, (left, middle, right) = panels(1, 3, size=(12.5, 3.9), title="E4. Suivre le plus gros objet")
    mask = COLOUR.mask(image)
    left.imshow(image[:, :, ::-1])
    left.set(title="L'image : une balle, et des grains orange")
    pieces = connected_components(mask)
    middle.imshow(np.ma.masked_equal(pieces.labels, 0), cmap="prism", interpolation="nearest")
    middle.plot(*plus_gros_objet(mask, 100), "k+", markersize=14, markeredgewidth=2)
    middle.set(title=f"{len(pieces)} composantes ; la plus grande : {pieces.areas.max()} pixels")
    for one in (left, middle):
        one.axis("off")
    right.plot(*true.T, label="vrai chemin", **TRUTH)
    right.plot(*naive.T, ".", color=ORANGE, label="tous les pixels orange")
    right.plot(*tracked.T, ".-", color=BLUE, label="plus gros objet, 100 px au moins")
    right.set(xlabel="x (px)", ylabel="y (px)", title="60 images", xlim=(0, 160), ylim=(120, 0))
    right.legend(loc="lower left")
    save(figure)


if __name__ == "__main__":
    main()
