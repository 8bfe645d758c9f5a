"""What a drive amounted to, in French: for the terminal, for a report, and as numbers for a machine."""

from __future__ import annotations

from typing import Any

from factorlab.live.follower.controls import CONTROLS
from factorlab.live.follower.journey import Journey
from factorlab.live.follower.session import FollowerSession
from factorlab.live.follower.state import summary_of
from factorlab.report.document import Document, Section, Table, Verdict

__all__ = ["document_of"]

AIM_M = 0.02  # lateral RMS that the challenge asks for
FIGURE = (
    "En haut, la ligne, le trajet vrai, celui que l'EKF estime et celui des roues et du gyromètre seuls "
    "; en bas, l'écart latéral (bande verte : ± 2 cm) et la commande du PID."
)


def document_of(session: FollowerSession, command: str = "") -> Document:
    """Tell how the last drive went, and how those before it did."""
    journey, summary = session.driven[-1], summary_of(session)
    return Document(
        title="L19, défi D2 : suivre une ligne par vision",
        lead=_lead(journey),
        verdicts=tuple(_verdicts(summary["journey"])),
        sections=(
            Section("Le trajet", figure=lambda: _figure(session), caption=FIGURE),
            Section("Les réglages", table=_settings(journey), page_only=True),
            *([Section("Les essais", table=_attempts(session))] if len(session.driven) > 1 else []),
        ),
        numbers=summary,
        lang="fr",
        command=command,
        conclusion=_conclusion(journey),
    )


def _figure(session: FollowerSession) -> Any:
    from factorlab.report.follower_figures import journey_figure

    return journey_figure(session.driven[-1].table(), session.line)


def _lead(journey: Journey) -> str:
    settings = journey.settings
    changed = f", réglages changés {journey.changes} fois en route" if journey.changes else ""
    return (
        f"Courbe « {settings.curve} », graine {settings.seed} : {len(journey.rows)} pas de 50 ms, "
        f"{_cm(journey.length_m, 0)} parcourus{changed}."
    )


def _conclusion(journey: Journey) -> str:
    if journey.lost_s is not None:
        return f"La ligne a été perdue à {_number(journey.lost_s, 1)} s."
    return f"La ligne a été suivie jusqu'au bout, à {_cm(journey.rms_m or 0.0, 1)} près (RMS)."


def _verdicts(one: dict[str, Any]) -> list[Verdict]:
    """Lost or not, how near the line, and what the filter adds to wheels and gyro."""
    held = one["lost_s"] is None
    near = one["rms_m"] is not None and one["rms_m"] <= AIM_M
    better = one["estimate_rms_m"] < one["odometry_rms_m"]
    return [
        Verdict(
            "temps tenu", one["t_s"] if held else one["lost_s"], None, "PASS" if held else "FAIL",
            "la ligne n'a jamais été perdue" if held else "ensuite le robot ne savait plus où est la ligne",
            "" if held else "moins de bruit, de flou ou de vitesse ; un seul réglage à la fois", "s",
        ),
        Verdict(
            "écart latéral RMS", None if one["rms_m"] is None else round(100 * one["rms_m"], 3), None,
            "PASS" if near else "WARN", f"le défi demande au plus {_cm(AIM_M, 0)} sans bruit",
            "" if near else "réglez Kp, puis Kd ; ralentissez dans les virages", "cm",
        ),
        Verdict(
            "erreur RMS de l'EKF", round(100 * one["estimate_rms_m"], 3), None, "PASS" if better else "WARN",
            f"les roues et le gyromètre seuls : {_cm(one['odometry_rms_m'], 1)}",
            "" if better else "une vue trompeuse de la ligne est pire que pas de vue", "cm",
        ),
    ]  # fmt: skip


def _settings(journey: Journey) -> Table:
    settings = journey.settings
    rows = [
        (one.title, getattr(settings, one.name) * one.scale, one.unit, f"--{one.option}") for one in CONTROLS
    ]
    return Table(("réglage", "valeur", "unité", "option"), tuple(rows), caption="Les réglages au départ")


def _attempts(session: FollowerSession) -> Table:
    rows = [
        (str(one.number), 100 * one.rms_m if one.rms_m is not None else None, one.rows[-1][0], one.lost_s)
        for one in session.driven
    ]
    return Table(
        ("essai", ("écart RMS", "cm"), ("durée", "s"), ("perdu à", "s")), tuple(rows), caption="Les essais"
    )


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}".replace(".", ",")


def _cm(value_m: float, digits: int) -> str:
    return f"{_number(100 * value_m, digits)} cm" if value_m < 1.0 else f"{_number(value_m, 1)} m"
