"""Bundle adjustment beside COLMAP's Ceres: the final cost, the honesty of the covariances, and the time.

Cost: from one disturbed start, the same observations and the same loss; synthetic sets of every kind of loss,
Balbianello's Bundler file and the two dubrovnik files with FACTORLAB_DATA.  Covariances: NEES per degree of
freedom of points, poses and intrinsics over synthetic sets with Gaussian noise.
"""

from __future__ import annotations

import os
from pathlib import Path
from statistics import median

import numpy as np
from bundle_worlds import bundle_world, disturbed

from factorlab.graph import bundle_adjust
from measure.colmap_adjustment import LOSSES, colmap_adjust
from measure.figures import Figure, interleaved, say
from sequential.manifold import SE3
from vision3d.rigid import inverse
from vision3d.sfm import Reconstruction, reconstruct
from vision3d.sfm.bal import read_bal
from vision3d.sfm.bundle_problem import bundle_problem
from vision3d.sfm.bundler import read_bundler
from vision3d.sfm.gauge import constraints, directions


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    return {**costs(quick=quick), **honesty(quick=quick), **times(quick=quick)}


def apart(start: Reconstruction, loss: str | None, *, refine: bool = True) -> tuple[float, float]:
    """How far our final cost and COLMAP's are apart, share of COLMAP's: GTSAM's route, the compiled route."""
    _, cost, _ = colmap_adjust(start, loss=loss, refine=refine)
    ours = [
        bundle_adjust(start, refine_intrinsics=refine, loss=loss, route=route, covariances=False).cost
        for route in ("auto", "compiled")
    ]
    say(f"  loss {loss or 'none':<8} COLMAP {cost:.8g} px², GTSAM {ours[0]:.8g}, compiled {ours[1]:.8g}")
    return tuple(abs(own / cost - 1.0) for own in ours)


def costs(*, quick: bool) -> dict[str, Figure]:
    """Final costs against COLMAP's."""
    rows = {}
    shares = []
    for seed in range(1 if quick else 5):
        rng = np.random.default_rng(seed)
        truth = bundle_world(rng, views=8, points=200, cameras=2)
        start = disturbed(truth, rng).replaced(models=("RADIAL", "RADIAL"))
        say(f"synthetic set {seed}: 8 images of 2 cameras, {len(start.pixels)} observations")
        shares += [share for loss in LOSSES for share in apart(start, loss)]
    rows["bundle_cost_over_colmap_synthetic"] = within(shares)
    folder = os.environ.get("FACTORLAB_DATA")
    if folder:
        rows |= real_costs(Path(folder) / "vision" / "balbianello")
    return rows


def within(shares: list[float]) -> Figure:
    """The worst of some relative differences of cost."""
    return Figure(100.0 * max(shares), "%", "COLMAP 4.2", must=0.5, aim=0.5)


def real_costs(folder: Path) -> dict[str, Figure]:
    """The same of real files."""
    model = read_bundler(folder / "Balbianello.out", size=(640, 427))
    start = disturbed(model, np.random.default_rng(1))
    say("Balbianello's Bundler file, disturbed, a camera for every image")
    rows = {
        "bundle_cost_over_colmap_bundler_file": within(
            [share for loss in LOSSES for share in apart(start, loss)]
        )
    }
    shares = []
    for name in ("dubrovnik-3-7-pre", "dubrovnik-3-7-18-pre"):
        say(f"{name}, intrinsics held")
        shares += apart(read_bal(folder / f"{name}.txt"), None, refine=False)
    rows |= photographs(folder)
    rows["bundle_cost_over_colmap_dubrovnik"] = within(shares)
    return rows


