"""D3, where a file offers it: `points_sigma(x, P, kappa)` has the mean and the covariance of its Gaussian.

Any square root of P will do, points as rows or as columns, with their weights or without.
"""

# ruff: noqa: ARG005 - the functions of a family take the same arguments, whether or not each reads all

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.signatures import imported, signature_fault

__all__ = ["check"]

Array = NDArray[np.float64]
TITLE = "points_sigma : la moyenne et la covariance de N(x, P)"
X, P, KAPPA = np.array([1.0, -2.0, 0.5]), np.array([[4.0, 2.0, 0.0], [2.0, 5.0, 1.0], [0.0, 1.0, 2.0]]), 1.0
SPREAD = "les points sont x et x ± les colonnes de chol((n + κ) P)."
WEIGHTS = "κ/(n + κ) pour x, 1/(2(n + κ)) pour chacun des 2n autres ; leur somme vaut 1."
POINTS: dict[Cause, Callable[[Array, Array, float], Array]] = {
    Cause("facteur n + κ oublié", SPREAD): lambda x, P, k: _around(x, np.linalg.cholesky(P)),
    Cause("n au lieu de n + κ", SPREAD): lambda x, P, k: _around(x, np.linalg.cholesky(len(x) * P)),
    Cause("lignes au lieu des colonnes de la racine", "L[:, i], et non L[i]."): lambda x, P, k: _around(
        x, np.linalg.cholesky((len(x) + k) * P).T
    ),
    Cause("racine élément par élément", f"np.sqrt agit case par case ; {SPREAD}"): lambda x, P, k: _around(
        x, np.sqrt((len(x) + k) * P)
    ),
    Cause("racine oubliée", SPREAD): lambda x, P, k: _around(x, (len(x) + k) * P),
    Cause("n + κ hors de la racine", SPREAD): lambda x, P, k: _around(
        x, (len(x) + k) * np.linalg.cholesky(P)
    ),
}


def _around(x: Array, root: Any) -> Array:
    """x and x ± the columns of a matrix, (2n + 1, n)."""
    return np.vstack([x, x + root.T, x - root.T])


def check(sheet: Sheet) -> None:
    """The one check of D3 on the names of a file."""
    function = sheet.names["points_sigma"]
    fault = signature_fault(function, ("x", "P", "kappa"))
    if fault:
        sheet.wrong("points_sigma", TITLE, f"`points_sigma` {fault}.")
        return
    lines = [
        "import numpy as np", imported(sheet.module, "points_sigma"),
        f"points_sigma(np.array({X.tolist()}), np.array({P.tolist()}), {KAPPA})",
    ]  # fmt: skip
    more = {"example": "\n".join(lines)}
    try:
        returned = sheet.call(function, X.copy(), P.copy(), KAPPA)
    except Stumble as stumble:
        sheet.stumbled("points_sigma", TITLE, stumble.fault, **more)
        return
    points, weights = _read(returned)
    if points is None:
        said = "Je ne trouve pas 2n + 1 = 7 points de taille 3 : rendez (points, poids), ou les points."
        cause = Cause("return oublié", "rendez les points et leurs poids.") if returned is None else None
        sheet.wrong(
            "points_sigma", TITLE, said, cause, got=shown(np.shape(returned)) if cause is None else "None"
        )
        return
    _judge(sheet, points, weights, more)


def _read(returned: Any) -> tuple[Array | None, Array | None]:
    """Points (7, 3) and weights (7,) of whatever came back."""
    n = len(X)
    parts = list(returned) if isinstance(returned, tuple) else [returned]
    points = weights = None
    for part in parts:
        try:
            value = np.asarray(part, float)
        except (TypeError, ValueError):
            continue
        if points is None and value.size == n * (2 * n + 1):
            value = value.reshape([one for one in value.shape if one != 1] or [1])
            points = value.T if value.shape == (n, 2 * n + 1) else value
            points = points if points.shape == (2 * n + 1, n) else None
        elif weights is None and value.size == 2 * n + 1:
            weights = value.ravel()
    return points, weights


def _judge(sheet: Sheet, points: Array, weights: Array | None, more: dict[str, str]) -> None:
    n = len(X)
    right = np.full(2 * n + 1, 0.5 / (n + KAPPA))
    right[int(np.argmin(np.linalg.norm(points - X, axis=1)))] = KAPPA / (n + KAPPA)
    cov = (points - X).T @ ((points - X) * right[:, None])
    if not (np.allclose(right @ points, X) and np.allclose(cov, P)):
        cause = next((c for c, f in POINTS.items() if _same_points(points, f(X, P, KAPPA))), None)
        said = "Les points pondérés n'ont pas la moyenne x, ou pas la covariance P."
        sheet.wrong("points_sigma", TITLE, said, cause, expected=f"covariance {shown(P)}",
                    got=f"covariance {shown(cov)}", **more)  # fmt: skip
    elif weights is None:
        sheet.remark("points_sigma", TITLE, f"Justes ; rendez aussi les poids : {WEIGHTS}")
    elif np.allclose(weights, right):
        sheet.passed("points_sigma", TITLE)
    else:
        cause = Cause("poids", WEIGHTS)
        sheet.wrong("points_sigma", TITLE, "Les points sont justes, les poids non.", cause,
                    expected=shown(right), got=shown(weights), **more)  # fmt: skip


def _same_points(got: Array, wanted: Array) -> bool:
    """The same points in whatever order."""
    ours, theirs = (np.array(sorted(map(tuple, np.round(one, 9)))) for one in (wanted, got))
    return bool(np.allclose(ours, theirs))
