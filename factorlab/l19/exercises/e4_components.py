"""E4: `composantes(masque)` and `plus_gros_objet(masque, aire_min)` against the statement."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from factorlab.l19.exercises.component_mutants import (
    EXAMPLE,
    WRAPPED,
    WRONG,
    Component,
    Mask,
    components,
    masks,
    normalised,
    wrapped_areas,
)
from factorlab.l19.exercises.fault import Fault, Stumble
from factorlab.l19.exercises.finding import Cause, Sheet, shown
from factorlab.l19.exercises.largest_object import check_largest
from factorlab.l19.exercises.signatures import imported, signature_fault

__all__ = ["check"]

TITLE = "composantes : aires et centres, la plus grande d'abord"
RECURSION = Cause("récursion qui dépasse la pile", "remplacez-la par une file : deque, append, popleft.")
ORDERS: dict[str, Callable[[tuple[float, float]], tuple[float, float]]] = {
    "(ligne, colonne)": lambda c: c,
    "(x, y)": lambda c: (c[1], c[0]),
    "(ligne, colonne), comptées à partir de 1": lambda c: (c[0] + 1, c[1] + 1),
    "(x, y), comptés à partir de 1": lambda c: (c[1] + 1, c[0] + 1),
    "(ligne, colonne), arrondies": lambda c: (round(c[0]), round(c[1])),
    "(x, y), arrondis": lambda c: (round(c[1]), round(c[0])),
    "(ligne, colonne), tronquées": lambda c: (int(c[0]), int(c[1])),
    "(x, y), tronqués": lambda c: (int(c[1]), int(c[0])),
}


def check(sheet: Sheet) -> None:
    """Every check of E4 on the names of a file."""
    order = None
    if (function := sheet.names.get("composantes")) is not None:
        fault = signature_fault(function, ("masque",))
        if fault:
            sheet.wrong("composantes", TITLE, f"`composantes` {fault}.")
        else:
            order = _check_components(sheet, function)
    if (largest := sheet.names.get("plus_gros_objet")) is not None:
        fault = signature_fault(largest, ("masque", "aire_min"))
        if fault:
            title = "plus_gros_objet(masque, aire_min)"
            sheet.wrong("plus_gros_objet", title, f"`plus_gros_objet` {fault}.")
        else:
            check_largest(sheet, largest, None if order is None else ORDERS[order])


def _example(sheet: Sheet) -> str:
    rows = shown(EXAMPLE.tolist())
    return "\n".join(
        ["import numpy as np", imported(sheet.module, "composantes"), f"composantes(np.array({rows}))"]
    )


def _check_components(sheet: Sheet, function: Callable[..., Any]) -> str | None:
    """The order of a centroid's coordinates, where everything is right."""
    tried = masks(np.random.default_rng(11))
    answers = []
    for mask in tried:
        given = mask.copy()
        try:
            returned = sheet.call(function, given)
        except Stumble as stumble:
            cause = _cause_of(stumble.fault)
            sheet.stumbled("composantes", TITLE, stumble.fault, cause=cause, example=_example(sheet))
            return None
        if not np.array_equal(given, mask):
            cause = Cause(
                "argument modifié", "effacez les pixels visités sur une copie : reste = masque.copy()."
            )
            said = "`composantes` change le masque qu'on lui donne : un deuxième appel ne trouve plus rien."
            sheet.wrong("composantes", TITLE, said, cause)
            return None
        answers.append(returned)
    order = _judge(sheet, tried, answers)
    if order is not None:
        _kinds(sheet, function)
        _large(sheet, function)
    return order


def _cause_of(fault: Fault) -> Cause | None:
    if fault.kind == "RecursionError":
        return RECURSION
    if fault.kind == "IndexError":
        return Cause(
            "bord de l'image dépassé", "vérifiez 0 <= i < hauteur et 0 <= j < largeur avant de lire."
        )
    return None


def _judge(sheet: Sheet, tried: list[Mask], answers: list[Any]) -> str | None:
    found = [normalised(answer) for answer in answers]
    wanted = components(EXAMPLE)
    more = {
        "expected": f"{shown([(int(a), c) for a, c in wanted])}, centres en (ligne, colonne) ou en (x, y)",
        "got": shown(answers[0]),
        "example": _example(sheet),
    }
    right = [row for row in found if row is not None]
    if len(right) < len(found):
        cause = Cause("return oublié", "rendez la liste des (aire, centre).") if answers[0] is None else None
        said = "Le résultat n'est pas une liste de (aire, centre)."
        sheet.wrong("composantes", TITLE, said, cause, **more)
        return None
    for order, turned in ORDERS.items():
        if all(same(f, components(m), turned) for f, m in zip(right, tried, strict=True)):
            _tell_order(sheet, order)
            return order
    for cause, wrong in WRONG.items():
        for turned in ORDERS.values():
            if all(same(f, wrong(m), turned) for f, m in zip(right, tried, strict=True)):
                sheet.wrong("composantes", TITLE, "Ce ne sont pas les composantes 4-connexes.", cause, **more)
                return None
    areas = [[a for a, _ in row] for row in right]
    wrapped = areas == [wrapped_areas(m) for m in tried]
    said = "Ce ne sont pas les composantes 4-connexes."
    sheet.wrong("composantes", TITLE, said, WRAPPED if wrapped else None, **more)
    return None


