"""What `factorlab sfm` says: verdicts, figures, tables, and the same numbers for a machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from factorlab.report.document import Document, Section, Table
from factorlab.sfm.exports import mean_of
from factorlab.sfm.job import SfmDone
from factorlab.sfm.places import place_sigmas
from factorlab.sfm.verdicts import verdicts_of
from vision3d.sfm import Reconstruction

__all__ = ["sfm_document"]

SPACE_READ = (
    "Points in the colours of the pictures, cameras as red pyramids, numbered in the order of the table. Up "
    "is away from what lies below in most pictures."
)
ERRORS_READ = (
    "Left: lengths of the residuals, and what normal noise of the same RMS would give. Right: means over "
    "cells of the image; arrows that turn together say that the lens model does not follow."
)
TRACKS_READ = "How many pictures see a point, and the largest angle between two of its rays."
MATCHES_READ = (
    "Left: matches that the geometry of two views explains. Right: which share of all matches of the pair "
    "they are; a low one says that much of what was seen looks alike, or moved."
)
LOOPS_READ = (
    "Relative rotations, each from two pictures alone: composed round triangles, and against the model. "
    "False matches and repeated texture stand far out."
)


def sfm_document(done: SfmDone, command: str = "") -> Document:
    """Everything about a model, for the screen, `--json` and the page."""
    return Document(
        title="Structure from motion",
        lead=_lead(done),
        verdicts=verdicts_of(done),
        sections=tuple(_sections(done)),
        numbers=_numbers(done),
        command=command,
    )


def _lead(done: SfmDone) -> str:
    found, settings = done.found, done.job.settings
    if found is None:
        return f"{done.given} pictures, and no model: {done.fault}."
    camera = "a known camera" if settings.camera is not None else "cameras that the pictures calibrate"
    if settings.camera is None and len(found.cameras) == 1:
        camera = "one camera that the pictures calibrate"
    mapper = "our own mapper" if settings.mapper == "own" else f"{settings.mapper} mapper of COLMAP"
    return (
        f"{len(found)} of {done.given} pictures have their place among {len(found.points)} points, with "
        f"{camera}; {mapper}, {done.seconds:.0f} s."
    )


def _sections(done: SfmDone) -> list[Section]:
    from factorlab.report import sfm_figures as figures

    found = done.found
    sections: list[Section] = []
    if found is not None:
        sections = [
            Section("Cameras and points", figure=lambda: figures.space(found), caption=SPACE_READ),
            _picture_table(done, found),
            _camera_table(found),
            Section("Reprojection errors", figure=lambda: figures.errors(found), caption=ERRORS_READ),
            Section("Points", figure=lambda: figures.tracks(found, done.angles_rad), caption=TRACKS_READ),
        ]
    graph = done.graph
    if graph is not None and len(graph.pairs):
        sections.append(
            Section("Pairs of pictures", figure=lambda: figures.matches(graph), caption=MATCHES_READ)
        )
        loops = done.loops
        if loops is not None and len(loops):
            sections.append(
                Section("Loops", figure=lambda: figures.loops(graph, loops, found), caption=LOOPS_READ)
            )
    if done.missing:
        rows = tuple(done.missing)
        sections.append(Section("Pictures without a place", table=Table(("picture", "why"), rows)))
    return sections


def picture_rows(found: Reconstruction) -> list[dict[str, Any]]:
    """Numbers of every picture that has a place."""
    errors = found.errors_px()
    rows = []
    for view, name in enumerate(found.names):
        mine = found.image_index == view
        rows.append(
            {
                "name": name,
                "camera": int(found.camera_of[view]) + 1,
                "points": int(mine.sum()),
                "mean_error_px": mean_of(errors[mine]),
                "camera_T_world": found.cameras_T_world[view].tolist(),
                "centre": found.centres[view].tolist(),
            }
        )
    return rows


def _picture_table(done: SfmDone, found: Reconstruction) -> Section:
    features = {} if done.graph is None else dict(zip(done.graph.names, done.graph.features, strict=True))
    sigmas = place_sigmas(done)
    rows = tuple(
        (str(k + 1), row["name"], str(row["camera"]), int(features.get(row["name"], 0)) or None,
         row["points"], row["mean_error_px"], *row["centre"],
         None if sigmas is None else float(sigmas[k]))
        for k, row in enumerate(picture_rows(found))
    )  # fmt: skip
    headings = ("", "picture", "camera", "features", "points", ("error", "px"), "x", "y", "z", "σ of place")
    text = "Places are in the world of the model, whose unit is free."
    return Section("Pictures", text, Table(headings, rows), page_only=len(found) > 40)


def _camera_table(found: Reconstruction) -> Section:
    width = max(camera.count for camera in found.cameras)
    longest = max(found.cameras, key=lambda one: one.count)
    rows = tuple(
        (str(k + 1), f"{camera.size[0]}x{camera.size[1]}", camera.lens,
         *camera.parameters.tolist(), *[None] * (width - camera.count))
        for k, camera in enumerate(found.cameras)
    )  # fmt: skip
    px = ("fx", "fy", "cx", "cy")
    headings = ("camera", "size", "lens", *((n, "px") if n in px else n for n in longest.names))
    return Section("Cameras", table=Table(headings, rows, digits=6))


def _numbers(done: SfmDone) -> dict[str, Any]:
    found, graph, loops = done.found, done.graph, done.loops
    numbers: dict[str, Any] = {
        "sources": list(done.sources),
        "given": done.given,
        "registered": 0 if found is None else len(found),
        "mapper": done.job.settings.mapper,
        "seconds": done.seconds,
        "missing": [{"name": name, "reason": reason} for name, reason in done.missing],
        "fault": done.fault or None,
    }
    if found is not None:
        numbers |= {
            "points": len(found.points),
            "observations": len(found.pixels),
            "mean_reprojection_error_px": found.mean_error_px,
            "rms_px": found.rms_px,
            "sigma_px": found.sigma_px,
            "mean_track_length": float(found.track_lengths.mean()) if len(found.points) else None,
            "median_triangulation_angle_deg": float(np.degrees(np.median(done.angles_rad))),
            "cameras": [
                {
                    "lens": camera.lens,
                    "size": list(camera.size),
                    "parameters": dict(zip(camera.names, camera.parameters.tolist(), strict=True)),
                }
                for camera in found.cameras
            ],
            "pictures": picture_rows(found),
        }
    if (result := done.adjusted) is not None:
        sigmas = place_sigmas(done)
        numbers["adjustment"] = {
            "cost_colmap_px2": result.initial_cost,
            "cost_px2": result.cost,
            "route": result.route,
            "iterations": result.iterations,
            "loss": result.loss,
            "gauge": result.gauge,
            "sigma_px": result.sigma_px,
            "sigma_place": None if sigmas is None else sigmas.tolist(),
            "free": [list(names) for names in result.free],
            "intrinsics_covs": [cov.tolist() for cov in result.intrinsics_covs or ()],
        }
    if graph is not None:
        numbers["pairs"] = [
            {"a": graph.names[a], "b": graph.names[b], "matches": int(m), "inliers": int(n), "kind": kind}
            for (a, b), m, n, kind in zip(graph.pairs, graph.matches, graph.inliers, graph.kinds, strict=True)
            if m > 0
        ]
    if loops is not None and len(loops):
        degrees = np.degrees(loops.errors_rad)
        numbers["loops"] = {
            "count": len(loops),
            "median_deg": float(np.median(degrees)),
            "p95_deg": float(np.quantile(degrees, 0.95)),
            "largest_deg": float(degrees.max()),
        }
    return numbers
