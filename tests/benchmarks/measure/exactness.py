"""How exact the filters are: against rational arithmetic, published numbers, least squares and themselves."""

from __future__ import annotations

from typing import Any

import dense
import exact
import numpy as np
from fuzz import fuzz
from worlds import LINEAR_WORLDS

import sequential as sq

from .cases import DT, stamps, track
from .figures import Figure
from .many_series import linear_model

__all__ = ["figures"]

FILTERED = {"mean": (1118.3114615, 1140.1084392, 1072.3160185), "cov": (15076.23639, 7894.55753, 5779.49738)}
SMOOTHED = {"mean": (1111.2202576, 1110.5292570, 1105.0248603), "cov": (4030.53277, 3242.05700, 2818.47314)}
LAST, LOG_LIKELIHOOD = (798.3702926, 4032.15794), -641.5855785


def nearly_alike(form: str, delta: float) -> float:
    """Largest error of P+ after two rows of H that differ by δ, noise δ (Grewal, Andrews 2015, ex. 7.2)."""
    matrix, noise = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + delta]]), delta**2 * np.eye(2)
    model = sq.StateSpace(
        sq.Vector(3),
        sq.Gaussian(np.zeros(3), np.eye(3)),
        sq.RandomWalk(0.0),
        {"z": sq.LinearSensor(matrix, noise)},
        start=0.0,
        check=False,
    )
    run = sq.run(sq.KalmanFilter(form=form), model, sq.SensorLog({"z": sq.Stream([0.0], [[0.3, 0.3]])}))
    return float(np.abs(run.cov[0] - exact.update(np.eye(3), matrix, noise, np.full(2, 0.3))[0]).max())


def ill_conditioned() -> dict[str, Figure]:
    """The update that rounding spoils, by form."""
    peer = "QR 7.1e-8, Joseph fails"
    return {
        "alike_ud_1e-9": Figure(nearly_alike("ud", 1e-9), "", f"1.9e-10; {peer}", 1e-9),
        "alike_ud_1e-12": Figure(nearly_alike("ud", 1e-12), "", "1.9e-13; QR 1.9e-5", None, 1e-12),
        "alike_default_1e-8": Figure(nearly_alike("joseph", 1e-8), "", "Joseph alone 0.82", 1e-6, 1e-8),
    }


def nile() -> dict[str, Figure]:
    """Worst relative difference to the recorded numbers of the local level (Durbin, Koopman 2012, 2.2)."""
    from statsmodels.datasets import nile as river

    flow = river.load_pandas().data["volume"].to_numpy(dtype=np.float64)[:, None]
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], [[1e7]]),
        sq.LinearProcess([[1.0]], [[1469.1]]),
        {"flow": sq.LinearSensor([[1.0]], 15099.0)},
    )
    problem = sq.prepare(model, sq.SensorLog({"flow": sq.Stream(np.arange(100.0), flow)}))
    run, smooth = (e.solve(problem) for e in (sq.KalmanFilter(), sq.RauchTungStriebel(sq.KalmanFilter())))
    got = [run.mean[:3, 0], run.cov[:3, 0, 0], smooth.mean[:3, 0], smooth.cov[:3, 0, 0]]
    got += [[run.mean[-1, 0], run.cov[-1, 0, 0], run.log_likelihood, smooth.cov[49, 0, 0]]]
    recorded = [*FILTERED.values(), *SMOOTHED.values(), (*LAST, LOG_LIKELIHOOD, 2326.75687)]
    worst = np.abs(np.concatenate(got) / np.concatenate(recorded) - 1.0).max()
    return {"nile_relative": Figure(float(worst), "", "16 recorded numbers, nine digits each", 1e-7)}


def smoothers() -> dict[str, Figure]:
    """RTS of the linear and of the unscented filter against dense least squares, in standard deviations."""
    rng, worst = np.random.default_rng(5), {"rts": 0.0, "urts": 0.0}
    pair = {
        "rts": sq.RauchTungStriebel(sq.KalmanFilter(), leave_one_out=False),
        "urts": sq.RauchTungStriebel(sq.UnscentedKalmanFilter(), leave_one_out=False),
    }
    problems = [world.problem(rng) for world in LINEAR_WORLDS]
    for case in (track(1, 2, 60), track(2, 2, 60), track(3, 3, 40)):
        stream = sq.Stream(stamps(case.z.shape[1]), case.z[0])
        problems.append(sq.prepare(linear_model(case), sq.SensorLog({"z": stream})))
    for problem in problems:
        nodes = (len(problem.t), problem.model.manifold.size)
        mean, cov = dense.least_squares(dense.linearise(problem, np.zeros(nodes)))
        for name, smoother in pair.items():
            worst[name] = max(worst[name], _gap(smoother.solve(problem), mean, cov))
    return {
        f"{name}_least_squares": Figure(value, "sigma", "statsmodels 2e-15", 1e-10)
        for name, value in worst.items()
    }


def _gap(run: Any, mean: np.ndarray, cov: np.ndarray) -> float:
    """Largest difference of means and covariances, in the standard deviations of least squares."""
    sigma = np.sqrt(np.diagonal(cov, axis1=1, axis2=2))
    spread = np.abs(run.cov - cov) / (sigma[:, :, None] * sigma[:, None, :])
    return float(max((np.abs(run.mean - mean) / sigma).max(), spread.max()))


def random_models(count: int) -> dict[str, Figure]:
    """What went wrong on random models of sizes 1-12 and condition numbers to 1e12, summed over the forms."""
    tally = fuzz(count)
    asked = f"{count} models, Joseph, UD and QR forms"
    found = {
        f"fuzz_{what}": Figure(float(sum(getattr(tally, what).values())), "runs", asked, 0.0)
        for what in ("negative_variance", "not_finite", "exceptions")
    }
    for form in ("joseph", "ud", "sqrt"):
        refused = tally.not_positive_definite[form] + tally.refused[form]
        found[f"fuzz_refused_{form}"] = Figure(float(refused), "runs", f"{count} models: NotPositiveDefinite")
        found[f"fuzz_indefinite_{form}"] = Figure(float(tally.indefinite[form]), "runs", f"{count} models")
    return found


def honesty() -> dict[str, Figure]:
    """ANEES of a filter on logs drawn from its own model: the mean over all steps in the band of one."""
    from sequential.evaluate import monte_carlo

    model = linear_model(track(2, 2, 1))
    t = DT * np.arange(101)
    drawn = monte_carlo(model, sq.KalmanFilter(), t, np.random.default_rng(2), runs=200)
    low, high = drawn.nees.band
    inside = f"band {low:.2f}-{high:.2f}; {100 * drawn.nees.share_inside:.0f} % of the steps inside"
    return {
        "anees": Figure(drawn.nees.mean, "", inside, high),
        "anees_low": Figure(drawn.nees.mean, "", "its lower end", low, None, "higher"),
    }


def figures(models: int) -> dict[str, Figure]:
    """Everything here; fuzzing takes 2 ms a model."""
    found = ill_conditioned() | nile() | smoothers() | random_models(models)
    return found | honesty()
