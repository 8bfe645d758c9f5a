"""What the matches of two pictures mean, and what to do about it."""

from __future__ import annotations

import numpy as np

from factorlab.match.chance import CHANCE_LOG10
from factorlab.match.fitting import FEWEST, Geometry
from factorlab.match.job import CLEAR_GAIN, Matched
from factorlab.match.precision import corner_places, motion_px
from factorlab.report.document import Status, Verdict

__all__ = ["CERTAIN_RIVAL", "verdicts"]

FEW_FEATURES = 30
SHARP_PX = 1.0  # median sigma of the corners that a homography is good to
RARE = 50.0  # no test of chance is calibrated beyond
REPEATED, RIVAL, CERTAIN_RIVAL = 0.7, 0.25, 0.35  # shares; detectors find half of the copies again
STILL_PX = 0.3


def verdicts(done: Matched) -> list[Verdict]:
    """Of the features, the matches, the geometry, and everything that could mislead."""
    found = _features(done)
    if done.identical:
        meaning = "the two are the same picture, pixel by pixel"
        found.append(Verdict("pictures", "identical", None, "WARN", meaning, "give two different pictures"))
    found.append(_matches(done))
    if done.first is None or done.by_chance:
        return found + _repeated_within(done)
    found += _repeated(done)
    found += _kind(done)
    if done.geometry is not None:
        found += _precision(done, done.geometry)
    return found


def _features(done: Matched) -> list[Verdict]:
    found = []
    for picture in (done.a, done.b):
        many = len(picture.features)
        size = "x".join(map(str, picture.size))
        if many >= FEW_FEATURES:
            found.append(
                Verdict(
                    f"features of {picture.name}", many, None, "PASS", f"{picture.features.kind} in {size} px"
                )
            )
            continue
        small = min(picture.size) < 64
        meaning = (
            f"too few to match: the picture is {size} px" if small else "the picture has hardly any texture"
        )
        action = (
            "give a larger picture" if small else "more light, less blur, a textured subject, or --features"
        )
        status: Status = "FAIL" if many < 8 else "WARN"
        found.append(Verdict(f"features of {picture.name}", many, None, status, meaning, action))
    return found


def _matches(done: Matched) -> Verdict:
    """Whether the pictures share anything: more agree than chance would have agree."""
    first, tentative = done.first, done.tentative
    if first is None:
        fewest = FEWEST[done.settings.model if done.settings.model != "auto" else "homography"]
        few = tentative < fewest
        meaning = (
            f"{tentative} matches, and {fewest} are the fewest to tell a geometry from chance"
            if few
            else f"{tentative} matches determine no geometry: all lie in one place, or on one line"
        )
        return Verdict("overlap", tentative, None, "FAIL", f"no overlap found: {meaning}", _nothing_shared())
    of = f"{first.count} of {tentative} matches agree on one {_name(first.kind)}"
    if done.by_chance:
        meaning = f"no overlap found: {of}, as many as chance brings"
        if done.first is not None and first.two_view is not None:
            meaning = f"no overlap found: {first.two_view.words}"
        return Verdict("overlap", first.count, None, "FAIL", meaning, _nothing_shared())
    share = first.count / max(tentative, 1)
    odds = f"unrelated pictures would do so less than once in 10^{min(-first.chance_log10, RARE):.0f}"
    status: Status = "PASS" if share >= 0.3 and first.chance_log10 < 3 * CHANCE_LOG10 else "WARN"
    action = "" if status == "PASS" else "look at the lines drawn; --features sift --ratio 0.7 asks for more"
    return Verdict("overlap", 100.0 * share, None, status, f"{of}; {odds}", action, "%")


def _nothing_shared() -> str:
    return "do they show the same thing? take them nearer to each other, in like light; try --features sift"


def _name(kind: str) -> str:
    return {"homography": "homography", "fundamental": "fundamental matrix", "essential": "motion"}[kind]


def _kind(done: Matched) -> list[Verdict]:
    """Plane or turn against depth, where both were tried, and the words of a motion."""
    first = done.geometry or done.first
    if first is not None and first.two_view is not None:
        view = first.two_view
        status: Status = "PASS" if view.verdict == "general" else "WARN"
        return [Verdict("scene", view.verdict, None, status, view.words)]
    if done.other is None or done.first is None:
        return []
    flat = done.first.kind == "homography"
    clear = done.gain > 3.0 * CLEAR_GAIN
    if flat:
        meaning = (
            "one homography explains the matches: a plane, or a camera that turned on the spot"
            if not done.identical
            else "nothing moved"
        )
        action = "for depth or a motion, move the camera and show more than a plane"
        return [Verdict("scene", "planar or turned", None, "INFO", meaning, action)]
    meaning = "the matches have parallax: depth that no homography explains"
    action = "" if clear else "the difference is small; move the camera further for a surer geometry"
    return [Verdict("scene", "depth", None, "PASS" if clear else "WARN", meaning, action)]


def _repeated_within(done: Matched) -> list[Verdict]:
    """Why nothing matched, where the reason is that everything looks alike."""
    share = max(done.repeated)
    if share < REPEATED:
        return []
    name = (done.a if done.repeated[0] >= done.repeated[1] else done.b).name
    meaning = (
        f"of the features of {name} have a look-alike in {name} itself, so that no match of them is sure"
    )
    action = "show something that does not repeat, or the border of the pattern"
    return [Verdict("repeated texture", 100.0 * share, None, "FAIL", meaning, action, "%")]


def _repeated(done: Matched) -> list[Verdict]:
    rival = done.rival
    if rival is None or (rival.repeated < REPEATED and rival.share < RIVAL):
        return []
    if rival.share < RIVAL:
        meaning = "of the matches have a look-alike elsewhere, but no shift brings most of them to theirs"
        return [Verdict("repeated texture", 100 * rival.repeated, None, "INFO", meaning, "", "%")]
    x, y = rival.shift_px
    meaning = (
        f"ambiguous: moved by ({x:.0f}, {y:.0f}) px, {100 * rival.share:.0f} % of the matches look the same; "
        "the texture repeats, and which copy is which is a guess"
    )
    action = "show something that does not repeat, or the border of the pattern"
    status: Status = "FAIL" if rival.share > CERTAIN_RIVAL else "WARN"
    return [Verdict("repeated texture", 100 * rival.repeated, None, status, meaning, action, "%")]


def _precision(done: Matched, geometry: Geometry) -> list[Verdict]:
    found = []
    meaning = f"of {geometry.count} matches after alignment; {geometry.stopped}"
    found.append(Verdict("error of a match, σ", geometry.sigma_px, None, "INFO", meaning, unit="px"))
    moved = motion_px(done)
    if moved is not None and moved < STILL_PX and not done.identical:
        meaning = "hardly anything moved between the pictures"
        found.append(Verdict("median motion", moved, None, "WARN", meaning, "move the camera", "px"))
    if geometry.kind == "homography" and geometry.cov is not None:
        _, covs = corner_places(done, geometry)
        sigma = np.sqrt(np.trace(covs, axis1=1, axis2=2))
        worst = float(np.max(sigma))
        status: Status = "PASS" if worst < SHARP_PX else "WARN"
        meaning = (
            f"σ of the worst corner of {done.a.name} where it lies in {done.b.name}; "
            f"the median of the four is {np.median(sigma):.2g} px"
        )
        action = (
            "" if status == "PASS" else "matches far from that corner say little about it: show more of it"
        )
        found.append(Verdict("corners carried over", worst, None, status, meaning, action, "px"))
    return found
