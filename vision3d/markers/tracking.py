"""Markers followed through a video, so that what one picture leaves open the next ones decide.

One picture of a small marker has two readings; motion tells them apart, because only the true one moves as a
rigid thing does.  Each marker is followed by a few Gaussian hypotheses (pose and velocity), every picture
multiplies each with both readings, and the weights are the odds, accumulated.

>>> tracker = MarkerTracker(camera, size_m=0.05)  # doctest: +SKIP
>>> for frame in open_frames("markers.avi"):  # doctest: +SKIP
...     for one in tracker.update(1e-9 * frame.t_ns, detect_markers(frame.image, "4x4_50")):
...         one.id, one.pose.camera_T_marker, one.pose.odds, one.seen
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import TimeOrderError
from vision3d.markers.detection import Array, Marker
from vision3d.markers.hypothesis import POSES, Hypotheses, MarkerMotion, born, predicted, updated
from vision3d.markers.pose import MarkerPose, Mode, marker_poses

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["MarkerTracker", "TrackedMarker"]

BIRTH = float(np.log(1e-3 / (8.0 * np.pi**2 * 10.0)) + 3.0 * np.log(2.0 * np.pi))
"""Log density of a marker that is anywhere: one time in a thousand it was moved unseen, within 10 m³."""
LEAST_LOG_WEIGHT = float(np.log(1e-7))
TINY = 1e-300
DOUBT = 0.02
"""No picture says less of a reading: corners of a picture may be wrong together."""
FLIP = float(np.log(1e-4))
"""The chance that what was followed until now was the mirror image."""
COASTING_S = 0.25  # a break this long takes the velocity away
SAME = 2.0  # squared Mahalanobis distance below which two hypotheses are one
REPEATED = 0.2
"""What a picture of a marker that did not move a pixel is worth: its errors are mostly those of the last."""


@dataclass(frozen=True, eq=False)
class TrackedMarker:
    """One marker at one moment.

    Parameters
    ----------
    id : its number
    pose : what all pictures so far say
    seen : whether it is in this picture; otherwise `pose` is a prediction
    since_s : how long it has been followed without a break
    measured : what this picture alone says; None where it was not seen
    marker : as detected; None where it was not seen
    velocity : (6,) rad/s and m/s in the marker's axes, of the likelier hypothesis
    """

    id: int
    pose: MarkerPose
    seen: bool
    since_s: float
    measured: MarkerPose | None
    marker: Marker | None
    velocity: Array


@dataclass
class _Track:
    begun: float
    last: float
    hypotheses: Hypotheses
    corners: Array
    rms_px: float


@dataclass(eq=False)
class MarkerTracker:
    """Follow markers by their numbers.

    Parameters
    ----------
    camera : that takes the pictures
    size_m : side of the black square, one for all, or by number: then only those are followed
    motion : how they may move
    forget_s : a marker not seen for so long begins anew when it returns
    """

    camera: Camera
    size_m: float | Mapping[int, float]
    motion: MarkerMotion = field(default_factory=MarkerMotion)
    forget_s: float = 1.0
    t: float = field(default=-np.inf, init=False)
    tracks: dict[int, _Track] = field(default_factory=dict, init=False, repr=False)

    def update(self, t: float, markers: Sequence[Marker]) -> tuple[TrackedMarker, ...]:
        """Take the markers of a picture at `t` seconds; returns all that are followed, by number.

        Raises
        ------
        TimeOrderError
            where `t` is not later than the last picture.
        """
        if not t > self.t:
            raise TimeOrderError(f"pictures come in the order of time: {t:.4f} s after {self.t:.4f} s")
        self.t = t
        for number in [k for k, track in self.tracks.items() if t - track.last > self.forget_s]:
            del self.tracks[number]
        first = {one.id: one for one in reversed(markers)}  # of several with one number the largest
        known = [one for one in first.values() if self._size(one.id) is not None]
        poses = marker_poses(self.camera, known, [self._size(one.id) or 0.0 for one in known])
        seen = {one.id: (one, pose) for one, pose in zip(known, poses, strict=True) if pose is not None}
        told = self._coasted([number for number in self.tracks if number not in seen])
        told += self._followed({number: pair for number, pair in seen.items() if number in self.tracks})
        told += [
            self._begun(marker, pose) for number, (marker, pose) in seen.items() if number not in self.tracks
        ]
        return tuple(sorted(told, key=lambda one: one.id))

    def _size(self, number: int) -> float | None:
        """Side of a marker; None for one that is not to be followed."""
        return self.size_m.get(number) if isinstance(self.size_m, Mapping) else self.size_m

    def _begun(self, marker: Marker, measured: MarkerPose) -> TrackedMarker:
        """A track of what one picture says."""
        modes = measured.modes
        found = born(
            np.array([mode.camera_T_marker for mode in modes]), np.array([mode.cov for mode in modes]),
            np.log([max(mode.probability, TINY) for mode in modes]), self.motion,
        )  # fmt: skip
        rms = measured.modes[0].rms_px
        self.tracks[marker.id] = _Track(self.t, self.t, _reduced(found), marker.corners, rms)
        return self._told(marker.id, self.tracks[marker.id].hypotheses, marker, measured)

    def _coasted(self, numbers: list[int]) -> list[TrackedMarker]:
        """Predicted from when they were last seen; the hypotheses themselves wait there."""
        return [
            self._told(number, ahead)
            for number, ahead in self._predicted(numbers, np.zeros(len(numbers), bool))
        ]

    def _predicted(self, numbers: list[int], seen: NDArray[np.bool_]) -> list[tuple[int, Hypotheses]]:
        """All hypotheses of some tracks at the time of this picture."""
        if not numbers:
            return []
        tracks = [self.tracks[number] for number in numbers]
        counts = [len(track.hypotheses) for track in tracks]
        dt = np.repeat([self.t - track.last for track in tracks], counts)
        ahead = predicted(
            Hypotheses.joined([track.hypotheses for track in tracks]),
            dt,
            self.motion,
            seen=np.repeat(seen, counts),
        )
        ends = np.cumsum(counts)
        return [
            (number, ahead.take(list(range(end - count, end))))
            for number, count, end in zip(numbers, counts, ends, strict=True)
        ]

    def _followed(self, seen: dict[int, tuple[Marker, MarkerPose]]) -> list[TrackedMarker]:
        """Every hypothesis times every reading, of all markers in one batch; then the best two of each."""
        if not seen:
            return []
        gaps = np.array([self.t - self.tracks[number].last > COASTING_S for number in seen])
        pairs, poses, covs, evidence, owners, modes = [], [], [], [], [], []
        for number, ahead in self._predicted(list(seen), ~gaps):
            marker, measured = seen[number]
            moved = float(np.sqrt(np.mean((marker.corners - self.tracks[number].corners) ** 2)))
            worth = REPEATED + (1.0 - REPEATED) * min(1.0, moved)
            odds = np.log([max(mode.probability, DOUBT) for mode in measured.modes])
            for k, mode in enumerate(measured.modes):
                pairs.append(ahead)
                poses += [mode.camera_T_marker] * len(ahead)
                covs += [mode.cov] * len(ahead)
                evidence += [worth * odds[k]] * len(ahead)
                owners += [number] * len(ahead)
                modes += [k] * len(ahead)
        reading = np.array(poses), np.array(covs), np.array(evidence)
        moved_on = updated(Hypotheses.joined(pairs), *reading)
        anew = born(*reading[:2], reading[2] + BIRTH, self.motion)
        both, owner = Hypotheses.joined([moved_on, anew]), np.array(owners * 2)
        turned = _turned(moved_on, anew, reading[2], np.array(owners), np.array(modes))
        both = both.weighing(
            np.logaddexp(both.log_weight, np.concatenate([np.full(len(turned), -np.inf), turned]))
        )
        told = []
        for number, (marker, measured) in seen.items():
            track = self.tracks[number]
            track.hypotheses = _reduced(both.take(np.flatnonzero(owner == number)))
            track.last, track.corners, track.rms_px = self.t, marker.corners, measured.modes[0].rms_px
            told.append(self._told(number, track.hypotheses, marker, measured))
        return told

    def _told(
        self, number: int, found: Hypotheses, marker: Marker | None = None, measured: MarkerPose | None = None
    ) -> TrackedMarker:
        track = self.tracks[number]
        pose = MarkerPose(
            tuple(
                Mode(
                    found.pose[k],
                    found.cov[k, :6, :6],
                    float(np.exp(found.log_weight[k])),
                    track.rms_px,
                    found.pose[k],
                )
                for k in range(len(found))
            ),
            measured.scale if measured is not None else 1.0,
        )
        return TrackedMarker(
            number, pose, marker is not None, self.t - track.begun, measured, marker, found.velocity[0]
        )


def _turned(
    moved_on: Hypotheses, anew: Hypotheses, evidence: Array, owner: NDArray[np.int_], mode: NDArray[np.int_]
) -> Array:
    """Log weights of the other reading of a marker, had the mirror image been followed until now."""
    weights = np.full(len(anew), -np.inf)
    for number in np.unique(owner):
        rows = np.flatnonzero(owner == number)
        best = rows[int(np.argmax(moved_on.log_weight[rows]))]
        other = rows[mode[rows] != mode[best]]
        if len(other):
            gain = evidence[other[0]] - evidence[best]
            weights[other[0]] = moved_on.log_weight[best] + gain + FLIP
    return weights


def _reduced(found: Hypotheses) -> Hypotheses:
    """The best two that differ; those like a better one are merged with it.  Weights then add up to one."""
    order = np.argsort(-found.log_weight, kind="stable")
    top = found.log_weight[order[0]]
    found = found.take(order[found.log_weight[order] > max(top + LEAST_LOG_WEIGHT, -1e300)])
    kept = [found.take([0])]
    for k in range(1, len(found)):
        one = found.take([k])
        apart = [_apart(other, one) for other in kept]
        near = int(np.argmin(apart))
        if apart[near] < SAME:
            kept[near] = _merged(kept[near], one)
        elif len(kept) < 2:
            kept.append(one)
    both = Hypotheses.joined(sorted(kept, key=lambda one: -one.log_weight[0]))
    return both.weighing(both.log_weight - np.logaddexp.reduce(both.log_weight))


def _apart(a: Hypotheses, b: Hypotheses) -> float:
    """Squared Mahalanobis distance of the poses of two single hypotheses."""
    step = POSES.local(a.pose[0], b.pose[0])
    return float(step @ np.linalg.solve(a.cov[0, :6, :6] + b.cov[0, :6, :6], step))


def _merged(a: Hypotheses, b: Hypotheses) -> Hypotheses:
    """One hypothesis with the mean and the covariance of two that are near each other."""
    weight = np.logaddexp(a.log_weight, b.log_weight)
    share = float(np.exp(b.log_weight - weight)[0])
    step = np.concatenate([POSES.local(a.pose[0], b.pose[0]), b.velocity[0] - a.velocity[0]])
    cov = (1.0 - share) * a.cov + share * b.cov + share * (1.0 - share) * np.outer(step, step)
    return Hypotheses(
        POSES.retract(a.pose, share * step[None, :6]), a.velocity + share * step[6:], cov, weight
    )