def photographs(folder: Path) -> dict[str, Figure]:
    """Balbianello's five photographs: COLMAP's model adjusted by both, and our own mapper's."""
    colmaps, own = reconstruct(folder), reconstruct(folder, mapper="own")
    say(f"Balbianello's photographs, {len(colmaps.pixels)} observations, one camera")
    start = disturbed(colmaps, np.random.default_rng(1))
    shares = [share for loss in LOSSES for share in apart(start, loss)]
    return {
        "bundle_cost_over_colmap_balbianello": within(shares),
        "own_mapper_balbianello_placed": Figure(
            len(own), "of 5", f"COLMAP {len(colmaps)}", must=5, aim=5, better="higher"
        ),
        "own_mapper_balbianello_error": Figure(
            own.mean_error_px, "px", f"{len(own.points)} points; COLMAP, {len(colmaps.points)}: "
            f"{colmaps.mean_error_px:.3f}", must=0.26, aim=0.255,
        ),
    }  # fmt: skip


def honesty(*, quick: bool) -> dict[str, Figure]:
    """NEES per degree of freedom over sets whose truth is known."""
    sets = 20 if quick else 300
    names = ("points", "poses", "intrinsics")
    told = {name: [] for name in names}
    for seed in range(sets):
        rng = np.random.default_rng(1000 + seed)
        truth = bundle_world(rng, views=8, points=120)
        start = disturbed(truth, rng, share=0.3)
        found = bundle_adjust(start, gauge="centres", route="compiled")
        for name, value in zip(names, nees(truth, found), strict=True):
            told[name].append(value)
    rows = {}
    for name in names:
        mean, spread = np.mean(told[name]), np.std(told[name]) / np.sqrt(sets)
        say(f"NEES/dof of {name}: {mean:.3f} ± {spread:.3f} over {sets} sets")
        rows[f"bundle_nees_off_one_{name}"] = Figure(
            abs(mean - 1.0), "", f"measured {mean:.3f} +- {spread:.3f}", must=0.3, aim=0.1
        )
    return rows


def nees(truth: Reconstruction, found) -> tuple[float, float, float]:
    """Normalised squared errors per degree of freedom, of points, poses and intrinsics, about the centres."""
    problem, at = bundle_problem(truth)
    state = bundle_problem(found.reconstruction)[1]
    eta = SE3().local(inverse(at.poses), inverse(state.poses))
    G = directions(problem, at)
    D = constraints(problem, at, "centres", G)
    step = np.zeros(problem.size)
    step[: 6 * len(eta)] = eta.ravel()
    moved = state.points - at.points
    back = np.linalg.solve(D.dot(G), D.views.T @ step)
    eta = (step - G.views @ back)[: 6 * len(eta)].reshape(-1, 6)
    moved = moved - G.points @ back
    by_points = np.einsum("nx,nxy,ny->n", moved, np.linalg.inv(found.point_covs), moved).mean() / 3.0
    by_poses = np.mean([e @ np.linalg.solve(C, e) / 6.0 for e, C in zip(eta, found.centre_covs, strict=True)])
    off = np.delete(state.parameters[0] - at.parameters[0], [1, 2, 3])
    return by_points, float(by_poses), float(off @ np.linalg.solve(found.intrinsics_covs[0], off) / 3.0)


def times(*, quick: bool) -> dict[str, Figure]:
    """Seconds of a solve against Ceres', all in one process on one thread."""
    rng = np.random.default_rng(5)
    truth = bundle_world(rng, views=20, points=300 if quick else 2000)
    start = disturbed(truth, rng).replaced(models=("RADIAL",))
    seconds: dict[str, list[float]] = {"Ceres": [], "GTSAM": [], "compiled": []}
    interleaved(
        {
            "Ceres": lambda: seconds["Ceres"].append(colmap_adjust(start)[2]),
            "GTSAM": lambda: seconds["GTSAM"].append(
                bundle_adjust(start, route="native", covariances=False).seconds
            ),
            "compiled": lambda: seconds["compiled"].append(
                bundle_adjust(start, route="compiled", covariances=False).seconds
            ),
        },
        rounds=3 if quick else 5,
    )
    took = {name: median(values[1:]) for name, values in seconds.items()}
    say(f"{len(start.pixels)} observations: " + ", ".join(f"{k} {v:.2f} s" for k, v in took.items()))
    return {
        f"bundle_time_over_ceres_{name.lower()}": Figure(
            took[name] / took["Ceres"], "x", "COLMAP's solve, 1 thread"
        )
        for name in ("GTSAM", "compiled")
    }
