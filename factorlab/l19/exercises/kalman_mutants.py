"""Wrong Kalman filters with names: the one that a student's numbers agree with is what they wrote.

A prediction is taken from the state that the student's filter had, and so is a correction: a mistake in one
does not hide one in the other.
"""

# ruff: noqa: ARG005 - the functions of a family take the same arguments, whether or not each reads all

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from factorlab.l19.exercises.finding import Cause
from factorlab.l19.exercises.kalman_systems import Array, System

__all__ = ["PREDICTED_COV", "PREDICTED_STATE", "Update", "updates"]

SWAPPED = Cause(
    "R et Q échangés", "Q, le bruit du modèle, s'ajoute dans predire ; R, le bruit du capteur, dans S."
)

PREDICTED_STATE: dict[Cause, Callable[[System, Array, Array], Array]] = {
    Cause("B ignorée", "la commande pousse l'état : x = F x + B u."): lambda s, x, u: s.F @ x,
    Cause("F oubliée dans x", "l'état avance par F : x = F x + B u."): lambda s, x, u: x + s.B @ u,
    Cause("F transposée", "x = F x + B u, sans transposer F."): lambda s, x, u: s.F.T @ x + s.B @ u,
    Cause("signe de la commande", "B u s'ajoute : x = F x + B u."): lambda s, x, u: s.F @ x - s.B @ u,
    Cause("u ajoutée sans B", "B traduit la commande en état : x = F x + B u."): lambda s, x, u: s.F @ x + u,
    Cause("x pas prédit", "predire fait aussi avancer l'état : x = F x + B u."): lambda s, x, u: x,
    Cause("prédit deux fois", "un appel de predire avance d'un seul pas."): lambda s, x, u: (
        s.F @ (s.F @ x + s.B @ u) + s.B @ u
    ),
    Cause("F appliquée à B u", "x = F x + B u, et non F (x + B u)."): lambda s, x, u: s.F @ (x + s.B @ u),
}

PREDICTED_COV: dict[Cause, Callable[[System, Array], Array]] = {
    Cause("Q pas ajoutée", "le modèle se trompe un peu à chaque pas : P = F P Fᵀ + Q."): lambda s, P: (
        s.F @ P @ s.F.T
    ),
    Cause("Q ajoutée deux fois", "une seule fois : P = F P Fᵀ + Q."): lambda s, P: s.F @ P @ s.F.T + 2 * s.Q,
    Cause("F P F, sans transposer", "le second F est transposé : F @ P @ F.T + Q."): lambda s, P: (
        s.F @ P @ s.F + s.Q
    ),
    Cause("Fᵀ P F, transposée du mauvais côté", "c'est le second F que l'on transpose : F @ P @ F.T + Q."):
        lambda s, P: s.F.T @ P @ s.F + s.Q,
    Cause("F oubliée dans P", "l'incertitude avance aussi par F : P = F P Fᵀ + Q."): lambda s, P: P + s.Q,
    Cause("F P, une seule fois F", "F des deux côtés : P = F P Fᵀ + Q."): lambda s, P: s.F @ P + s.Q,
    Cause("P pas prédite", "predire agrandit aussi l'incertitude : P = F P Fᵀ + Q."): lambda s, P: P,
    SWAPPED: lambda s, P: s.F @ P @ s.F.T + s.R,
    Cause("Q ajoutée avant F", "d'abord F P Fᵀ, ensuite + Q."): lambda s, P: s.F @ (P + s.Q) @ s.F.T,
    Cause("signe de Q", "prédire augmente l'incertitude : + Q."): lambda s, P: s.F @ P @ s.F.T - s.Q,
    Cause("Q prise pour un écart-type", "Q contient déjà des variances : pas de carré ni de racine."):
        lambda s, P: s.F @ P @ s.F.T + s.Q**2,
    Cause("produit élément par élément", "`*` multiplie case par case ; le produit de matrices est @."):
        lambda s, P: s.F * P * s.F.T + s.Q,
    Cause("produit élément par élément, sans transposer", "le produit de matrices est @ : F @ P @ F.T + Q."):
        lambda s, P: s.F * P * s.F + s.Q,
}  # fmt: skip

INNOVATION_COV: dict[Cause, Callable[[System, Array], Array]] = {
    Cause("R oubliée dans S", "S = H P Hᵀ + R : le capteur a aussi son bruit."): lambda s, P: s.H @ P @ s.H.T,
    Cause("écart-type au lieu de la variance R", "R est déjà une variance."): lambda s, P: (
        s.H @ P @ s.H.T + s.R**2
    ),
    Cause("racine de R dans S", "R est la variance, σ² ; S = H P Hᵀ + R."): lambda s, P: (
        s.H @ P @ s.H.T + np.sqrt(s.R)
    ),
    SWAPPED: lambda s, P: s.H @ P @ s.H.T + s.Q,
    Cause("signe de R", "les variances s'ajoutent : S = H P Hᵀ + R."): lambda s, P: s.H @ P @ s.H.T - s.R,
    Cause("P oubliée dans S", "S = H P Hᵀ + R."): lambda s, P: s.R,
}

