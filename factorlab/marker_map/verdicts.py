"""What is to be thought of a marker map: each verdict a number, its band, what it means and what to do."""

from __future__ import annotations

import numpy as np

from factorlab.marker_map.beside import beside
from factorlab.marker_map.job import MapJob
from factorlab.marker_map.mapping import MarkerMap
from factorlab.report.document import Status, Verdict

__all__ = ["map_verdicts", "pixel_rms", "sentence"]

GRAVITY_BAND = (9.2, 10.4)
SCALE_WARN, SCALE_FAIL = 4.0, 25.0
CLOCK_S = 2e-3  # an offset below this moves nothing that a hand-held camera could show
REJECTED_WARN = 0.05
EXPLAINED = 0.8
COVERED = 0.95
SIZE_SHARE = 0.015  # of the accelerometer's own scale


def map_verdicts(job: MapJob) -> list[Verdict]:
    """All of them, the gravest kind of each first."""
    found = job.found
    verdicts = [_placed(found), *_contradictions(found), *_once(found), *_doubles(found)]
    verdicts += [_fit(found), _rejected(found), _precision(found), *_plane(found), *_decided(found)]
    if found.inertial is not None:
        verdicts += [_gravity(found), *_size(found), *_clocks(job), *_coverage(found), *_biases(found)]
        verdicts += _filter(job)
    verdicts += [
        Verdict("left out", None, None, "WARN", text, "the rest was read") for text in job.left_out[:5]
    ]
    if job.fault:
        verdicts.append(Verdict("source", None, None, "WARN", job.fault, "what came before was read"))
    return verdicts


def sentence(job: MapJob) -> str:
    """The map in one sentence."""
    found = job.found
    how = "camera and IMU" if found.inertial is not None else "the camera alone"
    placed = f"{len(found.ids)} of {len(found.sightings.ids)} markers"
    many = f"{placed} are placed by {how}, from {len(found.frames)}"
    if photographs(found):
        return f"{many} pictures."
    return f"{many} frames over {(found.t[-1] - found.t[0]) * 1e-9:.1f} s."


def pixel_rms(found: MarkerMap) -> float:
    """Root mean square reprojection error of the corners that were taken, px a corner."""
    miss = found.misses()[found.gated.taken]
    return float(np.sqrt(np.nanmean(np.sum(miss**2, axis=-1))))


def photographs(found: MarkerMap) -> bool:
    return len(found.frames) < 2 or float(np.median(np.diff(found.t))) > 5e9


def _named(numbers: object) -> str:
    return ", ".join(map(str, np.asarray(numbers).tolist()))


def _placed(found: MarkerMap) -> Verdict:
    """Which are in the map; those that contradict it have a line of their own."""
    lost = found.sightings.ids[~found.placed & found.gated.sound]
    if not len(lost):
        return Verdict("markers placed", len(found.ids), None, "PASS", f"numbers {_named(found.ids)}")
    why = "never seen in one frame with a marker of the map"
    if found.inertial is not None:
        why += ", nor within two seconds of one"
    return Verdict(
        "markers placed", len(found.ids), None, "WARN", f"not placed: {_named(lost)}, {why}",
        "film pairs of markers together, so that every one is tied to the rest",
    )  # fmt: skip


def _contradictions(found: MarkerMap) -> list[Verdict]:
    return [
        Verdict(
            f"marker {found.sightings.ids[k]}", 100.0 * float(found.gated.share[k]), (0.0, 30.0), "WARN",
            "of its sightings contradict the map; it was rejected: two prints bear this number, it was "
            "moved, or it is read where there is none",
            "print another number for one of them, or name the dictionary", "%",
        )
        for k in np.flatnonzero(~found.gated.sound)
    ]  # fmt: skip


def _once(found: MarkerMap) -> list[Verdict]:
    counts = np.bincount(found.sightings.marker[found.gated.taken], minlength=len(found.placed))
    once = found.sightings.ids[found.placed & (counts == 1)]
    if not len(once):
        return []
    return [
        Verdict(
            "seen once", len(once), (0, 0), "WARN",
            f"marker {_named(once)}: one picture places it; nothing checks which of its readings holds",
            "film it again, from another side",
        )
    ]  # fmt: skip


