"""What `factorlab markers … --map` says: verdicts, the map, the way, and the same for a machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.marker_map.beside import Beside, beside
from factorlab.marker_map.export import marker_numbers
from factorlab.marker_map.job import MapJob
from factorlab.marker_map.verdicts import map_verdicts, pixel_rms, sentence
from factorlab.report.document import Document, Section, Table
from vision3d.rigid import compose

__all__ = ["map_document"]

MARKERS_READ = (
    "world_T_marker: x, y, z of the centre. σ is relative to the reference marker, whose place{held} held; "
    "tilt is the larger of the two turns that tip the marker over. Share: of its sightings, those that fit."
)
MAP_READ = (
    "Squares are markers, the short line is their outward normal, ellipses are 3σ of their places; the line "
    "is the camera's way, a dot its start. From above, from the front, and in perspective."
)
WAY_READ = "Place and orientation of the {body}, with 3σ as a band (magnified where it would not be seen)."
SIGMA_READ = (
    "Standard deviations of each frame: how much surer the pose is with the IMU than by its markers alone."
)
FILTER_READ = (
    "Place by the smoother less place by the filter, in the world, with the filter's own 3σ: a filter that "
    "keeps its word stays inside. Right: how sure each says it is of the place."
)
MOTION_READ = "Velocity in the world and the IMU's biases, with 3σ."
ERRORS_READ = (
    "Left: what corners miss their projections by, of sightings taken and rejected. Right: χ² of the "
    "sightings (eight numbers each) beside what noise of the stated σ gives."
)


def map_document(job: MapJob, command: str = "") -> Document:
    """Everything about a map."""
    found = job.found
    with_imu = found.inertial is not None
    lead = sentence(job)
    reference = int(found.sightings.ids[found.reference])
    world = "its z points up" if with_imu else "its axes are that marker's"
    lead += f" The world's origin is marker {reference}; {world}."
    return Document(
        "Marker map", lead, tuple(map_verdicts(job)), tuple(_sections(job)), _numbers(job), command=command
    )


def _sections(job: MapJob) -> list[Section]:
    from factorlab.report import marker_map_figures as figures

    found = job.found
    held = " and heading are" if found.inertial is not None else " and orientation are"
    read = MARKERS_READ.format(held=held)
    body = "IMU" if found.inertial is not None else "camera"
    sections = [
        Section("Markers", read, _marker_table(job)),
        Section("Map", figure=lambda: figures.plan(found), caption=MAP_READ),
        Section("Way", figure=lambda: figures.way(found), caption=WAY_READ.format(body=body)),
    ]
    if found.inertial is not None:
        sections.append(
            Section("Velocity and biases", figure=lambda: figures.motion(found), caption=MOTION_READ)
        )
    if job.vision is not None:
        vision = job.vision
        sections.append(
            Section(
                "What the IMU bought",
                _bought(job),
                figure=lambda: figures.sigmas(found, vision),
                caption=SIGMA_READ,
            )
        )
    if job.filtered is not None and (told := beside(found, job.filtered)) is not None:
        sections.append(
            Section(
                "Filter beside smoother", _filter_words(job, told), _filter_table(job, told),
                lambda: figures.filter_beside(told), FILTER_READ,
            )
        )  # fmt: skip
    sections.append(Section("Reprojection", figure=lambda: figures.reprojection(found), caption=ERRORS_READ))
    return sections


def _marker_table(job: MapJob) -> Table:
    rows: list[tuple[str | float | int | None, ...]] = []
    for entry in marker_numbers(job.found):
        share = 100.0 * entry["taken"] / max(1, entry["sightings"])
        if not entry["placed"]:
            why = "contradicts the map" if entry["contradicts"] else "not tied"
            rows.append((str(entry["id"]), None, None, None, None, None, entry["sightings"], share, why))
            continue
        x, y, z = entry["world_T_marker"][4:]
        place = 1e3 * float(np.linalg.norm(entry["sigma_position_m"]))
        tilt = max(entry["sigma_rotation_deg"][:2])
        reference = entry["id"] == int(job.found.sightings.ids[job.found.reference])
        word = "reference" if reference else ""
        rows.append((str(entry["id"]), x, y, z, place, tilt, entry["sightings"], share, word))
    headings = (
        "marker", ("x", "m"), ("y", "m"), ("z", "m"), ("σ of place", "mm"), ("σ of tilt", "°"), "seen",
        ("share", "%"), "",
    )  # fmt: skip
    return Table(headings, tuple(rows), digits=4)


def _filter_words(job: MapJob, told: Beside) -> str:
    filtered = job.filtered
    assert filtered is not None  # noqa: S101 - the section is there with one only
    share = 100.0 * told.covered
    return (
        "An error-state EKF whose state grows by every marker it meets, on the same sightings and IMU, told "
        "relative to the same marker. It knows each pose when its frame arrives, the smoother when the "
        f"recording ends. It rejected {filtered.rejected} sightings. Of its poses {share:.0f} % lie within "
        "their own 99.9 % of the smoother's."
    )


def _filter_table(job: MapJob, told: Beside) -> Table:
    filtered = job.filtered
    assert filtered is not None  # noqa: S101 - as above
    rows = []
    for name, sigma, seconds, frames, late in (
        ("filter", told.filter_sigma, filtered.seconds, len(filtered.frames), "none"),
        ("smoother", told.smoother_sigma, job.seconds, len(job.found.frames), "the whole recording"),
    ):
        turn, place = np.median(sigma, axis=0)
        rows.append((name, 1e3 * float(place), float(np.degrees(turn)), 1e3 * seconds / frames, late))
    headings = (
        "estimator", ("σ of place", "mm"), ("σ of orientation", "°"), ("time a frame", "ms"), "latency",
    )  # fmt: skip
    return Table(headings, tuple(rows))


def _bought(job: MapJob) -> str:
    """In words: the sigmas of the camera's place with and without the IMU."""
    assert job.vision is not None  # noqa: S101 - the section is there with one only
    alone, fused = (np.median(place_sigmas(one)) for one in (job.vision, job.found))
    return (
        f"The camera's place is known to {1e3 * fused:.1f} mm (median σ) with the IMU and to "
        f"{1e3 * alone:.1f} mm by the markers of each frame alone: {alone / fused:.1f} times better. Frames: "
        f"{len(job.found.frames)} with, {len(job.vision.frames)} without."
    )


