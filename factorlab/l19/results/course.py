"""The course item by item: ids in the order of the course, what each is called, how its file names it."""

from __future__ import annotations

import re
from dataclasses import dataclass

__all__ = ["COURSE", "PICTURED", "Item", "item_of", "part_of"]


@dataclass(frozen=True, slots=True)
class Item:
    """One item of the course; `command` is what a student types besides the item's own file."""

    id: str
    title: str
    command: str = ""


_CHECK, _REPORT = "factorlab l19 check MON_FICHIER.py", "factorlab l19 rapport -o rendu --only "
COURSE = tuple(
    Item(*given)
    for given in (
        ("F1", "Un vrai capteur"),
        ("F2", "Filtres simples"),
        ("C1", "Caractériser un capteur"),
        ("C2", "Le gain de Kalman 1-D tiré de Bayes"),
        ("K1", "Kalman 1-D"),
        ("K2", "Régler Q et R"),
        ("K3", "EKF d'un robot différentiel"),
        ("I1", "Attitude"),
        ("V1", "Une image est une matrice"),
        ("C3", "La chaîne de vision"),
        ("V2", "Géométrie de l'image"),
        ("P1", "Piège : R ou Q trop petit"),
        ("P2", "Piège : angles non repliés"),
        ("P3", "Piège : capteurs corrélés fusionnés comme indépendants"),
        ("P4", "Piège : seuils de couleur sous une autre lumière"),
        ("P5", "Piège : mesurer sans ôter la distorsion"),
        ("E1", "La classe Kalman", _CHECK),
        ("E2", "Médiane glissante et sauts", _CHECK),
        ("E3", "Capteur infrarouge", _CHECK),
        ("E4", "Composantes connexes", _CHECK),
        ("TP1", "Acquisition", f"{_REPORT}TP1 --imu MON_IMU.csv"),
        ("TP2", "Calibration de l'accéléromètre", f"{_REPORT}TP2 --positions MES_POSITIONS.csv"),
        ("TP3", "Attitude, hors ligne puis sur la carte", f"{_REPORT}TP3 --secousses MES_CHOCS.csv"),
        ("TP4a", "Calibrer une caméra", f"{_REPORT}TP4a --damier 'damier/*.jpg'"),
        ("TP4b", "Marqueurs ArUco et pose", "factorlab live camera 0 --task markers"),
        ("TP4c", "Suivre une ligne", "factorlab live camera 0 --task line"),
        ("TP4d", "ORB et homographie entre deux photos", f"{_REPORT}TP4d --bureau A.jpg B.jpg"),
        ("TP5", "Vision et IMU"),
        ("TP6", "Le livrable", "factorlab l19 rapport -o rendu"),
        ("D1", "Régler un Kalman comme un ingénieur", "factorlab l19 defi MON_FICHIER.py"),
        ("D2", "Robot suiveur de ligne", "factorlab l19 suiveur"),
        ("D3", "Démontrer, et UKF contre EKF"),
        ("S1", "Fiche : définitions"),
        ("S2", "Fiche : formules"),
        ("S3", "Fiche : démonstrations"),
        ("S4", "Fiche : méthodes et pièges"),
        ("S5", "Fiche : glossaire"),
    )
)
PICTURED = ("TP", "D")  # parts whose figures stand in RESULTATS.md
_NAME = re.compile(r"(\d\d)_([a-z]+\d)([a-d]?)_")


def item_of(script: str) -> str | None:
    """The id in the name of a script: `46_tp4b_marqueurs.py` is "TP4b"; None where there is none."""
    found = _NAME.match(script)
    return None if found is None else found[2].upper() + found[3]


def part_of(item: str) -> str:
    """The letters of an id: "TP4b" is "TP"."""
    return item.rstrip("abcd0123456789")
