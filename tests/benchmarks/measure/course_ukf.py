"""Challenge D3 of the course: 200 draws of a differential robot, through the EKF and the UKF, warm."""

from __future__ import annotations

from time import perf_counter

from measure.figures import Figure

__all__ = ["figures"]

RUNS, QUICK = 200, 20
MUST_S = 10.0


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Seconds of the whole Monte Carlo, and what it says."""
    from factorlab.l19.contest import contest

    runs = QUICK if quick else RUNS
    contest(runs=2)
    began = perf_counter()
    strong = contest(runs)
    seconds = perf_counter() - began
    weak = contest(runs, noise="weak")
    rows = {
        "d3_monte_carlo": Figure(seconds, "s", f"{runs} draws and both filters, one core, warm", MUST_S),
        "d3_rmse_ratio_weak": Figure(weak.rmse("ekf") / weak.rmse("ukf"), "x", "EKF over UKF, weak noise"),
    }
    for name in ("ekf", "ukf"):
        low, high = (bound / 3.0 for bound in weak.anees(name).band)
        band = f"95 % band {low:.2f}-{high:.2f}, {runs} runs"
        rows |= {
            f"d3_lost_{name}": Figure(100.0 * strong.lost(name), "%", "of the runs, strong noise"),
            f"d3_rmse_{name}": Figure(strong.rmse(name), "m", "last ten seconds, strong noise"),
            f"d3_anees_{name}": Figure(strong.anees(name).mean / 3.0, "per dof", f"strong noise; {band}"),
            f"d3_anees_weak_{name}": Figure(weak.anees(name).mean / 3.0, "per dof", f"weak noise; {band}"),
        }
    return rows
