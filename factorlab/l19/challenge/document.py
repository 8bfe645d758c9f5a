"""Challenge D1 as a report in French: the score first, then the table and the public recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from factorlab.l19.challenge.files import FILTER, LOG, MODEL, TUNE
from factorlab.l19.challenge.judge import Judged, Row
from factorlab.l19.challenge.rivals import OURS, kalman
from factorlab.l19.challenge.scoring import MOST
from factorlab.l19.challenge.trials import HIDDEN, public_trial
from factorlab.l19.challenge.words import GOOD, HEADINGS, METRICS, cells_of, points, verdict_of
from factorlab.report.document import Document, Section, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["challenge_document"]

STATEMENT = (
    "Un thermomètre mesure une fois par seconde une température qui monte ou descend (rampe), puis ne bouge "
    f"plus (palier) ; bruit blanc, et une mesure aberrante. La note vient de {HIDDEN} enregistrements que "
    "vous ne connaissez pas : pentes, paliers, bruits (σ de 0,35 à 0,7 °C) et aberrantes diffèrent. Votre "
    "fichier définit filtrer(t, z), qui renvoie N estimations, ou un tableau (N, 2) : estimation et σ. À "
    "l'instant t[k], il ne doit regarder que z[0] … z[k]."
)
BEGIN = (
    f"À vous : « factorlab l19 defi -o DOSSIER » écrit {LOG} (l'enregistrement public), {MODEL} et {FILTER}. "
    f"Dans ce dossier, « {TUNE} » règle q ; « factorlab l19 defi {FILTER} » donne la note."
)
READING = (
    "RMS : erreur quadratique moyenne, à partir de t = 20 s sur la rampe et de 10 s après le coude sur le "
    "palier. Retard : temps pour faire 90 % d'un échelon de 1 °C, bruit compris, moyenne de 8 essais. "
    "Aberrante : plus grand écart qu'elle cause dans les estimations. (err./σ)² : 1 si σ est honnête. Chaque "
    "partie compte entre « ne rien filtrer » et notre Kalman réglé, sur une échelle de rapports : rampe 5 "
    "points, palier 5, retard 3, aberrante 4, σ 3."
)


def challenge_document(judged: Judged, command: str) -> Document:
    """The report on a file, or on our filters alone."""
    rows = [*judged.rivals, *([judged.row] if judged.row else [])]
    sections = [Section("Les filtres", READING, Table(HEADINGS, tuple(cells_of(row) for row in rows)))]
    if judged.public is not None:
        caption = "En gris les mesures, l'aberrante à t = 40 s ; la bande est à ± 2 σ quand il est donné."
        sections.append(
            Section(
                "L'enregistrement public", figure=lambda: _figure(judged), caption=caption, page_only=True
            )
        )
    return Document(
        title="Défi D1 : régler un filtre comme un ingénieur",
        lead=STATEMENT,
        verdicts=_verdicts(judged),
        sections=tuple(sections),
        numbers=_numbers(judged),
        lang="fr",
        command=command,
        conclusion=_conclusion(judged),
    )


def _verdicts(judged: Judged) -> tuple[Verdict, ...]:
    if judged.fault:
        return (Verdict("pas de note", None, None, "FAIL", judged.fault, judged.action),)
    if judged.row is None:
        return ()
    ours = _ours(judged).measures
    told = [verdict_of(part, judged.row.measures, ours) for part in judged.row.parts]
    causal = Verdict("causalité", None, None, "PASS", "le passé ne dépend pas de l'avenir")
    right = [one for one in told if one.verdict == "PASS"]
    lost = {METRICS[part.name]: part.of - part.points for part in judged.row.parts}
    mend = sorted((one for one in told if one.verdict != "PASS"), key=lambda one: -lost[one.metric])
    return causal, *right, *mend


def _ours(judged: Judged) -> Row:
    return next(row for row in judged.rivals if row.name == OURS)


def _conclusion(judged: Judged) -> str:
    if judged.fault:
        return f"Pas encore de note : {judged.fault}" + ("" if judged.fault.endswith((".", "?")) else ".")
    if judged.row is None:
        return BEGIN
    score, parts = points(judged.row.score), sorted(judged.row.parts, key=lambda part: part.points - part.of)
    poor = [part.name for part in parts if part.share < GOOD]
    beaten = [part.name for part in judged.row.parts if part.beats]
    worth_telling = beaten and judged.row.score >= GOOD * MOST  # not filtering at all has no delay either
    best = f" Mieux que notre Kalman : {', '.join(beaten)}." if worth_telling else ""
    if not poor:
        return f"Note : {score} / 20. Il n'y a rien à reprendre.{best}"
    return f"Note : {score} / 20. À reprendre d'abord : {poor[0]}.{best}"


def _numbers(judged: Judged) -> dict[str, Any]:
    """What the table shows, as plain numbers; nothing of the hidden recordings themselves."""
    rows = {row.name: _plain(row) for row in judged.rivals}
    own = None if judged.row is None else _plain(judged.row)
    tuned = {"q": judged.tuned.q, "R": judged.tuned.R}
    return {"score": None if judged.row is None else judged.row.score, "filter": own, "rivals": rows,
            "tuned": tuned, "fault": judged.fault or None}  # fmt: skip


def _plain(row: Row) -> dict[str, Any]:
    found = row.measures
    return {
        "score": row.score,
        "points": {part.name: part.points for part in row.parts},
        "ramp_rms_c": found.ramp,
        "plateau_rms_c": found.plateau,
        "delay_90_s": found.delay_s,
        "outlier_c": found.outlier,
        "nees": found.nees,
    }


def _figure(judged: Judged) -> Figure:
    from factorlab.report.style import blank

    assert judged.public is not None  # noqa: S101 - the section is there only then
    trial = public_trial()
    values = judged.public.reshape(len(trial.t), -1)
    ours = kalman(judged.tuned.q, judged.tuned.R)(trial.t, trial.z)
    figure, grid = blank(3.6, 1, 2)
    for axes, window, title in ((grid[0, 0], (25, 70), "L'aberrante"), (grid[0, 1], (100, 160), "Le coude")):
        seen = slice(*window)
        axes.plot(trial.t[seen], trial.z[seen], ".", color="#9a9a9a", markersize=4, label="mesures")
        if values.shape[1] == 2:
            low, high = values[:, 0] - 2 * values[:, 1], values[:, 0] + 2 * values[:, 1]
            axes.fill_between(trial.t[seen], low[seen], high[seen], color="#0072B2", alpha=0.18, linewidth=0)
        axes.plot(trial.t[seen], ours[seen, 0], color="#009E73", label="notre Kalman")
        axes.plot(trial.t[seen], values[seen, 0], color="#0072B2", label="votre filtre")
        axes.plot(trial.t[seen], trial.truth[seen], "--", color="black", linewidth=1.0, label="vérité")
        axes.set(title=title, xlabel="temps (s)", ylabel="température (°C)")
    grid[0, 1].legend(loc="lower right")
    return figure