def place_sigmas(found: Any) -> Any:
    """(F,) root of the trace of the covariance of the camera's place, m."""
    from factorlab.report.marker_map_figures import camera_covs

    return np.sqrt(np.trace(camera_covs(found)[:, 3:, 3:], axis1=1, axis2=2))


def _numbers(job: MapJob) -> dict[str, Any]:
    found = job.found
    sightings = found.sightings
    numbers: dict[str, Any] = {
        "source": job.source,
        "dictionary": job.dictionary,
        "frames": job.frames,
        "frames_placed": len(found.frames),
        "reference": int(sightings.ids[found.reference]),
        "markers": marker_numbers(found),
        "not_placed": sightings.ids[~found.placed & found.gated.sound].tolist(),
        "contradicting": sightings.ids[~found.gated.sound].tolist(),
        "sightings": {"taken": int(found.gated.taken.sum()), "rejected": int(found.gated.rejected.sum())},
        "one_plane": found.flat,
        "decided_by_motion": found.decided,
        "rms_px": pixel_rms(found),
        "variance_scale": found.scale,
        "chi2": 2.0 * found.cost,
        "iterations": found.iterations,
        "median_sigma_place_m": float(np.median(place_sigmas(found))),
        "length_m": float(
            np.linalg.norm(
                np.diff(compose(found.trajectory, found.body_T_camera)[:, 4:], axis=0), axis=1
            ).sum()
        ),
        "seconds": job.seconds,
        "imu": None,
    }
    if found.inertial is not None:
        numbers["imu"] = _imu_numbers(job)
    return numbers


def _imu_numbers(job: MapJob) -> dict[str, Any]:
    found, clock = job.found, job.clock
    assert found.biases is not None and found.velocities is not None  # noqa: S101, PT018 - there with an IMU
    sigma = np.sqrt(np.einsum("kii->ki", found.frame_covs))
    told: dict[str, Any] = {
        "offset_s": job.offset_s,
        "gravity_m_s2": found.gravity,
        "size_ratio": None if found.size is None else list(found.size),
        "accel_bias_m_s2": found.biases[-1, :3].tolist(),
        "accel_bias_sigma": sigma[-1, 9:12].tolist(),
        "gyro_bias_rad_s": found.biases[-1, 3:].tolist(),
        "gyro_bias_sigma": sigma[-1, 12:15].tolist(),
        "clock": None,
        "filter": None,
    }
    if clock is not None:
        told["clock"] = {
            "offset_s": float(clock.offset_s), "sigma_s": float(clock.sigma_s),
            "explained": float(clock.explained), "drift_s": [float(v) for v in clock.drift_s],
        }  # fmt: skip
    if job.filtered is not None and (both := beside(found, job.filtered)) is not None:
        told["filter"] = {
            "covered": both.covered, "apart_m": both.apart_m, "rejected": job.filtered.rejected,
            "median_sigma_place_m": float(np.median(both.filter_sigma[:, 1])),
            "median_sigma_place_smoother_m": float(np.median(both.smoother_sigma[:, 1])),
            "ms_a_frame": 1e3 * job.filtered.seconds / len(job.filtered.frames),
        }  # fmt: skip
    if job.vision is not None:
        told["median_sigma_place_without_m"] = float(np.median(place_sigmas(job.vision)))
    return told
