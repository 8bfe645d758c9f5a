"""What a model of structure from motion is worth, in verdicts."""

from __future__ import annotations

import numpy as np

from factorlab.report.document import Status, Verdict
from factorlab.sfm.job import SfmDone
from factorlab.sfm.places import place_sigmas, typical_distance
from vision3d.sfm import Reconstruction

__all__ = ["verdicts_of"]

MOST = 0.7  # of the pictures that a useful model holds
GOOD_ERROR, FAIR_ERROR = 1.0, 2.0  # px
GOOD_ANGLE, FAIR_ANGLE = np.radians(4.0), np.radians(1.5)
GOOD_TRACK, GOOD_SEEN = 2.5, 50
FLAT = 0.02  # thickness over width of a cloud that is a plane
LOOP_RAD, LOOPS_WRONG = np.radians(10.0), 0.1
GOOD_FOCAL, FAIR_FOCAL = 0.01, 0.05  # standard deviation of a focal length, relative
GOOD_PLACE, FAIR_PLACE = 0.005, 0.03  # standard deviation of a place over its distance to the points
GOOD_AGREEMENT = 0.005  # of two adjustments' costs
MOST_NAMED = 6


def verdicts_of(done: SfmDone) -> tuple[Verdict, ...]:
    """In the order of a reader: pictures, those without a place, then the numbers."""
    found = done.found
    verdicts = [_registered(done), *_missing(done)]
    if found is None:
        return (*verdicts, *_turned_or_flat(done))
    verdicts += [_error(found), _tracks(found), _angles(done), *_flat(done), *_weakest(found)]
    verdicts += _partners(done)
    verdicts += [*_loops(done), *_cameras(done), *_places(done), *_adjustment(done)]
    scale = "lengths are in no unit: one known distance, or two known places, would give it"
    return (*verdicts, Verdict("scale", None, None, "INFO", scale))


def _registered(done: SfmDone) -> Verdict:
    placed = 0 if done.found is None else len(done.found)
    unit = f"of {done.given}"
    if done.found is None:
        return Verdict("pictures with a place", 0, None, "FAIL", done.fault, "", unit)
    status: Status = "PASS" if placed == done.given else "WARN" if placed >= MOST * done.given else "FAIL"
    if done.stopped:
        return Verdict(
            "pictures with a place", placed, None, "WARN", "stopped before the end", "run it again", unit
        )
    meaning = "one model holds them all" if placed == done.given else "the rest is named below"
    action = "" if status != "FAIL" else "take pictures that overlap more, a step apart"
    return Verdict("pictures with a place", placed, None, status, meaning, action, unit)


def _missing(done: SfmDone) -> list[Verdict]:
    if done.found is None and done.graph is not None:  # why there is no model is said above, for all of them
        unread = [one for one in done.missing if one[0] not in done.graph.names]
        return [Verdict("left out", name, None, "WARN", reason) for name, reason in unread[:MOST_NAMED]]
    named = [Verdict("left out", name, None, "WARN", reason) for name, reason in done.missing[:MOST_NAMED]]
    more = len(done.missing) - MOST_NAMED
    if more > 0:
        named.append(Verdict("left out", None, None, "WARN", f"{more} more: see the table of pictures"))
    return named


def _turned_or_flat(done: SfmDone) -> list[Verdict]:
    """What pairs are, where no model grew."""
    graph = done.graph
    if graph is None or not (graph.inliers > 0).any():
        return []
    verified = int((graph.inliers > 0).sum())
    kinds = {kind: graph.share_of(kind) for kind in ("general", "planar", "pure rotation", "flat or turned")}
    told = ", ".join(f"{100.0 * share:.0f} % {kind}" for kind, share in kinds.items() if share > 0.0)
    return [Verdict("pairs that match", verified, None, "INFO", told, "", f"of {len(graph.pairs)}")]


def _partners(done: SfmDone) -> list[Verdict]:
    """Texture that repeats leaves few matches, and those are not to be trusted."""
    from vision3d.sfm.explaining import FEW_PARTNERS, partnered

    if done.graph is None or (share := partnered(done.graph)) >= FEW_PARTNERS:
        return []
    meaning = "few, in the median picture: what is seen repeats, or pictures overlap little"
    action = "do not trust the model before a look at it; take in something that is there once"
    return [Verdict("features with a partner", 100.0 * share, None, "WARN", meaning, action, "%")]


def _judged(value: float, good: float, fair: float) -> Status:
    """Larger is worse."""
    return "PASS" if value <= good else "WARN" if value <= fair else "FAIL"


def _error(found: Reconstruction) -> Verdict:
    error = found.mean_error_px
    status = _judged(error, GOOD_ERROR, FAIR_ERROR)
    meaning = f"mean over points; RMS {found.rms_px:.3f} px, σ of a coordinate {found.sigma_px:.2f} px"
    action = "" if status == "PASS" else "try --lens brown4, sharper pictures, or a calibrated --camera"
    return Verdict("reprojection error", error, None, status, meaning, action, "px")


def _tracks(found: Reconstruction) -> Verdict:
    length = float(found.track_lengths.mean()) if len(found.points) else 0.0
    status: Status = "PASS" if length >= GOOD_TRACK or len(found) == 2 else "WARN"
    meaning = f"pictures see a point on the average; {len(found.points)} points, {len(found.pixels)} sights"
    return Verdict(
        "track length", length, None, status, meaning, "" if status == "PASS" else "overlap pictures more"
    )


