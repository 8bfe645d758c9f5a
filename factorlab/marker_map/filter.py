"""The same problem as a filter: an error-state EKF whose state grows by every new marker.

Between frames the IMU is integrated, at a frame the corners correct body and markers together (their
joint covariance is kept whole).  A marker enters at its first sighting whose odds are certain, and a
sighting beyond the gate is left out.
This is EKF-SLAM with an IMU: linearised once, at the prediction, and never again, which
is what the smoother's numbers are to be held against (Huang, Mourikis, Roumeliotis 2010, on what that costs).

It begins after a second beside one marker, which tells the vertical and the velocity; the world is where it
begins: that frame at the origin, heading zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.filter_gauge import held_at
from factorlab.marker_map.filter_steps import Body, propagated, started
from factorlab.marker_map.segments import cut_at_frames
from factorlab.marker_map.start import Modes
from sequential.errors import DataError
from sequential.manifold import SE3, rotation_matrix
from vision3d.markers.pose import CERTAIN
from vision3d.markers.sightings import MarkerSightings
from vision3d.rigid import compose, inverse

if TYPE_CHECKING:
    from factorlab.graph.marker_rows import CornerRows
    from factorlab.marker_map.mapping import Inertial

__all__ = ["FilterRun", "filter_markers"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
MANIFOLD = SE3()
GATE = 39.0  # χ² of eight that one sighting in 200 000 exceeds
WINDOW_S, FEWEST = 1.0, 8  # what it begins with
MISSES = 15  # sightings in a row beyond the gate after which a marker is begun anew


@dataclass(frozen=True, eq=False)
class FilterRun:
    """What the filter believed at each frame from its start on; NaN before it knew the reference.

    Parameters
    ----------
    frames : (K,) rows of the sightings' frames
    poses : (K, 7) world_T_body; `covs` (K, 15, 15), both in the chart and gauge of `MarkerMap.frame_covs`
    velocities, biases : (K, 3), (K, 6)
    markers : how many it knew in the end; `rejected` sightings beyond the gate
    seconds : of the whole run
    """

    frames: Ints
    poses: Array
    covs: Array
    velocities: Array
    biases: Array
    markers: int
    rejected: int
    seconds: float


def filter_markers(
    sightings: MarkerSightings, inertial: Inertial, reference: int, world_T_reference: Array
) -> FilterRun:
    """Run over a recording, and tell it in the world of a map.

    Parameters
    ----------
    sightings : on the IMU's clock
    reference : row of the marker that is held, as in the map
    world_T_reference : (7,) its pose there: place and heading are taken from it, the tilt is the filter's own

    Raises
    ------
    DataError
        where no marker is seen surely for a second with the IMU on, or the reference never is.
    """
    from factorlab.graph.marker_rows import CornerRows

    began = perf_counter()
    rows = CornerRows.of(sightings, np.asarray(inertial.body_T_camera, dtype=np.float64))
    held = np.asarray(world_T_reference, dtype=np.float64)
    state = _Filter(rows, Modes.of(sightings), inertial, reference, held)
    segments = cut_at_frames(inertial.imu, sightings.t)
    bounds = np.searchsorted(sightings.frame, np.arange(len(sightings.t) + 1))
    for k in range(len(sightings.t)):
        seen = np.arange(bounds[k], bounds[k + 1])
        if state.body is None:
            state.try_to_begin(k, seen)
        elif (segment := segments[k - 1]) is None:
            break  # without an IMU nothing leads on
        else:
            state.body, state.P = propagated(state.body, state.P, segment, inertial)
        if state.body is not None:
            state.take(seen)
            state.note(k)
    if not any(np.isfinite(told[0][0]) for told in state.told):
        raise DataError(
            "the filter found no frame to begin at: no marker, or not the reference, was sure for a second"
        )
    return state.finished(perf_counter() - began)


@dataclass(eq=False)
class _Filter:
    """State, joint covariance (15 + 6 M), and what was believed so far."""

    rows: CornerRows
    modes: Modes
    inertial: Inertial
    reference: int
    held: Array
    body: Body | None = None
    P: Array = field(default_factory=lambda: np.zeros((15, 15)))
    place: dict[int, int] = field(default_factory=dict)  # marker: its number in the state
    markers: list[Array] = field(default_factory=list)
    misses: dict[int, int] = field(default_factory=dict)
    frames: list[int] = field(default_factory=list)
    told: list[tuple[Array, Array, Array, Array]] = field(default_factory=list)
    rejected: int = 0
    early: list[tuple[int, int, int]] = field(default_factory=list)  # frame, marker, sighting: sure ones

    def sure(self, seen: Ints) -> NDArray[np.bool_]:
        """Which sightings have one reading that counts."""
        first, second = self.modes.probability[seen].T
        return np.asarray((first > 0) & (first > CERTAIN * second))

    def try_to_begin(self, k: int, seen: Ints) -> None:
        """Begin where one marker was seen surely over the last second, the IMU running."""
        t, marker = self.rows.sightings.t, self.rows.sightings.marker
        sure = seen[self.sure(seen)]
        self.early += [(k, int(marker[s]), int(s)) for s in sure]
        self.early = [one for one in self.early if t[k] - t[one[0]] <= 1.5e9 * WINDOW_S]
        for m in marker[sure]:
            frames, rows = zip(*((f, s) for f, other, s in self.early if other == m), strict=True)
            if (t[k] - t[frames[0]]) * 1e-9 < WINDOW_S or len(frames) < FEWEST:
                continue
            segments = cut_at_frames(self.inertial.imu, t[list(frames)])
            if any(one is None for one in segments):
                continue
            camera = inverse(self.modes.poses[list(rows), 0])
            poses = compose(camera, inverse(self.rows.body_T_camera))
            if (begun := started(poses, segments, self.inertial)) is not None:
                self.body, self.P = begun
                return

    def take(self, seen: Ints) -> None:
        """Correct by known markers, and begin new ones."""
        marker = self.rows.sightings.marker
        known = np.array([int(marker[s]) in self.place for s in seen], dtype=np.bool_)
        if known.any():
            self._correct(seen[known])
        sure = self.sure(seen)
        for s in seen[~known & sure]:
            self._begin_marker(int(s))

    def _jacobian(self, seen: Ints) -> tuple[Array, Array]:
        """Errors (8 n,) and their Jacobian (8 n, d) by the whole state."""
        assert self.body is not None  # noqa: S101 - has begun
        own = self.rows.only(seen)
        at = [self.place[int(m)] for m in own.sightings.marker]
        frames = np.tile(self.body.pose, (len(seen), 1))
        error, by_frame, by_marker = own.linearised(frames, np.array([self.markers[k] for k in at]))
        H = np.zeros((len(seen), 8, len(self.P)))
        H[:, :, :3] = by_frame[:, :, :3]
        H[:, :, 3:6] = by_frame[:, :, 3:] @ rotation_matrix(self.body.pose[:4]).T
        for row, k in enumerate(at):
            H[row, :, 15 + 6 * k : 21 + 6 * k] = by_marker[row]
        return error.reshape(-1), H.reshape(8 * len(seen), -1)

    def _correct(self, seen: Ints) -> None:
        error, H = self._jacobian(seen)
        good = np.zeros(len(seen), dtype=np.bool_)
        for row in range(len(seen)):
            own = slice(8 * row, 8 * row + 8)
            S = H[own] @ self.P @ H[own].T + np.eye(8)
            good[row] = error[own] @ np.linalg.solve(S, error[own]) <= GATE
        self._count(seen, good)
        if not good.any():
            return
        taken = np.repeat(good, 8)
        error, H = error[taken], H[taken]
        S = H @ self.P @ H.T + np.eye(len(error))
        K = np.linalg.solve(S, H @ self.P).T
        left = np.eye(len(self.P)) - K @ H
        self.P = left @ self.P @ left.T + K @ K.T
        self.P = 0.5 * (self.P + self.P.T)
        self._move(-K @ error)

    def _count(self, seen: Ints, good: NDArray[np.bool_]) -> None:
        """Keep the score of misses; a marker that only misses is forgotten, so that it can be begun anew."""
        self.rejected += int((~good).sum())
        for s, fits in zip(seen, good, strict=True):
            marker = int(self.rows.sightings.marker[s])
            self.misses[marker] = 0 if fits else self.misses.get(marker, 0) + 1
            if self.misses[marker] >= MISSES:
                self.place.pop(marker)
                self.misses[marker] = 0

    def _move(self, step: Array) -> None:
        assert self.body is not None  # noqa: S101 - has begun
        self.body = self.body.moved(step[:15])
        steps = step[15:].reshape(-1, 6)
        self.markers = [MANIFOLD.retract(pose, one) for pose, one in zip(self.markers, steps, strict=True)]

    def _begin_marker(self, s: int) -> None:
        """Append the pose of a marker by its first sighting, correlated with the body's."""
        assert self.body is not None  # noqa: S101 - has begun
        body_T_marker = compose(self.rows.body_T_camera, self.modes.poses[s, 0])
        carry = MANIFOLD.transport(MANIFOLD.identity(), body_T_marker)[0]
        J = np.zeros((6, len(self.P)))
        J[:, :3] = carry[:, :3]
        J[:, 3:6] = carry[:, 3:] @ rotation_matrix(self.body.pose[:4]).T
        cross = J @ self.P
        own = cross @ J.T + self.modes.covs[s, 0]
        self.P = np.block([[self.P, cross.T], [cross, 0.5 * (own + own.T)]])
        self.place[int(self.rows.sightings.marker[s])] = len(self.markers)
        self.markers.append(compose(self.body.pose, body_T_marker))

    def note(self, k: int) -> None:
        """Remember what is believed, in the gauge of the map; NaN while the reference is unknown."""
        assert self.body is not None  # noqa: S101 - has begun
        self.frames.append(k)
        if self.reference not in self.place:
            nothing = np.full(7, np.nan), np.full((15, 15), np.nan), np.full(3, np.nan)
            self.told.append((*nothing, self.body.bias))
            return
        at = self.place[self.reference]
        joint = np.concatenate([np.arange(15), np.arange(15 + 6 * at, 21 + 6 * at)])
        P = self.P[np.ix_(joint, joint)]
        self.told.append((*held_at(self.body, self.markers[at], P, self.held), self.body.bias))

    def finished(self, seconds: float) -> FilterRun:
        """Everything as arrays."""
        poses, covs, velocities, biases = (np.array(part) for part in zip(*self.told, strict=True))
        return FilterRun(
            np.array(self.frames, dtype=np.int64), poses, covs, velocities, biases,
            len(self.place), self.rejected, seconds,
        )  # fmt: skip
