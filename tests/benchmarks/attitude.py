"""Orientation on BROAD: our filters and smoother beside VQF, imufusion and ahrs, in one run.

`python attitude.py [--json] [--quick]`; --quick leaves the slow peers out.  Needs FACTORLAB_DATA.  Errors are
RMSE in degrees over samples of motion with truth, averaged over trials; of 6-D answers the mean heading
offset is taken off.  One set of parameters, chosen on the trials 01, 07, 16, 24 and 29; the others (05, 11,
21, 27 and 34) are held out.  ahrs takes 50 µs a sample and runs on three trials.  CPU time, medians of
interleaved rounds.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from measure.attitude_peers import PEERS, SLOW_PEERS, Answer, vqf_batch
from measure.figures import Figure, publish, say
from measure.timing import cpu_seconds

from sequential import attitude
from sequential.attitude import AttitudeHistory
from sequential.evaluate import attitude_error, attitude_nees
from sequential.readers import read_broad
from sequential.readers.broad import BroadTruth
from sequential.sensors import ImuRecording

CHOSEN_ON = ("01", "07", "16", "24", "29")
SLOW_TRIALS = ("05", "21", "34")
CHI2_95 = 7.815  # χ² of 3 degrees of freedom, 95 %
CAUSAL, SMOOTHER = "error_state", "smoother"


class Trial(NamedTuple):
    """One recording of BROAD."""

    number: str
    recording: ImuRecording
    truth: BroadTruth


class Score(NamedTuple):
    """Total, heading and inclination RMSE (degrees) with and without field; NEES shares where there are."""

    with_field: tuple[float, float, float]
    without: tuple[float, float, float]
    share: float
    share_without: float


Table = dict[str, dict[str, Score]]  # by filter, by trial


def trials() -> list[Trial]:
    """All of the folder, in order."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "")) / "imu" / "broad"
    files = sorted(folder.glob("*.npz"))
    if not files:
        sys.exit(f"no trial of BROAD in {folder}: set FACTORLAB_DATA to the folder of the recordings")
    return [Trial(path.name[:2], *read_broad(path)) for path in files]


def our_filters() -> dict[str, object]:
    """Every estimator of the library, with its default settings."""
    return {
        "complementary": attitude.ComplementaryAttitude(),
        "kalman": attitude.TiltKalman(),
        "madgwick": attitude.Madgwick(),
        "mahony": attitude.Mahony(),
        CAUSAL: attitude.ErrorStateAttitude(),
        SMOOTHER: attitude.AttitudeSmoother(),
    }


def score(trial: Trial, answer: Answer, found: AttitudeHistory | None = None) -> Score:
    """Hold both answers to the cameras."""
    truth, moving = trial.truth.world_q_body, trial.truth.movement
    with_field = attitude_error(answer["9d"], truth, moving)
    without = attitude_error(answer["6d"], truth, moving, heading_offset="mean")
    share = share_without = np.nan
    if found is not None and found.cov is not None:
        share = _share(answer["9d"], found.cov, truth, with_field.judged, 0.0)
    if found is not None and found.cov_6d is not None:
        share_without = _share(answer["6d"], found.cov_6d, truth, without.judged, without.offset)
    return Score(with_field.degrees, without.degrees, share, share_without)


def _share(
    answer: np.ndarray, cov: np.ndarray, truth: np.ndarray, judged: np.ndarray, offset: float
) -> float:
    nees = attitude_nees(answer[judged], cov[judged], truth[judged], heading_offset=offset)
    return float(np.mean(nees < CHI2_95))


def ours(trial: Trial, name: str, estimator: object) -> Score:
    """With field, and without: from the same history where it gives both."""
    found = estimator.estimate(trial.recording)
    if (blind := found.heading_free) is None:
        blind = type(estimator)(magnetometer=False).estimate(trial.recording).world_q_body
    return score(trial, {"9d": found.world_q_body, "6d": blind}, found)