def _angles(done: SfmDone) -> Verdict:
    """Pure rotation, and a base too short for its distance, show here."""
    angle = float(np.median(done.angles_rad)) if len(done.angles_rad) else 0.0
    status: Status = "PASS" if angle >= GOOD_ANGLE else "WARN" if angle >= FAIR_ANGLE else "FAIL"
    meaning = "median over points of the largest angle between two rays"
    if status == "FAIL":
        meaning = "the camera hardly moved for how far the points are: depth is guessed"
    action = "" if status == "PASS" else "walk further between pictures instead of turning"
    return Verdict("triangulation angle", float(np.degrees(angle)), None, status, meaning, action, "°")


def _flat(done: SfmDone) -> list[Verdict]:
    """A plane leaves the focal length open where it is not given."""
    from vision3d.sfm.geometry import flatness

    if done.found is None:
        return []
    share = flatness(done.found.points)
    if share > FLAT:
        return []
    free = done.job.settings.camera is None
    meaning = "all points lie in one plane" + (", which does not fix the focal length" if free else "")
    action = "give --camera, or take in something that stands out" if free else ""
    return [
        Verdict(
            "thickness of the cloud", 100.0 * share, None, "WARN" if free else "INFO", meaning, action, "%"
        )
    ]


def _weakest(found: Reconstruction) -> list[Verdict]:
    """Pictures that hang on few points."""
    seen = found.observations_of
    weak = [found.names[k] for k in np.flatnonzero(seen < GOOD_SEEN)]
    if not weak:
        return []
    named = ", ".join(weak[:MOST_NAMED]) + (
        f" and {len(weak) - MOST_NAMED} more" if len(weak) > MOST_NAMED else ""
    )
    return [
        Verdict(
            "fewest points in a picture", int(seen.min()), None, "WARN", f"below {GOOD_SEEN}: {named}",
            "their poses are weak; add pictures between them and their neighbours",
        )
    ]  # fmt: skip


def _loops(done: SfmDone) -> list[Verdict]:
    """Rotations of three pairs that do not close: false matches, as repeated texture makes them."""
    loops = done.loops
    if loops is None or not len(loops):
        return []
    wrong = float(np.mean(loops.errors_rad > LOOP_RAD))
    status: Status = "PASS" if wrong <= LOOPS_WRONG else "WARN"
    meaning = f"median over {len(loops)} triangles of pairs; {100.0 * wrong:.0f} % above 10°"
    action = (
        "" if status == "PASS" else "some pairs match what only looks alike: repeated texture, or few points"
    )
    value = float(np.degrees(np.median(loops.errors_rad)))
    return [Verdict("rotation round a loop", value, None, status, meaning, action, "°")]


def _cameras(done: SfmDone) -> list[Verdict]:
    """Focal lengths, and how EXIF or the file had them."""
    found = done.found
    if found is None:
        return []
    verdicts = []
    for k, camera in enumerate(found.cameras):
        metric = "focal length" if len(found.cameras) == 1 else f"focal length of camera {k + 1}"
        value = float(camera.intrinsics[:2].mean())
        if done.job.settings.camera is not None:
            verdicts.append(Verdict(metric, value, None, "INFO", "as given", unit="px"))
            continue
        across = 2.0 * np.degrees(np.arctan(0.5 * camera.size[0] / value))
        meaning = f"from the pictures ({camera.lens}); they see {across:.0f}° across"
        band: tuple[float, float] | None = None
        status: Status = "INFO"
        action = ""
        if (sigma := _focal_sigma(done, k)) is not None:
            band = (value - 1.96 * sigma, value + 1.96 * sigma)
            status = _judged(sigma / value, GOOD_FOCAL, FAIR_FOCAL)
            action = (
                ""
                if status == "PASS"
                else "these pictures do not tell it: give --camera, or take some from aside"
            )
        verdicts.append(Verdict(metric, value, band, status, meaning, action, "px"))
    return verdicts if len(verdicts) <= MOST_NAMED else verdicts[:MOST_NAMED]


def _focal_sigma(done: SfmDone, camera: int) -> float | None:
    """Standard deviation of a camera's focal length, px; None where it was not computed."""
    result = done.adjusted
    if result is None or result.intrinsics_covs is None:
        return None
    names = result.free[camera]
    rows = [k for k, name in enumerate(names) if name in {"f", "fx"}]
    return float(np.sqrt(result.intrinsics_covs[camera][rows[0], rows[0]])) if rows else None


def _places(done: SfmDone) -> list[Verdict]:
    """How sure the least sure camera is of its place, against its distance to what it sees."""
    found, sigmas = done.found, place_sigmas(done)
    if found is None or sigmas is None:
        return []
    share = sigmas / typical_distance(found)
    worst = int(np.argmax(share))
    status = _judged(float(share[worst]), GOOD_PLACE, FAIR_PLACE)
    meaning = f"largest σ, of {found.names[worst]}, over the distance of the points; median {_ppm(share)}"
    action = "" if status == "PASS" else "add pictures between it and its neighbours"
    return [Verdict("place of a camera", 1e6 * float(share[worst]), None, status, meaning, action, "ppm")]


def _ppm(share: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return f"{1e6 * float(np.median(share)):.3g} ppm"


def _adjustment(done: SfmDone) -> list[Verdict]:
    """Our own bundle adjustment against COLMAP's, on the same observations and loss."""
    result, why = done.adjusted, done.unadjusted
    if result is None:
        return [Verdict("our adjustment", None, None, "WARN", why, "no covariances are given")] if why else []
    if why:
        return [Verdict("our adjustment", None, None, "WARN", why, "look at the band of the focal length")]
    change = result.cost / result.initial_cost - 1.0
    status: Status = "PASS" if abs(change) <= GOOD_AGREEMENT else "WARN"
    meaning = f"change of the mapper's cost by our own, {result.iterations} steps ({result.route})"
    action = "" if status == "PASS" else "the two disagree about the minimum; see the residuals"
    return [Verdict("our adjustment", 100.0 * change, None, status, meaning, action, "%")]