def _doubles(found: MarkerMap) -> list[Verdict]:
    twice = np.flatnonzero(found.sightings.doubles > 0)
    if not len(twice):
        return []
    said = "; ".join(f"{found.sightings.ids[k]} in {found.sightings.doubles[k]} frames" for k in twice)
    return [
        Verdict(
            "read twice in one frame", int(found.sightings.doubles.sum()), (0, 0), "WARN",
            f"{said}: the larger was kept", "print every number once",
        )
    ]  # fmt: skip


def _fit(found: MarkerMap) -> Verdict:
    status: Status = "PASS"
    if found.scale > SCALE_WARN:
        status = "FAIL" if found.scale > SCALE_FAIL else "WARN"
    rms = pixel_rms(found)
    return Verdict(
        "fit", float(np.sqrt(found.scale)), (0.0, float(np.sqrt(SCALE_WARN))), status,
        f"corners miss their projections by {rms:.2f} px; times the σ that they claim",
        "" if status == "PASS" else "check the camera's file and its zoom, and that the prints are flat", "σ",
    )  # fmt: skip


def _rejected(found: MarkerMap) -> Verdict:
    sound = found.gated.sound[found.sightings.marker]
    rejected = int((found.gated.rejected & sound).sum())
    share = rejected / max(1, rejected + int(found.gated.taken.sum()))
    status: Status = "WARN" if share > REJECTED_WARN else "PASS"
    action = "" if status == "PASS" else "look for motion blur, and for markers that bend or move"
    return Verdict(
        "sightings rejected", 100.0 * share, (0.0, 100.0 * REJECTED_WARN), status,
        f"{rejected} do not fit the map", action, "%",
    )  # fmt: skip


def _precision(found: MarkerMap) -> Verdict:
    sigma = np.sqrt(np.trace(found.marker_covs[found.placed][:, 3:, 3:], axis1=1, axis2=2))
    worst = int(np.argmax(sigma))
    return Verdict(
        "least sure marker", 1e3 * float(sigma[worst]), None, "INFO",
        f"σ of the place of marker {found.ids[worst]} relative to marker "
        f"{found.sightings.ids[found.reference]}", unit="mm",
    )  # fmt: skip


def _plane(found: MarkerMap) -> list[Verdict]:
    if not found.flat:
        return []
    many = int(found.placed.sum()) > 1
    said = "all markers lie in one plane" if many else "there is one marker"
    return [
        Verdict(
            "one plane", None, None, "INFO",
            f"{said}: seen from afar, such a map has a second reading of each frame, tilted the other way",
            "a marker on another wall or on the table settles it",
        )
    ]  # fmt: skip


def _decided(found: MarkerMap) -> list[Verdict]:
    share = found.decided / max(1, len(found.frames))
    if not found.decided or photographs(found):
        return []
    by = "the gyro" if found.inertial is not None else "the steadiness of the motion"
    return [
        Verdict(
            "decided by motion", 100.0 * share, (0.0, 20.0), "WARN" if share > 0.2 else "INFO",
            f"{found.decided} frames have two readings that fit alike; {by} chose",
            "bring more markers into the picture" if share > 0.2 else "", "%",
        )
    ]  # fmt: skip


def _gravity(found: MarkerMap) -> Verdict:
    gravity = float("nan") if found.gravity is None else found.gravity
    good = GRAVITY_BAND[0] <= gravity <= GRAVITY_BAND[1]
    return Verdict(
        "gravity", gravity, GRAVITY_BAND, "PASS" if good else "FAIL",
        "left free at the start: its length checks the units, the mount and the clocks",
        "" if good else "check --units, --extrinsics and the clocks", "m/s²",
    )  # fmt: skip


