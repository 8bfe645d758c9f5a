"""What can be changed while the robot drives: sliders with their limits, in French, and what they are for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from factorlab.l19.follower import CURVES, FollowerSettings
from sequential.errors import DataError

__all__ = ["CONTROLS", "DETECTORS", "Control", "changed"]


@dataclass(frozen=True)
class Control:
    """A slider.

    Attributes
    ----------
    name : field of `FollowerSettings`
    option : on the command line, without dashes
    title, unit : as the page writes them
    low, high, step : in the unit shown
    digits : after the comma
    scale : the field's unit in units shown
    """

    name: str
    option: str
    title: str
    unit: str
    low: float
    high: float
    step: float
    digits: int
    group: str
    scale: float = 1.0

    def to_json(self) -> dict[str, Any]:
        """For the page, whose values are in the unit shown."""
        return asdict(self) | {"help": HELP[self.name]}


CAMERA, ROBOT, PID = "La caméra", "Le robot", "Le correcteur PID"
HELP = {
    "noise": "écart-type du bruit de chaque pixel, dont le gris va de 0 à 255",
    "blur_s": "durée d'ouverture de l'obturateur : plus elle est longue, plus l'image est étalée, et vieille",
    "look_ahead": "où regarde le correcteur : 0, la rangée du bas ; 1, celle du milieu",
    "kp": "proportionnel : trop petit, le robot sort large des virages ; trop grand, il les coupe",
    "ki": "intégral : ramène sur la ligne le point visé devant ; le robot, lui, coupe alors le virage",
    "kd": "dérivé : répond au changement de l'écart, et au bruit de la caméra",
    "speed_m_s": "demandée au robot ; deux fois plus vite, il faut tourner deux fois plus vite",
    "wheel_noise": "écart-type de chaque lecture de la vitesse d'une roue",
    "gyro_noise": "écart-type de chaque lecture du gyromètre",
    "bridging_s": "combien de temps le robot roule d'après son estimée et sa carte sans voir la ligne",
}
CONTROLS = (
    Control("noise", "bruit", "Bruit de l'image", "niveaux de gris", 0.0, 200.0, 1.0, 0, CAMERA),
    Control("blur_s", "flou", "Flou de bougé", "ms", 0.0, 1000.0, 10.0, 0, CAMERA, 1e3),
    Control("look_ahead", "regard", "Regard vers l'avant", "", 0.0, 1.0, 0.05, 2, CAMERA),
    Control("kp", "kp", "Kp", "rad/s par m", 0.0, 150.0, 0.5, 1, PID),
    Control("ki", "ki", "Ki", "rad/s par m·s", 0.0, 60.0, 0.5, 1, PID),
    Control("kd", "kd", "Kd", "rad/s par m/s", 0.0, 25.0, 0.5, 1, PID),
    Control("speed_m_s", "vitesse", "Vitesse", "m/s", 0.05, 1.0, 0.05, 2, ROBOT),
    Control("wheel_noise", "bruit-roues", "Bruit des roues", "m/s", 0.0, 0.3, 0.005, 3, ROBOT),
    Control("gyro_noise", "bruit-gyro", "Bruit du gyromètre", "rad/s", 0.0, 1.0, 0.01, 2, ROBOT),
    Control("bridging_s", "sans-voir", "Conduite sans voir", "s", 0.0, 5.0, 0.1, 1, ROBOT),
)
DETECTORS = {
    "bands": "filtre adapté, deux bandes",
    "threshold": "seuil d'Otsu, deux rangées",
    "find_line": "find_line de vision3d",
}


def changed(settings: FollowerSettings, wish: Mapping[str, Any]) -> FollowerSettings:
    """The settings with other values, given by the names of fields, in their units.

    Raises
    ------
    DataError
        where a name is not known or a value lies outside its slider.
    """
    known = {control.name: control for control in CONTROLS}
    choices = {"curve": CURVES, "detector": DETECTORS}
    values: dict[str, Any] = {}
    for name, value in wish.items():
        if name in choices:
            if value not in choices[name]:
                raise DataError(f"{name} : il n'y a pas de {value!r}, seulement {', '.join(choices[name])}")
            values[name] = value
        elif name == "seed":
            values[name] = _seed(value)
        elif name in known:
            values[name] = _inside(known[name], float(value))
        else:
            raise DataError(
                f"il n'y a pas de réglage {name!r}, seulement {', '.join([*known, *choices])}, seed"
            )
    return replace(settings, **values)


def _seed(value: Any) -> int:
    if int(value) < 0:
        raise DataError(f"la graine doit être un entier positif ou nul, reçu {value}")
    return int(value)


def _inside(control: Control, value: float) -> float:
    shown = value * control.scale
    if not control.low - 1e-9 <= shown <= control.high + 1e-9:  # NaN is not inside either
        unit = f" {control.unit}" if control.unit else ""
        raise DataError(
            f"{control.title} : attendu entre {control.low:g} et {control.high:g}{unit}, reçu {shown:g}"
        )
    return value