def table(every: list[Trial]) -> Table:
    """Every filter on every trial that it has time for."""
    scores: Table = {}
    for trial in every:
        say(f"trial {trial.number}: {trial.recording.name}")
        for name, estimator in our_filters().items():
            scores.setdefault(name, {})[trial.number] = ours(trial, name, estimator)
        for name, peer in PEERS.items():
            scores.setdefault(name, {})[trial.number] = score(trial, peer(trial.recording))
        if trial.number in SLOW_TRIALS and "--quick" not in sys.argv[1:]:
            for name, peer in SLOW_PEERS.items():
                scores.setdefault(name, {})[trial.number] = score(trial, peer(trial.recording))
    return scores


def mean(scores: Table, name: str, field: str, part: int, of: tuple[str, ...] | None = None) -> float:
    """Average over trials of one error: part 0 total, 1 heading, 2 inclination."""
    rows = scores[name]
    return float(np.mean([getattr(rows[k], field)[part] for k in rows if of is None or k in of]))


def accuracy(scores: Table) -> dict[str, Figure]:
    """The rows of the issue, each with VQF of this run as its must."""
    bars = {
        "9d_total": (CAUSAL, "vqf", "with_field", 0, 2.20),
        "9d_inclination": (CAUSAL, "vqf", "with_field", 2, 0.60),
        "smoother_total": (SMOOTHER, "offline_vqf", "with_field", 0, 2.05),
        "smoother_inclination": (SMOOTHER, "offline_vqf", "with_field", 2, 0.45),
        "6d_total": (CAUSAL, "vqf", "without", 0, 2.10),
    }
    held_out = tuple(sorted(set(scores[CAUSAL]) - set(CHOSEN_ON)))
    figures = {}
    for name, (own, peer, field, part, aim) in bars.items():
        theirs = mean(scores, peer, field, part)
        figures[f"broad_{name}"] = Figure(
            mean(scores, own, field, part), "deg", f"{peer} {theirs:.3f}", theirs, aim
        )
        for label, some in (("chosen_on", CHOSEN_ON), ("held_out", held_out)):
            figures[f"broad_{name}_{label}"] = Figure(
                mean(scores, own, field, part, some),
                "deg",
                f"{peer} {mean(scores, peer, field, part, some):.3f} on {', '.join(some)}",
            )
    for name, (own, peer, field) in {
        "9d": (CAUSAL, "vqf", "with_field"),
        "smoother": (SMOOTHER, "offline_vqf", "with_field"),
        "6d": (CAUSAL, "vqf", "without"),
    }.items():
        behind = {
            k: getattr(row, field)[0] - getattr(scores[peer][k], field)[0] for k, row in scores[own].items()
        }
        worst = max(behind, key=lambda k: behind[k])
        figures[f"worst_trial_behind_{peer}_{name}"] = Figure(
            behind[worst], "deg", f"trial {worst}", 0.5, 0.3
        )
    return figures


def honesty(scores: Table) -> dict[str, Figure]:
    """On how many trials the share of samples with NEES below its 95 % bound is near 95 %."""
    figures = {}
    for name in (CAUSAL, SMOOTHER):
        shares = {k: row.share for k, row in scores[name].items()}
        said = " ".join(f"{k}:{share:.2f}" for k, share in shares.items())
        wide = sum(0.85 <= share <= 0.99 for share in shares.values())
        narrow = sum(0.90 <= share <= 0.98 for share in shares.values())
        figures[f"nees_{name}_within_085_099"] = Figure(wide, "trials", said, 6, None, "higher")
        figures[f"nees_{name}_within_090_098"] = Figure(narrow, "trials", "the aim's band", None, 9, "higher")
        blind = " ".join(f"{k}:{row.share_without:.2f}" for k, row in scores[name].items())
        inside = sum(0.85 <= row.share_without <= 0.99 for row in scores[name].values())
        figures[f"nees_{name}_6d_within_085_099"] = Figure(inside, "trials", blind, better="higher")
    return figures


