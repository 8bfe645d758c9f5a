"""The report on a cloud: is it dense and clean enough, did it fit, which planes are in it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from factorlab.cloud.job import CloudJob
from factorlab.report.document import Cell, Document, Section, Table, Verdict

__all__ = ["cloud_document"]

MANY_STRAGGLERS = 5.0  # per cent
LITTLE_OVERLAP = 30.0  # per cent


def cloud_document(job: CloudJob, command: str = "") -> Document:
    """Verdicts, pictures, planes, numbers."""
    size = " x ".join(f"{side:.3g}" for side in job.high - job.low)
    lead = (
        f"{job.name}: {len(job.read.points)} points"
        + (f", {len(job.points)} after the work" if len(job.points) != len(job.read.points) else "")
        + f"; 99 % of them in a box of {size} m, {1000 * job.spacing_m:.3g} mm apart."
    )
    return Document(
        title=f"The cloud {job.name}",
        lead=lead,
        verdicts=tuple(_verdicts(job)),
        sections=tuple(_sections(job)),
        numbers=_numbers(job),
        command=command,
        conclusion=_conclusion(job),
    )


def _conclusion(job: CloudJob) -> str:
    said = [f"{len(job.points)} points, {1000 * job.spacing_m:.3g} mm apart"]
    if job.registration is not None:
        found = job.registration
        said.append(
            f"laid on the other cloud within {1000 * found.rmse_m:.3g} mm, {100 * found.overlap:.0f} % of it"
        )
    if job.settings.planes:
        share = sum(len(plane.inliers) for plane in job.planes) / len(job.points)
        said.append(f"{len(job.planes)} planes hold {100 * share:.0f} % of it")
    return "; ".join(said) + "."


def _verdicts(job: CloudJob) -> list[Verdict]:
    verdicts = []
    if job.dropped_nonfinite:
        verdicts.append(
            Verdict(
                "points that are no numbers", job.dropped_nonfinite, None, "WARN",
                "NaN or infinity in the file: left out", "look at the program that wrote it",
            )
        )  # fmt: skip
    stragglers = 100.0 * job.stragglers
    many = stragglers > MANY_STRAGGLERS and not job.settings.clean
    verdicts.append(
        Verdict(
            "stragglers", stragglers, (0.0, MANY_STRAGGLERS), "WARN" if many else "PASS",
            "points far from all others" + (", removed" if job.settings.clean else ""),
            "remove them with --clean" if many else "", "%",
        )
    )  # fmt: skip
    if job.registration is not None:
        verdicts += _of_registration(job)
    if job.settings.planes:
        found = len(job.planes)
        verdicts.append(
            Verdict(
                "planes", found, None, "PASS" if found else "FAIL",
                "flat parts of the cloud" if found else "no plane holds enough points",
                "" if found else "raise --plane-distance to the noise of the points",
            )
        )  # fmt: skip
    return verdicts


def _of_registration(job: CloudJob) -> list[Verdict]:
    found = job.registration
    assert found is not None  # noqa: S101 - the caller has looked
    free, overlap = len(found.free), 100.0 * found.overlap
    return [
        Verdict(
            "registration", found.iterations, None, "PASS" if found.converged else "FAIL",
            found.stopped, "" if found.converged else "start nearer, or thin both clouds first", "rounds",
        ),
        Verdict(
            "free directions", free, (0.0, 0.0), "PASS" if not free else "FAIL",
            "the shapes hold each other in place" if not free else "the clouds slide on each other",
            "" if not free else "take parts with corners, or fix those directions otherwise",
        ),
        Verdict(
            "overlap", overlap, (LITTLE_OVERLAP, 100.0), "PASS" if overlap >= LITTLE_OVERLAP else "WARN",
            "points that found a partner",
            "" if overlap >= LITTLE_OVERLAP else "check that both show the same place", "%",
        ),
    ]  # fmt: skip


def _sections(job: CloudJob) -> list[Section]:
    from factorlab.report.cloud_figures import cloud_views, registration_views

    sections = [
        Section(
            "What it looks like",
            figure=partial(cloud_views, job),
            caption="y is down and z forward, as a camera sees; edges are darkened where depth jumps.",
        )
    ]
    if job.registration is not None:
        sections.append(
            Section(
                "On the other cloud",
                table=_pose_table(job),
                figure=partial(registration_views, job),
                caption="The other cloud in grey, this one in orange: before left, after right.",
            )
        )
    if job.planes:
        sections.append(Section("Planes", "n · p + d = 0, the largest first.", _plane_table(job)))
    return sections


def _pose_table(job: CloudJob) -> Table:
    found = job.registration
    assert found is not None  # noqa: S101 - the caller has looked
    turn = 2.0 * np.degrees(
        np.arctan2(np.linalg.norm(found.target_T_source[1:4]), abs(found.target_T_source[0]))
    )
    rows: list[tuple[Cell, ...]] = [
        ("turn", float(turn), "°"),
        ("shift", _row(found.target_T_source[4:]), "m"),
    ]
    if found.cov is not None:
        sigma = np.sqrt(np.diag(found.cov))
        rows += [
            ("σ of the turn", _row(np.degrees(sigma[:3])), "°"),
            ("σ of the shift", _row(sigma[3:]), "m"),
        ]
    rows.append(("distance of pairs", found.rmse_m, "m"))
    return Table(("", "x, y, z", "unit"), tuple(rows))


def _plane_table(job: CloudJob) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for k, plane in enumerate(job.planes, 1):
        tilt = float(np.degrees(plane.tilt_std_rad))
        rows.append((k, len(plane.inliers), _row(plane.normal), plane.offset_m, 1000.0 * plane.rms_m, tilt))
    return Table(
        ("", "points", "normal n", ("offset d", "m"), ("rms", "mm"), ("σ of the tilt", "°")), tuple(rows)
    )


def _row(values: Any) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _numbers(job: CloudJob) -> dict[str, Any]:
    numbers: dict[str, Any] = {
        "points_read": len(job.read.points),
        "points": len(job.points),
        "box_m": [job.low.tolist(), job.high.tolist()],
        "spacing_m": job.spacing_m,
        "flatness": job.flatness,
        "stragglers": job.stragglers,
    }
    if (found := job.registration) is not None:
        numbers["registration"] = {
            "target_T_source": found.target_T_source.tolist(),
            "cov": None if found.cov is None else found.cov.tolist(),
            "rmse_m": found.rmse_m,
            "overlap": found.overlap,
            "iterations": found.iterations,
            "converged": found.converged,
            "free": found.free.tolist(),
        }
    if job.settings.planes:
        numbers["planes"] = [
            {
                "normal": plane.normal.tolist(),
                "offset_m": plane.offset_m,
                "points": len(plane.inliers),
                "rms_m": plane.rms_m,
                "tilt_std_deg": float(np.degrees(plane.tilt_std_rad)),
            }
            for plane in job.planes
        ]
    return numbers
