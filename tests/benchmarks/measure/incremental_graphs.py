"""iSAM2 through our interface beside the loop that one would write by hand against gtsam, in one process.

Both take the same measurements in the same order, relinearise by the same settings, begin each variable in
the same place and ask for the newest pose after every step; their last poses are compared too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import groupby

import gtsam
import numpy as np
from graph_slam_worlds import loop
from gtsam.symbol_shorthand import L, X
from numpy.typing import NDArray

from factorlab.datasets import load_slam
from factorlab.graph.slam import IncrementalSlam
from measure.figures import Figure, interleaved, say
from sequential.slam import Factors, SlamProblem

Array = NDArray[np.float64]
THRESHOLD = 0.01
BY_HAND = "the same loop written against gtsam by hand"


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """All rows of this part."""
    poses = 300 if quick else 1000
    steps = 100 if quick else 250
    ours = IncrementalSlam(threshold=THRESHOLD, final=False, covariance=False, online=False)
    cases: dict[str, tuple[SlamProblem, Callable[[SlamProblem], Array]]] = {
        "w10000": (prefix(load_slam("w10000")[0].problem, poses), pose_graph_by_hand),
        "city10000": (prefix(load_slam("city10000")[0].problem, poses), pose_graph_by_hand),
        "landmarks": (
            loop(np.random.default_rng(1), steps=steps, landmarks=40, turns=steps / 60.0)[0],
            landmarks_by_hand,
        ),
    }
    rows: dict[str, Figure] = {}
    for name, (problem, hand) in cases.items():
        apart = np.abs(ours.solve(problem).online.mean[-1] - hand(problem)).max()
        times = interleaved(
            {"ours": lambda p=problem: ours.solve(p), "hand": lambda p=problem, h=hand: h(p)},
            2 if quick else 5,
        )
        ratio = times["ours"] / times["hand"]
        say(
            f"{name}: {problem.count} measurements, ours {times['ours']:.2f} s, by hand {times['hand']:.2f} s"
        )
        rows[f"isam2_over_hand_{name}"] = Figure(ratio, "x", BY_HAND, must=1.2, aim=1.05)
        rows[f"isam2_apart_from_hand_{name}"] = Figure(float(apart), "m, rad", "last pose", must=1e-6)
    return rows


def prefix(problem: SlamProblem, poses: int) -> SlamProblem:
    """The measurements of the first poses, without a start."""
    kept = []
    for group in problem.factors:
        here = np.asarray(group.index).max(axis=1) < poses
        noise = np.asarray(group.noise_cov)
        if here.any():
            kept.append(
                Factors(
                    group.model,
                    group.slots,
                    np.asarray(group.index)[here],
                    np.asarray(group.z)[here],
                    noise[here] if noise.ndim == 3 else noise,
                    name=group.name,
                )
            )
    return replace(problem, factors=tuple(kept), start=None, t=None)


def engine() -> gtsam.ISAM2:
    """With the settings of both."""
    parameters = gtsam.ISAM2Params()
    parameters.relinearizeSkip = 1
    parameters.setRelinearizeThreshold(THRESHOLD)
    return gtsam.ISAM2(parameters)


def flat(pose: gtsam.Pose2) -> Array:
    """(3,)."""
    return np.array([pose.x(), pose.y(), pose.theta()])


def pose_graph_by_hand(problem: SlamProblem) -> Array:
    """Poses of the plane with odometry and loop closures: the last pose (3,)."""
    first = problem.factors[0]
    edges, noises = [], {}
    for group in problem.factors[1:]:
        pairs = np.asarray(group.index).tolist()
        for (i, j), z, cov in zip(pairs, group.z.tolist(), group.covs(), strict=True):
            key = cov.tobytes()
            if key not in noises:
                noises[key] = gtsam.noiseModel.Gaussian.Covariance(cov)
            edges.append((i, j, gtsam.Pose2(*z), noises[key]))
    edges.sort(key=lambda edge: max(edge[:2]))
    isam, known = engine(), {0}
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    graph.add(
        gtsam.PriorFactorPose2(
            X(0), gtsam.Pose2(*first.z[0]), gtsam.noiseModel.Gaussian.Covariance(first.covs()[0])
        )
    )
    values.insert(X(0), gtsam.Pose2(*first.z[0]))
    isam.update(graph, values)
    newest, pose = 0, isam.calculateEstimatePose2(X(0))
    for step, arrived in groupby(edges, key=lambda edge: max(edge[:2])):
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        for i, j, measured, noise in arrived:
            graph.add(gtsam.BetweenFactorPose2(X(i), X(j), measured, noise))
            if j not in known:
                at = pose if i == newest else isam.calculateEstimatePose2(X(i))
                values.insert(X(j), at.compose(measured))
                known.add(j)
            elif i not in known:
                at = pose if j == newest else isam.calculateEstimatePose2(X(j))
                values.insert(X(i), at.compose(measured.inverse()))
                known.add(i)
        isam.update(graph, values)
        newest, pose = step, isam.calculateEstimatePose2(X(step))
    everything = isam.calculateEstimate()
    return flat(everything.atPose2(X(newest)))


def landmarks_by_hand(problem: SlamProblem) -> Array:
    """A robot among landmarks with range and bearing: the last pose (3,)."""
    first, odometry, sightings = problem.factors
    move = gtsam.noiseModel.Gaussian.Covariance(odometry.covs()[0])
    look = gtsam.noiseModel.Gaussian.Covariance(sightings.covs()[0][::-1, ::-1])
    seen: dict[int, list[tuple[int, float, float]]] = {}
    for (i, l), (distance, bearing) in zip(sightings.index.tolist(), sightings.z.tolist(), strict=True):
        seen.setdefault(i, []).append((l, distance, bearing))
    isam, known = engine(), set()
    pose = gtsam.Pose2(*first.z[0])
    for k in range(len(odometry.z) + 1):
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        if k == 0:
            noise = gtsam.noiseModel.Gaussian.Covariance(first.covs()[0])
            graph.add(gtsam.PriorFactorPose2(X(0), pose, noise))
        else:
            delta = gtsam.Pose2(*odometry.z[k - 1])
            graph.add(gtsam.BetweenFactorPose2(X(k - 1), X(k), delta, move))
            pose = pose.compose(delta)
        values.insert(X(k), pose)
        for l, distance, bearing in seen.get(k, ()):
            turn = gtsam.Rot2(bearing)
            graph.add(gtsam.BearingRangeFactor2D(X(k), L(l), turn, distance, look))
            if l not in known:
                values.insert(L(l), pose.transformFrom(distance * np.array([turn.c(), turn.s()])))
                known.add(l)
        isam.update(graph, values)
        pose = isam.calculateEstimatePose2(X(k))
    everything = isam.calculateEstimate()
    return flat(everything.atPose2(X(len(odometry.z))))
