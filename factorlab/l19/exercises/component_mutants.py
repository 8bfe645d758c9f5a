"""Connected components by a plain search, right and wrong, and whatever form a student gives them in."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.exercises.finding import Cause

__all__ = ["EXAMPLE", "WRONG", "Component", "Mask", "components", "masks", "normalised"]

Mask = NDArray[Any]
Component = tuple[float, tuple[float, float]]  # area, (row, column) of the centroid
FOUR = ((-1, 0), (1, 0), (0, -1), (0, 1))
DIAGONALS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
EXAMPLE = np.array([[1, 1, 0, 0, 0, 0], [1, 0, 0, 1, 1, 0], [0, 1, 0, 1, 1, 1], [0, 0, 0, 0, 0, 0]])


def masks(rng: np.random.Generator) -> list[Mask]:
    """The example and random masks; some touch every border."""
    return [
        EXAMPLE.astype(np.uint8),
        *((rng.random((11, 14)) < share).astype(np.uint8) for share in (0.35, 0.5, 0.6)),
    ]


Steps = tuple[tuple[int, int], ...]


def _pixels(mask: Mask, steps: Steps, *, wrap: bool = False) -> Iterator[list[tuple[int, int]]]:
    """The pixels of each component; with `wrap`, an index of -1 is the last row, as in NumPy."""
    left = np.array(mask) != 0
    height, width = left.shape
    top, edge = (-height, -width) if wrap else (0, 0)
    for start in zip(*(axis.tolist() for axis in np.nonzero(left)), strict=True):
        if not left[start]:
            continue
        left[start] = False
        queue, found = deque([start]), []
        while queue:
            i, j = queue.popleft()
            found.append((i, j))
            for di, dj in steps:
                near = i + di, j + dj
                if top <= near[0] < height and edge <= near[1] < width and left[near]:
                    left[near] = False
                    queue.append(near)
        yield found


def wrapped_areas(mask: Mask) -> list[float]:
    """Areas where nobody stopped at the first row and column; what the centroids are depends on the order."""
    return sorted((float(len(one)) for one in _pixels(mask, FOUR, wrap=True)), reverse=True)


def _mean(pixels: list[tuple[int, int]]) -> tuple[float, float]:
    row, column = np.mean(pixels, axis=0).tolist()
    return row, column


def components(
    mask: Mask,
    *,
    steps: Steps = FOUR,
    centre: Callable[[list[tuple[int, int]]], tuple[float, float]] = _mean,
    area: Callable[[list[tuple[int, int]]], float] = len,
    order: str = "largest",
) -> list[Component]:
    """Areas and centroids (row, column), largest first unless `order` says otherwise."""
    found = [(float(area(one)), centre(one)) for one in _pixels(mask, steps)]
    if order == "scan":
        return found
    return sorted(found, key=lambda one: one[0], reverse=order == "largest")


def _box(pixels: list[tuple[int, int]]) -> tuple[float, float]:
    low, high = np.min(pixels, axis=0), np.max(pixels, axis=0)
    return float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2


def _late(mask: Mask) -> list[Component]:
    """Marked when a pixel leaves the queue: one that two neighbours put in counts twice."""
    on, found = np.array(mask) != 0, []
    seen = np.zeros_like(on)
    for start in zip(*(axis.tolist() for axis in np.nonzero(on)), strict=True):
        if seen[start]:
            continue
        queue, pixels = deque([start]), []
        while queue:
            i, j = queue.popleft()
            seen[i, j] = True
            pixels.append((i, j))
            for di, dj in FOUR:
                near = i + di, j + dj
                if 0 <= near[0] < on.shape[0] and 0 <= near[1] < on.shape[1] and on[near] and not seen[near]:
                    queue.append(near)
        found.append((float(len(pixels)), _mean(pixels)))
    return sorted(found, key=lambda one: -one[0])


def _inside(mask: Mask) -> Mask:
    cut = np.zeros_like(mask)
    cut[1:-1, 1:-1] = mask[1:-1, 1:-1]
    return cut


WRAPPED = Cause(
    "l'image se replie à ses bords",
    "un indice -1 désigne la dernière ligne en NumPy : vérifiez 0 <= i < hauteur et 0 <= j < largeur.",
)
FOUR_ONLY = "4-connexité : seulement (i-1, j), (i+1, j), (i, j-1), (i, j+1)."
WRONG: dict[Cause, Callable[[Mask], list[Component]]] = {
    Cause("8-connexité au lieu de la 4-connexité", FOUR_ONLY): lambda m: (
        components(m, steps=(*FOUR, *DIAGONALS))
    ),
    Cause("diagonales au lieu des côtés", FOUR_ONLY): lambda m: components(m, steps=DIAGONALS),
    Cause("voisins oubliés (gauche et haut)", f"quatre voisins ; {FOUR_ONLY}"): lambda m: (
        components(m, steps=((1, 0), (0, 1)))
    ),
    Cause("voisin du haut oublié", FOUR_ONLY): lambda m: components(m, steps=((1, 0), (0, -1), (0, 1))),
    Cause("voisin de gauche oublié", FOUR_ONLY): lambda m: components(m, steps=((-1, 0), (1, 0), (0, 1))),
    Cause("voisin de droite oublié", FOUR_ONLY): lambda m: components(m, steps=((-1, 0), (1, 0), (0, -1))),
    Cause("voisin du bas oublié", FOUR_ONLY): lambda m: components(m, steps=((-1, 0), (0, -1), (0, 1))),
    Cause("bords de l'image oubliés", "parcourez aussi la première et la dernière ligne et colonne."):
        lambda m: components(_inside(m)),
    Cause("dernière ligne et dernière colonne oubliées", "range(hauteur), et non range(hauteur - 1)."):
        lambda m: components(np.pad(m[:-1, :-1], ((0, 1), (0, 1)))),
    Cause("de la plus petite à la plus grande", "triez par aire décroissante (reverse=True)."): lambda m: (
        components(m, order="smallest")
    ),
    Cause("pas triées", "triez par aire décroissante."): lambda m: components(m, order="scan"),
    Cause("fond compté", "seuls les pixels allumés (non nuls) comptent."): lambda m: components(m == 0),
    Cause("fond compté aussi", "seuls les pixels allumés (non nuls) comptent."): lambda m: sorted(
        [*components(m), *components(m == 0)], key=lambda one: -one[0]
    ),
    Cause("pixels comptés plusieurs fois", "marquez un pixel à son entrée dans la file."):
        _late,
    Cause("centre de la boîte au lieu du centre de gravité", "le centre est la moyenne des pixels."):
        lambda m: components(m, centre=_box),
    Cause("premier pixel au lieu du centre de gravité", "le centre est la moyenne des pixels."): lambda m: (
        components(m, centre=lambda p: (float(p[0][0]), float(p[0][1])))
    ),
    Cause("pixel de départ pas compté", "le premier pixel fait partie de la composante."): lambda m: (
        components(m, area=lambda p: len(p) - 1)
    ),
    Cause("une seule composante", "rendez toutes les composantes, la plus grande d'abord."): lambda m: (
        components(m)[:1]
    ),
    Cause("composantes d'un pixel oubliées", "un pixel isolé est une composante d'aire 1."): lambda m: [
        one for one in components(m) if one[0] > 1
    ],
    Cause("somme des coordonnées au lieu de leur moyenne", "divisez par l'aire."): lambda m: components(
        m, centre=lambda p: (float(sum(i for i, _ in p)), float(sum(j for _, j in p)))
    ),
}  # fmt: skip


def normalised(returned: Any) -> list[Component] | None:
    """Areas and centroids of whatever came back, in its order; None where it is no list of such pairs."""
    try:
        rows = list(returned)
        found = [_component(row) for row in rows]
    except (TypeError, ValueError, IndexError, KeyError):
        return None
    return found


def _component(row: Any) -> Component:
    if isinstance(row, dict):
        row = list(row.values())
    flat = np.concatenate([np.ravel(np.asarray(one, float)) for one in row])
    area, first, second = flat.tolist()
    return area, (first, second)