def _size(found: MarkerMap) -> list[Verdict]:
    """Accelerations know metres: the size of the markers that suits them."""
    if found.size is None:
        return []
    ratio, sigma = found.size
    band = 3.0 * sigma + SIZE_SHARE
    good = abs(ratio - 1.0) < band
    given = 1e3 * float(found.sightings.size_m[found.reference])
    return [
        Verdict(
            "size by the IMU", 100.0 * ratio, (100.0 * (1.0 - band), 100.0 * (1.0 + band)),
            "PASS" if good else "WARN",
            f"of the {given:g} mm given: what the accelerations ask for, ± {100 * sigma:.1f} %",
            "" if good else f"measure the black square again: it may be {given * ratio:.1f} mm", "%",
        )
    ]  # fmt: skip


def _clocks(job: MapJob) -> list[Verdict]:
    found = []
    if job.searched:
        found.append(
            Verdict("clock offset used", 1e3 * job.offset_s, None, "INFO", "found from the turns", unit="ms")
        )
    clock = job.clock
    if clock is None:
        text = "the camera turns too little to compare the clocks"
        return [*found, Verdict("clocks", None, None, "INFO", text, "record some brisk turns")]
    band = 2.5 * clock.sigma_s + CLOCK_S
    status: Status = "PASS" if abs(clock.offset_s) < band else "WARN"
    total = job.offset_s + clock.offset_s
    found.append(
        Verdict(
            "clocks apart by", 1e3 * clock.offset_s, (-1e3 * band, 1e3 * band), status,
            "what the turns of camera and gyro say beyond the offset used",
            "" if status == "PASS" else f"give --time-offset {total:.4f}; see `factorlab calibrate cam-imu`",
            "ms",
        )
    )  # fmt: skip
    drift, sigma = clock.drift_s
    if np.isfinite(sigma) and abs(drift) > 4.0 * sigma + CLOCK_S:
        found.append(
            Verdict(
                "clocks drift", 1e3 * drift, (-4e3 * sigma, 4e3 * sigma), "WARN",
                "between the halves of the recording: the clocks run unequally",
                "stamp both by one clock, or cut the recording into shorter ones", "ms",
            )
        )  # fmt: skip
    if clock.explained < EXPLAINED:
        found.append(
            Verdict(
                "turns explained", 100.0 * clock.explained, (100.0 * EXPLAINED, 100.0), "WARN",
                "of the camera's turns by the gyro: mount, axes or units may be wrong",
                "check --extrinsics (T_cam_imu, not its inverse) and the gyro's unit", "%",
            )
        )  # fmt: skip
    return found


def _coverage(found: MarkerMap) -> list[Verdict]:
    from factorlab.marker_map.segments import cut_at_frames

    assert found.inertial is not None  # noqa: S101 - asked for with one only
    apart = sum(one is None for one in cut_at_frames(found.inertial.imu, found.t))
    if not apart:
        return []
    text = "of the intervals between frames have no IMU: it paused, began late or ended early"
    return [Verdict("without IMU", 100.0 * apart / (len(found.t) - 1), (0.0, 0.0), "WARN", text, "", "%")]


def _filter(job: MapJob) -> list[Verdict]:
    """Whether an EKF on the same data says honestly how far it may be off."""
    if job.filtered is None:
        return [Verdict("filter", None, None, "INFO", f"did not run: {job.filter_fault}")]
    told = beside(job.found, job.filtered)
    if told is None:
        return [Verdict("filter", None, None, "INFO", "has no frame to compare: the recording is too short")]
    honest = told.covered > COVERED
    return [
        Verdict(
            "filter honest", 100.0 * told.covered, (100.0 * COVERED, 100.0), "PASS" if honest else "INFO",
            f"of the filter's poses lie within their 99.9 % of the map's, {1e3 * told.apart_m:.1f} mm off",
            "" if honest else "an EKF-SLAM is surer than it may be: take the map's numbers", "%",
        )
    ]  # fmt: skip


def _biases(found: MarkerMap) -> list[Verdict]:
    assert found.biases is not None  # noqa: S101 - there with an IMU
    accel, gyro = np.linalg.norm(found.biases[-1, :3]), np.degrees(np.linalg.norm(found.biases[-1, 3:]))
    return [
        Verdict("gyro bias", float(gyro), None, "INFO", "length, at the end", unit="°/s"),
        Verdict("accelerometer bias", float(accel), None, "INFO", "length, at the end", unit="m/s²"),
    ]