def _tell_order(sheet: Sheet, order: str) -> None:
    sheet.passed("composantes", TITLE, f"Centres en {order}.")
    if "," in order.partition(")")[2]:
        said = (
            f"Vos centres sont en {order} : accepté. Un centre de gravité tombe entre les pixels, et le "
            "premier pixel a l'indice 0 : gardez des nombres à virgule."
        )
        sheet.remark("centre", "le centre", said)
    elif order == "(ligne, colonne)":
        said = (
            "Vos centres sont en (ligne, colonne) : accepté, l'énoncé ne tranche pas. OpenCV et la suite du "
            "cours écrivent (x, y), la colonne d'abord."
        )
        sheet.remark("centre", "le centre", said)


def same(got: list[Component], wanted: list[Component], turned: Callable[..., tuple[float, float]]) -> bool:
    """The same areas in the same order, and the same centroids among equal areas."""
    if len(got) != len(wanted) or not np.allclose([a for a, _ in got], [a for a, _ in wanted]):
        return False

    def key(one: tuple[float, tuple[float, float]]) -> tuple[float, ...]:
        return (round(one[0], 6), round(one[1][0], 6), round(one[1][1], 6))

    ours = sorted(key((a, turned(c))) for a, c in wanted)
    return bool(not ours or np.allclose(sorted(key(one) for one in got), ours, atol=1e-5))


def _kinds(sheet: Sheet, function: Callable[..., Any]) -> None:
    """Masks as OpenCV gives them, 0 and 255, and as comparisons do, booleans."""
    wanted = [a for a, _ in components(EXAMPLE)]
    for name, mask in (("0 et 255", (255 * EXAMPLE).astype(np.uint8)), ("booléens", EXAMPLE.astype(bool))):
        found = normalised(sheet.call.tried(function, mask))
        areas = None if found is None else [a for a, _ in found]
        if areas == wanted:
            continue
        title = f"un masque en {name}"
        if areas == [255 * a for a in wanted]:
            cause = Cause("somme des valeurs au lieu du nombre de pixels", "comptez les pixels non nuls.")
            sheet.wrong("masque", title, "Les aires sont 255 fois trop grandes.", cause)
        else:
            cause = Cause("masque comparé à 1", "un pixel est allumé s'il n'est pas nul : masque != 0.")
            said = f"Avec un masque en {name}, comme les rend OpenCV ou une comparaison, le résultat change."
            got = "rien" if areas is None else f"aires {shown(areas)}"
            sheet.wrong("masque", title, said, cause, expected=f"aires {shown(wanted)}", got=got)
        return
    sheet.passed("masque", "des masques en 0/1, 0/255 et booléens")
    empty = sheet.call.tried(function, np.zeros((3, 4), np.uint8))
    if empty is None or len(normalised(empty) or []) > 0:
        sheet.remark("vide", "un masque vide", "Un masque sans pixel allumé devrait rendre une liste vide.")


def _large(sheet: Sheet, function: Callable[..., Any]) -> None:
    """A whole image lit: a recursion dies of it, and a slow search shows."""
    title = "une grande image"
    full = np.ones((90, 120), np.uint8)
    try:
        found = normalised(sheet.call(function, full))
        if found is None or [a for a, _ in found] != [full.size]:
            said = "Une image 120 × 90 toute allumée est une seule composante de 10 800 pixels."
            got = "rien" if found is None else f"aires {shown([a for a, _ in found])[:60]}"
            sheet.wrong("grande", title, said, got=got)
            return
        random = (np.random.default_rng(2).random((240, 320)) < 0.6).astype(np.uint8)
        sheet.call(function, random, limit_s=5.0)
    except Stumble as stumble:
        if stumble.fault.kind == "durée":
            said = (
                "Trop lent pour une image de caméra : une deque et popleft() (et non liste.pop(0)), et des "
                "marques dans un tableau (et non `in liste`)."
            )
            sheet.remark("grande", title, said)
        else:
            sheet.stumbled("grande", title, stumble.fault, cause=_cause_of(stumble.fault))
        return
    sheet.passed("grande", title, "320 × 240 passe sans peine.")