def speed(every: list[Trial]) -> dict[str, Figure]:
    """The batch call over all trials, one thread, beside VQF's."""
    recordings = [trial.recording for trial in every]
    samples = sum(len(one) for one in recordings)
    works = {"vqf": lambda: [vqf_batch(one) for one in recordings]}
    for name, one in our_filters().items():
        if name != SMOOTHER:
            works[name] = lambda one=one: one.estimate_many(recordings, threads=1)
    seconds = cpu_seconds(works, rounds=7)
    figures = smoothing_speed(recordings, samples)
    for name, spent in seconds.items():
        micros, bars = 1e6 * spent / samples, (1.0, 0.3) if name == CAUSAL else (None, None)
        figures[f"speed_{name}"] = Figure(micros, "µs", "a sample, one thread")
        if name != "vqf":
            said = f"of VQF.updateBatch's {1e6 * seconds['vqf'] / samples:.3f} µs a sample"
            figures[f"speed_{name}_over_vqf"] = Figure(spent / seconds["vqf"], "x", said, *bars)
    return figures


def smoothing_speed(recordings: list[ImuRecording], samples: int) -> dict[str, Figure]:
    """The smoother over all trials beside offlineVQF."""
    smoother = our_filters()[SMOOTHER]
    works = {
        "offline_vqf": lambda: [PEERS["offline_vqf"](one) for one in recordings],
        SMOOTHER: lambda: smoother.estimate_many(recordings, threads=1),
    }
    seconds = cpu_seconds(works, rounds=3)
    return {
        f"speed_{name}": Figure(1e6 * spent / samples, "µs", "a sample, one thread")
        for name, spent in seconds.items()
    }


def graph_agreement(trial: Trial) -> dict[str, Figure]:
    """The smoother's graph beside its chain: the largest angle between them, and what GTSAM takes."""
    from factorlab.graph import AttitudeGraph

    chain, graph = our_filters()[SMOOTHER], AttitudeGraph()
    own, other = chain.estimate(trial.recording), graph.estimate(trial.recording)
    apart = attitude_error(other.world_q_body, own.world_q_body).errors[:, 0].max()
    spent = cpu_seconds({"graph": lambda: graph.estimate(trial.recording)}, rounds=3)["graph"]
    return {
        "smoother_graph_apart": Figure(float(np.degrees(apart)), "deg", f"largest on trial {trial.number}"),
        "speed_smoother_graph": Figure(1e6 * spent / len(trial.recording), "µs", "a sample, by GTSAM"),
    }


def every_trial(scores: Table) -> dict[str, Figure]:
    """Every filter on every trial, and all of them as two tables on stderr."""
    names = list(next(iter(scores.values())))
    figures = {}
    for label, field in (("9d", "with_field"), ("6d", "without")):
        say(
            f"\n{label}: total RMSE in degrees{'':<6}" + "".join(f"{k:>7}" for k in names) + "     mean incl."
        )
        for name, rows in scores.items():
            cells = "".join(f"{getattr(rows[k], field)[0]:7.2f}" if k in rows else f"{'':>7}" for k in names)
            say(f"{name:<32}{cells}{mean(scores, name, field, 0):9.3f}{mean(scores, name, field, 2):6.3f}")
            for k, row in rows.items():
                total, heading, inclination = getattr(row, field)
                said = f"heading {heading:.3f}, inclination {inclination:.3f}"
                figures[f"trial_{k}_{name}_{label}"] = Figure(total, "deg", said)
    return figures


def main() -> int:
    """Measure and publish."""
    every = trials()
    scores = table(every)
    say("speed")
    figures = accuracy(scores) | honesty(scores) | speed(every) | graph_agreement(every[0])
    return publish(figures | every_trial(scores))


if __name__ == "__main__":
    sys.exit(main())
