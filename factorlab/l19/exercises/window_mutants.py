"""Sliding medians and jump detectors, right and wrong: what a student wrote is the one that agrees.

Windows are judged away from the ends, where everybody may do as they like.
"""

# ruff: noqa: ARG005 - the functions of a family take the same arguments, whether or not each reads all

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.exercises.finding import Cause

__all__ = [
    "EDGES",
    "EVEN",
    "MEDIANS",
    "RULES",
    "WRONG_RULES",
    "Array",
    "global_levels",
    "levels_of",
    "noisy_jumps",
    "separated",
    "sliding",
]

Array = NDArray[np.float64]
SIGMA_OF_MAD = 1.4826


def sliding(x: Array, behind: int, ahead: int, of: Callable[[Array], float] = np.median) -> Array:
    """A function of every window x[i - behind … i + ahead], shortened at the ends, (N,)."""
    return np.array([of(x[max(0, i - behind) : max(0, i + ahead + 1)]) for i in range(len(x))], float)


def _recursive(x: Array, k: int) -> Array:
    out, h = x.copy(), k // 2
    for i in range(len(x)):
        out[i] = np.median(out[max(0, i - h) : i + h + 1])
    return out


MEDIANS: dict[Cause, Callable[[Array, int], Array]] = {
    Cause("moyenne au lieu de la médiane", "la médiane est la valeur du milieu une fois triée : np.median."):
        lambda x, k: sliding(x, k // 2, k // 2, np.mean),
    Cause("fenêtre vers le passé seulement", "centrez la fenêtre : de i - k//2 à i + k//2 compris."):
        lambda x, k: sliding(x, k - 1, 0),
    Cause("fenêtre vers l'avenir seulement", "centrez la fenêtre : de i - k//2 à i + k//2 compris."):
        lambda x, k: sliding(x, 0, k - 1),
    Cause("k pris pour une demi-fenêtre", "k est la taille entière : k//2 mesures de chaque côté."):
        lambda x, k: sliding(x, k, k),
    Cause("dernière mesure de la fenêtre oubliée", "x[i-h:i+h] s'arrête avant i+h : écrivez x[i-h:i+h+1]."):
        lambda x, k: sliding(x, k // 2, k // 2 - 1),
    Cause("première mesure de la fenêtre oubliée", "la fenêtre commence à i - k//2 : x[i-h:i+h+1]."):
        lambda x, k: sliding(x, k // 2 - 1, k // 2),
    Cause("médiane de valeurs déjà filtrées", "écrivez le résultat dans un autre tableau que x."): _recursive,
    Cause("fenêtre pas triée", "la valeur du milieu n'est la médiane qu'une fois la fenêtre triée."):
        lambda x, k: x.copy(),
    Cause("k ignoré", "la fenêtre a k mesures."): lambda x, k: sliding(x, 1, 1),
}  # fmt: skip

EVEN: dict[str, Callable[[Array, int], Array]] = {
    "": lambda x, k: sliding(x, k // 2, (k - 1) // 2),
    "la fenêtre penche d'un rang vers la droite": lambda x, k: sliding(x, (k - 1) // 2, k // 2),
    "la fenêtre prend k + 1 mesures": lambda x, k: sliding(x, k // 2, k // 2),
}

EDGES: dict[str, Callable[[Array, int], Array]] = {
    "": lambda x, k: sliding(x, k // 2, k // 2),
    "des zéros aux bords, qui tirent la médiane vers 0": lambda x, k: _padded(x, k, "constant"),
    "la première et la dernière mesure répétées aux bords": lambda x, k: _padded(x, k, "edge"),
    "le signal replié aux bords": lambda x, k: _padded(x, k, "reflect"),
    "le signal replié aux bords, dernière mesure comprise": lambda x, k: _padded(x, k, "symmetric"),
    "les mesures laissées telles quelles aux bords": lambda x, k: _kept(x, k, x),
    "NaN aux bords": lambda x, k: _kept(x, k, np.full(len(x), np.nan)),
    "zéro aux bords": lambda x, k: _kept(x, k, np.zeros(len(x))),
}


def _padded(x: Array, k: int, mode: str) -> Array:
    h = k // 2
    long = np.pad(x, h, mode=mode)  # type: ignore[call-overload]
    windows = np.lib.stride_tricks.sliding_window_view(long, 2 * h + 1)
    return np.asarray(np.median(windows, axis=1))


def _kept(x: Array, k: int, ends: Array) -> Array:
    out, h = ends.copy(), k // 2
    out[h : len(x) - h] = sliding(x, h, h)[h : len(x) - h]
    return out


def _mad(window: Array) -> float:
    return float(np.median(np.abs(window - np.median(window))))


def _residual(x: Array, k: int) -> Array:
    return x - sliding(x, k // 2, k // 2)


def _local(x: Array, k: int) -> Array:
    return sliding(x, k // 2, k // 2, _mad)


RULES: dict[str, Callable[[Array, int, float], NDArray[np.bool_]]] = {
    "": lambda x, k, s: np.abs(_residual(x, k)) > s * SIGMA_OF_MAD * _local(x, k),
    "avec seuil × MAD, sans le facteur 1,4826 qui en fait un σ": lambda x, k, s: (
        np.abs(_residual(x, k)) > s * _local(x, k)
    ),
    "avec la médiane glissante de |x - médiane| comme MAD": lambda x, k, s: (
        np.abs(_residual(x, k)) > s * SIGMA_OF_MAD * sliding(np.abs(_residual(x, k)), k // 2, k // 2)
    ),
    "avec la médiane glissante de |x - médiane| comme MAD, sans le facteur 1,4826": lambda x, k, s: (
        np.abs(_residual(x, k)) > s * sliding(np.abs(_residual(x, k)), k // 2, k // 2)
    ),
}


def levels_of(x: Array, k: int) -> Array:
    """|x - local median|, (N,)."""
    return np.abs(_residual(x, k))


def global_levels(x: Array, k: int, s: float) -> dict[str, float]:
    """Thresholds on |x - local median| that are the same everywhere, by the scale that they come from."""
    r = _residual(x, k)
    return {
        "": s * SIGMA_OF_MAD * float(np.median(np.abs(r))),
        " (et sans le facteur 1,4826)": s * float(np.median(np.abs(r))),
        " (celle de x entier)": s * SIGMA_OF_MAD * _mad(x),
        " (celle de x entier, sans 1,4826)": s * _mad(x),
    }


def separated(x: Array, k: int, found: set[int], inner: range) -> tuple[float, float] | None:
    """Between which levels of |x - local median| lies the one that tells these indices from the others."""
    r = np.abs(_residual(x, k))
    inside = [float(r[i]) for i in inner if i in found]
    outside = [float(r[i]) for i in inner if i not in found]
    if not inside or not outside or min(inside) < max(outside):
        return None
    return max(outside), min(inside)


LOCAL = "comparez |x - médiane locale| à seuil × 1,4826 × MAD locale."
WRONG_RULES: dict[Cause, Callable[[Array, int, float], NDArray[np.bool_]]] = {
    Cause("écart-type au lieu de la MAD", f"un saut gonfle l'écart-type et s'y cache ; {LOCAL}"):
        lambda x, k, s: np.abs(_residual(x, k)) > s * sliding(x, k // 2, k // 2, np.std),
    Cause("écart-type global au lieu de la MAD", f"un saut gonfle l'écart-type et s'y cache ; {LOCAL}"):
        lambda x, k, s: np.abs(_residual(x, k)) > s * np.std(x),
    Cause("écart-type du résidu au lieu de la MAD", f"un saut gonfle l'écart-type ; {LOCAL}"):
        lambda x, k, s: np.abs(_residual(x, k)) > s * np.std(_residual(x, k)),
    Cause("valeur absolue oubliée", "un saut peut aller vers le bas : |x - médiane|."):
        lambda x, k, s: _residual(x, k) > s * SIGMA_OF_MAD * _local(x, k),
    Cause("valeur absolue oubliée (sans 1,4826)", "un saut peut aller vers le bas : |x - médiane|."):
        lambda x, k, s: _residual(x, k) > s * _local(x, k),
    Cause("seuil absolu", f"le seuil se compte en écarts-types locaux ; {LOCAL}"):
        lambda x, k, s: np.abs(_residual(x, k)) > s,
    Cause("seuil ignoré", LOCAL): lambda x, k, s: np.abs(_residual(x, k)) > _local(x, k),
    Cause("seuil ignoré (σ)", LOCAL): lambda x, k, s: np.abs(_residual(x, k)) > SIGMA_OF_MAD * _local(x, k),
    Cause("comparaison à l'envers", "les sauts sont les mesures au-dessus du seuil : >."):
        lambda x, k, s: np.abs(_residual(x, k)) < s * SIGMA_OF_MAD * _local(x, k),
    Cause("comparaison à l'envers (sans 1,4826)", "les sauts sont les mesures au-dessus du seuil : >."):
        lambda x, k, s: np.abs(_residual(x, k)) < s * _local(x, k),
    Cause("MAD sans valeur absolue", "la MAD est la médiane de |x - médiane|."): lambda x, k, s: (
        np.abs(_residual(x, k)) > s * sliding(x, k // 2, k // 2, lambda w: float(np.median(w - np.median(w))))
    ),
    Cause("médiane globale au lieu de la locale", LOCAL): lambda x, k, s: (
        np.abs(x - np.median(x)) > s * SIGMA_OF_MAD * _local(x, k)
    ),
    Cause("médiane et MAD globales", LOCAL): lambda x, k, s: (
        np.abs(x - np.median(x)) > s * SIGMA_OF_MAD * _mad(x)
    ),
    Cause("médiane et MAD globales (sans 1,4826)", LOCAL): lambda x, k, s: (
        np.abs(x - np.median(x)) > s * _mad(x)
    ),
    Cause("moyenne au lieu de la médiane", LOCAL): lambda x, k, s: (
        np.abs(x - sliding(x, k // 2, k // 2, np.mean)) > s * SIGMA_OF_MAD * _local(x, k)
    ),
    Cause("écart moyen au lieu de la MAD", LOCAL): lambda x, k, s: np.abs(_residual(x, k))
        > s * sliding(x, k // 2, k // 2, lambda w: float(np.mean(np.abs(w - np.median(w))))),
    Cause("1,4826 au dénominateur", "σ vaut environ 1,4826 × MAD : multipliez."): lambda x, k, s: (
        np.abs(_residual(x, k)) > s * _local(x, k) / SIGMA_OF_MAD
    ),
    Cause("différence de deux mesures au lieu de la médiane", LOCAL): lambda x, k, s: (
        np.abs(np.diff(x, prepend=x[0])) > s * SIGMA_OF_MAD * _local(x, k)
    ),
}  # fmt: skip


def noisy_jumps(rng: np.random.Generator) -> tuple[Array, NDArray[np.intp]]:
    """A slow signal whose noise grows in its middle, and where its jumps of 6 to 14 local σ are."""
    t = np.arange(500)
    sigma = np.where(t < 250, 0.05, 0.4)
    x = 0.5 * np.sin(0.02 * t) + sigma * rng.standard_normal(len(t))
    at = np.sort(rng.choice(np.arange(30, 470, 11), 16, replace=False))
    x[at] += rng.uniform(6, 14, len(at)) * sigma[at] * rng.choice([-1.0, 1.0], len(at))
    return x, at
