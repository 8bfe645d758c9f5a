"""E3: `ajuster(d, v)`, `distance(v, …)` and `incertitude_distance(v, …)` against the statement."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from factorlab.l19.exercises.fault import Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.infrared_curve import (
    DISTANCES,
    FITS,
    SIGMAS,
    Array,
    arguments_for,
    fitted,
    parameters_of,
    volts,
)
from factorlab.l19.exercises.signatures import imported, signature_fault

__all__ = ["check"]

A, B, C = 20.0, 2.0, 0.5
D = np.array([8.0, 18.0, 38.0, 48.0, 78.0])
V = volts(D, A, B, C)  # 2.5, 1.5, 1, 0.9, 0.75
SIGMA = 0.02
TITLES = {
    "ajuster": "ajuster : a, b et c de v = a/(d + b) + c",
    "distance": "distance : l'inverse de la courbe",
    "incertitude_distance": "incertitude_distance : l'écart-type de d",
}
Constants = tuple[Any, tuple[float, float, float]]


def check(sheet: Sheet) -> None:
    """Every check of E3 on the names of a file."""
    returned: Any = (A, B, C)
    triple = (A, B, C)
    if (fit := sheet.names.get("ajuster")) is not None:
        found = _check_fit(sheet, fit)
        if found is not None:
            returned, triple = found
        elif parameters_of(sheet.call.tried(fit, D.copy(), V.copy())) is None:
            return
    for name, wrong in (("distance", DISTANCES), ("incertitude_distance", SIGMAS)):
        if (function := sheet.names.get(name)) is not None:
            _check_inverse(sheet, name, function, returned, triple, wrong)


def _check_fit(sheet: Sheet, function: Any) -> Constants | None:
    """What ajuster gives on exact readings, where it is right."""
    title = TITLES["ajuster"]
    fault = signature_fault(function, ("d", "v"))
    if fault:
        sheet.wrong("ajuster", title, f"`ajuster` {fault}.")
        return None
    lines = [
        "import numpy as np",
        imported(sheet.module, "ajuster"),
        f"d = np.array({shown(D.tolist()).replace(',', '.,').replace(']', '.]')})",
        "ajuster(d, 20 / (d + 2) + 0.5)",
    ]
    more = {"example": "\n".join(lines), "expected": f"a, b, c = {A:g}, {B:g}, {C:g}"}
    given = D.copy(), V.copy()
    try:
        returned = sheet.call(function, *given)
    except Stumble as stumble:
        sheet.stumbled("ajuster", title, stumble.fault, **more)
        return None
    triple = parameters_of(returned)
    more["got"] = shown(returned) if triple is None else f"a, b, c = {', '.join(shown(p) for p in triple)}"
    if triple is None:
        cause = Cause("return oublié", "rendez a, b, c.") if returned is None else None
        said = "Je ne trouve pas a, b et c dans le résultat : rendez-les dans cet ordre (tuple ou tableau)."
        sheet.wrong("ajuster", title, said, cause, **more)
        return None
    if not (np.array_equal(given[0], D) and np.array_equal(given[1], V)):
        cause = Cause("argument modifié", "travaillez sur une copie : d = np.array(d, float).")
        sheet.wrong("ajuster", title, "`ajuster` change les mesures qu'on lui donne.", cause)
        return None
    if np.allclose(triple, (A, B, C), rtol=1e-3, atol=1e-3):
        sheet.passed("ajuster", title)
        _noisy_fit(sheet, function)
        _other_start(sheet, function)
        return returned, triple
    _tell_fit(sheet, triple, more)
    return None


def _tell_fit(sheet: Sheet, triple: tuple[float, float, float], more: dict[str, Any]) -> None:
    for cause, wrong in FITS.items():
        if np.allclose(triple, wrong(D, V), rtol=1e-3, atol=1e-3):
            sheet.wrong(
                "ajuster", TITLES["ajuster"], "Les constantes ne sont pas celles de la courbe.", cause, **more
            )
            return
    with np.errstate(all="ignore"):
        rest = np.sqrt(np.mean((volts(D, *triple) - V) ** 2))
    if not rest < 0.05:
        cause = Cause("ajustement qui n'a pas convergé", "partez d'un b raisonnable (0), résolvez a et c par "
                      "moindres carrés, puis itérez Gauss-Newton une dizaine de fois.")  # fmt: skip
        said = f"La courbe passe à {shown(float(rest))} V des lectures en moyenne."
        sheet.wrong("ajuster", TITLES["ajuster"], said, cause, **more)
        return
    said = f"La courbe passe à {shown(float(rest))} V des lectures exactes : encore quelques itérations."
    sheet.remark("ajuster", TITLES["ajuster"], said, **more)


def _noisy_fit(sheet: Sheet, function: Any) -> None:
    """On noisy readings the least sum of squares is one number."""
    d = np.linspace(8, 80, 60)
    v = volts(d, 28.0, 0.5, 0.1) + SIGMA * np.random.default_rng(5).standard_normal(60)
    triple = parameters_of(sheet.call.tried(function, d.copy(), v.copy()))
    title = "ajuster : des lectures bruitées"
    best = float(np.sum((volts(d, *fitted(d, v)) - v) ** 2))
    if triple is None:
        sheet.wrong("ajuster.bruit", title, "`ajuster` s'arrête, ou ne rend rien, sur 60 lectures bruitées.")
        return
    own = float(np.sum((volts(d, *triple) - v) ** 2))
    if own <= 1.01 * best:
        sheet.passed("ajuster.bruit", title, "C'est bien la somme de carrés la plus petite.")
    elif own <= 2 * best:
        said = f"La somme des carrés est {own / best:.2f} fois la plus petite : accepté."
        sheet.remark("ajuster.bruit", title, f"{said} Gauss-Newton sur les trois constantes ferait mieux.")
    else:
        cause = Cause("ajustement qui n'a pas convergé", "itérez jusqu'à ce que a, b et c ne bougent plus.")
        sheet.wrong(
            "ajuster.bruit", title, f"La somme des carrés est {shown(own / best)} fois la plus petite.", cause
        )


def _other_start(sheet: Sheet, function: Any) -> None:
    """Another sensor, far from the first: a start that is written into the file would show."""
    d = np.linspace(0.08, 0.8, 40)
    triple = parameters_of(sheet.call.tried(function, d.copy(), volts(d, 0.28, 0.005, 0.1)))
    if triple is None or not np.allclose(volts(d, *triple), volts(d, 0.28, 0.005, 0.1), atol=0.02):
        said = "L'ajustement n'aboutit pas quand d est en mètres : permis, son départ est réglé pour des cm."
        sheet.remark("ajuster.départ", "ajuster : un autre capteur, en mètres", said)


def _check_inverse(
    sheet: Sheet, name: str, function: Any, returned: Any, triple: tuple[float, float, float],
    wrong: Mapping[Cause, Callable[..., Any]],
) -> None:  # fmt: skip
    """`distance` or `incertitude_distance`, with the constants that `ajuster` gave."""
    title = TITLES[name]
    try:
        rest = arguments_for(function, returned, triple, SIGMA)
    except (LookupError, TypeError, ValueError):
        own = ", ".join(inspect.signature(function).parameters)
        sheet.wrong(name, title, f"Je ne sais que donner à {name}({own}) : {name}(v, a, b, c"
                    f"{', sigma_v' if name != 'distance' else ''}) convient.")  # fmt: skip
        return
    sigma = SIGMA if any(one is SIGMA for one in rest) else None
    v = np.array([2.5, 1.0])
    got = _values(sheet, function, v, rest)
    if isinstance(got, Stumble):
        sheet.stumbled(name, title, got.fault)
        return
    truth = _truth(name, v, triple, sigma)
    typed = f"[{name}(v, {', '.join(shown(one) for one in rest)}) for v in (2.5, 1.0)]"
    example = f"{imported(sheet.module, name)}\n{typed}"
    more = {"expected": shown(truth), "got": shown(got), "example": example}
    if name != "distance" and sigma is None:
        _spread_by_ratio(sheet, function, more)
        return
    if np.allclose(got, truth, rtol=2e-3):
        sheet.passed(name, title, _told(sheet, function, rest, triple) if name != "distance" else "")
        return
    _tell_inverse(sheet, name, got, truth, [(cause, f(v, *triple, *([] if sigma is None else [sigma])))
                                            for cause, f in wrong.items()], more)  # fmt: skip


def _truth(name: str, v: Array, triple: tuple[float, float, float], sigma: float | None) -> Array:
    a, b, c = triple
    return a / (v - c) - b if name == "distance" else a / (v - c) ** 2 * (sigma or 0.0)


def _values(sheet: Sheet, function: Any, v: Array, rest: list[Any]) -> Array | Stumble:
    """One reading at a time; what comes as an array of one is a number too."""
    try:
        return np.array([float(np.ravel(sheet.call(function, float(one), *rest))[0]) for one in v])
    except Stumble as stumble:
        try:
            return np.ravel(np.asarray(sheet.call(function, v.copy(), *rest), float))
        except (Stumble, TypeError, ValueError):
            return stumble
    except (TypeError, ValueError, IndexError):
        return np.array([np.nan] * len(v))


def _tell_inverse(
    sheet: Sheet, name: str, got: Array, truth: Array, wrong: list[tuple[Cause, Any]], more: dict[str, Any]
) -> None:
    title = TITLES[name]
    for scale, unit in ((0.01, "mètres"), (10.0, "millimètres"), (100.0, "centimètres")):
        if np.allclose(got, scale * truth, rtol=2e-3):
            sheet.remark(name, title, f"Juste, mais en {unit} alors que d était dans une autre unité : "
                         "gardez une seule unité d'un bout à l'autre.", **more)  # fmt: skip
            return
    cause = next((cause for cause, value in wrong if np.allclose(got, value, rtol=2e-3)), None)
    sheet.wrong(name, title, "Le résultat n'est pas celui de la formule.", cause, **more)


def _spread_by_ratio(sheet: Sheet, function: Any, more: dict[str, Any]) -> None:
    """Where σ of the reading is the function's own affair: how it grows from 10 to 60 cm, and its size."""
    title = TITLES["incertitude_distance"]
    d = np.repeat(np.linspace(8, 80, 30), 3)
    v = volts(d, 28.0, 0.5, 0.1) + SIGMA * np.random.default_rng(5).standard_normal(len(d))
    returned = sheet.call.tried(sheet.names["ajuster"], d, v) if "ajuster" in sheet.names else None
    triple = parameters_of(returned)
    if triple is None:
        said = "Sans σ de la tension en argument, je ne peux pas la juger : ajoutez sigma_v."
        sheet.remark("incertitude_distance", title, said)
        return
    at = volts(np.array([10.0, 60.0]), *triple)
    got = _values(sheet, function, at, arguments_for(function, returned, triple, SIGMA))
    if isinstance(got, Stumble):
        sheet.stumbled("incertitude_distance", title, got.fault)
        return
    truth = _truth("incertitude_distance", at, triple, SIGMA)
    if np.all((got / truth > 0.7) & (got / truth < 2.0)):
        sheet.passed("incertitude_distance", title, f"À 10 cm : {_cm(got[0])} ; à 60 cm : {_cm(got[1])}.")
        return
    wrong = [(cause, f(at, *triple, SIGMA)) for cause, f in SIGMAS.items()]
    cause = next((c for c, value in wrong if np.all((got / value > 0.8) & (got / value < 1.25))), None)
    told = {**more, "expected": shown(truth), "got": shown(got)}
    sheet.wrong(
        "incertitude_distance", title, "L'écart-type à 10 et à 60 cm n'est pas le bon.", cause, **told
    )


def _told(sheet: Sheet, function: Any, rest: list[Any], triple: tuple[float, float, float]) -> str:
    """The statement's question: σ at 10 and at 60 cm, and up to where it stays under 1 cm."""
    grid = np.arange(5.0, 81.0)
    spread = _values(sheet, function, volts(grid, *triple), rest)
    if isinstance(spread, Stumble) or len(spread) != len(grid) or not np.any(spread <= 1.0):
        return ""
    useful = f"{grid[spread <= 1.0].max():.0f}"
    return f"À 10 cm : {_cm(spread[5])} ; à 60 cm : {_cm(spread[55])} ; moins de 1 cm jusqu'à {useful} cm."


def _cm(value: float) -> str:
    return f"{value:.2f} cm".replace(".", ",")