GAIN: dict[Cause, Callable[[System, Array, Array], Array]] = {
    Cause("gain sans l'inverse de S", "K = P Hᵀ S⁻¹ : np.linalg.inv(S), et non S."): lambda s, P, S: (
        P @ s.H.T @ S
    ),
    Cause("S oublié dans le gain", "K = P Hᵀ S⁻¹."): lambda s, P, S: P @ s.H.T,
    Cause("Hᵀ oubliée dans le gain", "K = P Hᵀ S⁻¹."): lambda s, P, S: P @ np.linalg.inv(S),
    Cause("H sans transposer dans le gain", "K = P @ H.T @ inv(S)."): lambda s, P, S: (
        P @ s.H @ np.linalg.inv(S)
    ),
    Cause("gain transposé", "K = P Hᵀ S⁻¹, de taille (n, m) : pas de .T autour."): lambda s, P, S: (
        P @ s.H.T @ np.linalg.inv(S)
    ).T,
    Cause("division au lieu de l'inverse", "/ S divise case par case : écrivez np.linalg.inv(S)."):
        lambda s, P, S: P @ s.H.T / S,
    Cause("P oubliée dans le gain", "K = P Hᵀ S⁻¹."): lambda s, P, S: s.H.T @ np.linalg.inv(S),
}  # fmt: skip

SIGN = Cause(
    "signe de l'innovation",
    "ν = z - H x, la mesure moins la prévision, et x = x + K ν : l'état va vers la mesure.",
)
INNOVATION: dict[Cause, Callable[[System, Array, Array], Array]] = {
    SIGN: lambda s, x, z: s.H @ x - z,
    Cause("prévision oubliée", "on corrige par l'innovation z - H x, et non par z."): lambda s, x, z: z,
    Cause("H oubliée dans l'innovation", "on compare des mesures : ν = z - H x."): lambda s, x, z: z - x,
}
CORRECTED_STATE: dict[Cause, Callable[[Array, Array, Array], Array]] = {
    Cause("x pas corrigé", "corriger change l'état : x = x + K ν."): lambda x, K, v: x,
    Cause("x remplacé", "la correction s'ajoute : x = x + K ν."): lambda x, K, v: K @ v,
    Cause("corrigé deux fois", "une seule correction par mesure : x = x + K ν."): lambda x, K, v: (
        x + 2 * K @ v
    ),
}
CORRECTED_COV: dict[Cause, Callable[[System, Array, Array], Array]] = {
    Cause("P pas corrigée", "une mesure réduit l'incertitude : P = (I - K H) P."): lambda s, P, K: P,
    Cause("signe dans I - K H", "P = (I - K H) P : une mesure réduit l'incertitude."): lambda s, P, K: (
        P + K @ s.H @ P
    ),
    Cause("I oubliée", "P = (I - K H) P, et non K H P."): lambda s, P, K: K @ s.H @ P,
    Cause("1 au lieu de la matrice identité", "1 - K H retranche à chaque case ; il faut np.eye(n) - K @ H."):
        lambda s, P, K: (1 - K @ s.H) @ P,
    Cause("P oubliée dans sa correction", "P = (I - K H) P."): lambda s, P, K: np.eye(s.n) - K @ s.H,
    Cause("forme de Joseph sans K R Kᵀ", "P = (I - K H) P (I - K H)ᵀ + K R Kᵀ, ou (I - K H) P tout court."):
        lambda s, P, K: (np.eye(s.n) - K @ s.H) @ P @ (np.eye(s.n) - K @ s.H).T,
    Cause("K H dans le mauvais ordre", "P = (I - K H) P, et non (I - H K) P."): lambda s, P, K: (
        (np.eye(s.n) - s.H @ K) @ P
    ),
    Cause("H oubliée dans P", "P = (I - K H) P."): lambda s, P, K: (np.eye(s.n) - K) @ P,
    Cause("P corrigée deux fois", "(I - K H) une seule fois."): lambda s, P, K: (
        (np.eye(s.n) - K @ s.H) @ (np.eye(s.n) - K @ s.H) @ P
    ),
    Cause("Q ajoutée dans corriger", "Q n'intervient que dans predire."): lambda s, P, K: (
        (np.eye(s.n) - K @ s.H) @ P + s.Q
    ),
}  # fmt: skip
STALE = Cause("P mise à jour avant x", "calculez S et K une fois, avec la P prédite, puis x, puis P.")
Family = Mapping[Cause, Callable[..., Array]]
FAMILIES: tuple[Family, ...] = (INNOVATION_COV, GAIN, INNOVATION, CORRECTED_STATE, CORRECTED_COV)


@dataclass(frozen=True)
class Update:
    """A correction with mistakes: which ones, and what it makes of a state."""

    causes: tuple[Cause, ...]

    def __call__(self, s: System, x: Array, P: Array, z: Array) -> tuple[Array, Array]:
        """State and covariance after the measurement z, (n,) and (n, n)."""
        chosen = [next((f[c] for c in self.causes if c in f), None) for f in FAMILIES]
        in_S, in_K, in_v, in_x, in_P = chosen
        S = in_S(s, P) if in_S else s.H @ P @ s.H.T + s.R
        K = in_K(s, P, S) if in_K else P @ s.H.T @ np.linalg.inv(S)
        v = in_v(s, x, z) if in_v else z - s.H @ x
        after = in_P(s, P, K) if in_P else (np.eye(s.n) - K @ s.H) @ P
        if STALE in self.causes:
            K = after @ s.H.T @ np.linalg.inv(s.H @ after @ s.H.T + s.R)
        return (in_x(x, K, v) if in_x else x + K @ v), after


def updates() -> Iterator[Update]:
    """The right correction, then those with one mistake, then those with two in different places."""
    yield Update(())
    yield from (Update((cause,)) for family in FAMILIES for cause in family)
    yield Update((STALE,))
    for i, family in enumerate(FAMILIES):
        for other in FAMILIES[i + 1 :]:
            yield from (Update((a, b)) for a in family for b in other if a != b)
