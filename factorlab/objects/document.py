"""The report on a picture's objects: can the answer be trusted, and what to change if not."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from factorlab.objects.found import Found
from factorlab.report.document import Cell, Document, Section, Table, Verdict

__all__ = ["objects_document"]

SHOWN = 30  # rows of the table on the page
BARELY = 0.05  # of score above the limit


def objects_document(found: Found, command: str = "") -> Document:
    """Verdicts, picture, table and numbers."""
    count = len(found.items)
    said = f"{count} object{'' if count == 1 else 's'}"
    height, width = found.image.shape[:2]
    by = f"the colour {found.colour}" if found.way == "colour" else f"the network {found.facts['model']}"
    lead = f"{found.picture}, {width}x{height} pixels, by {by}."
    conclusion = f"{said} in {found.picture}"
    if count:
        first = found.items[0]
        which = "surest" if found.way == "boxes" else "largest"
        conclusion += f"; the {which}, {first.name}, is at ({first.centre[0]:.1f}, {first.centre[1]:.1f}) px"
    return Document(
        title=f"Objects in {found.picture}",
        lead=lead,
        verdicts=tuple(_verdicts(found)),
        sections=tuple(_sections(found)),
        numbers=_numbers(found),
        command=command,
        conclusion=conclusion + ".",
    )


def _verdicts(found: Found) -> list[Verdict]:
    count = len(found.items)
    if found.way == "colour":
        nothing = "learn the range from a piece of the object: --sample LEFT,TOP,WIDTH,HEIGHT"
    else:
        nothing = "lower --confidence, and check --layout and the colours' order (--bgr)"
    verdicts = [
        Verdict(
            "objects found",
            count,
            None,
            "PASS" if count else "FAIL",
            "what the picture shows" if count else "nothing was found",
            "" if count else nothing,
        )
    ]
    cut = sum(one.cut for one in found.items)
    if cut:
        verdicts.append(
            Verdict(
                "cut by the edge",
                cut,
                None,
                "WARN",
                "their centre is that of the part that is seen",
                "move the camera, or leave them out",
            )
        )
    if found.way == "colour":
        return verdicts + _of_colour(found)
    if found.way == "boxes":
        verdicts += _of_boxes(found)
    if not found.facts["named"]:
        verdicts.append(
            Verdict(
                "names of classes",
                "none",
                None,
                "INFO",
                "the file brings none: classes are numbers",
                "give them with --names FILE.txt, one a line",
            )
        )
    if found.facts["layout_guessed"]:
        verdicts.append(
            Verdict(
                "layout",
                found.facts["layout"],
                None,
                "INFO",
                "guessed from the shapes of the outputs",
                "name it with --layout where boxes lie wrong",
            )
        )
    return verdicts


def _of_colour(found: Found) -> list[Verdict]:
    specks = 100 * found.specks
    much = specks > 20
    what = (
        "much else has the colour" if found.items else "what has the colour is in pieces that are too small"
    )
    verdicts = [
        Verdict(
            "pixels of the colour that are no object",
            specks,
            (0.0, 20.0),
            "WARN" if much else "PASS",
            what if much else "specks that cleaning removed",
            "narrow the range, learn it with --sample, or lower --min-area" if much else "",
            "%",
        )
    ]
    if not np.isnan(found.hue):
        cutting = found.hue > 0.2
        verdicts.append(
            Verdict(
                "change when the ends of hue move by 3",
                100 * found.hue,
                (0.0, 20.0),
                "WARN" if cutting else "PASS",
                "an end of hue cuts through a colour that is there"
                if cutting
                else "hue ends between colours",
                "move the end away, or learn the range with --sample" if cutting else "",
                "%",
            )
        )
    if (light := found.light) is not None:
        for word, value in (("weaker", light.darker), ("stronger", light.brighter)):
            share = 100 * value
            held = share >= 80
            verdicts.append(
                Verdict(
                    f"largest object kept under {word} light",
                    share,
                    (80.0, 100.0),
                    "PASS" if held else "WARN",
                    f"with {light.factor if word == 'weaker' else 1 / light.factor:.2g} times the light"
                    + ("" if held else ": the range was set under this lamp only"),
                    "" if held else _wider(word),
                    "%",
                )
            )
    return verdicts


def _wider(word: str) -> str:
    if word == "weaker":
        return "lower the least value (V), or fix the exposure"
    return "raise the largest value and lower the least saturation, or fix the exposure"


def _of_boxes(found: Found) -> list[Verdict]:
    least = found.limits["least_score"]
    near = sum(one.score is not None and one.score < least + BARELY for one in found.items)
    if not near:
        return []
    return [
        Verdict(
            "barely above the limit",
            near,
            None,
            "WARN",
            f"scores from {least:g} to {least + BARELY:g}: a little less light and they are gone",
            "look at each, and move --confidence away from them",
        )
    ]


def _sections(found: Found) -> list[Section]:
    from factorlab.report.object_figures import picture_with_objects

    sections = [
        Section(
            "Where they are",
            figure=partial(picture_with_objects, found),
            caption="Numbers are those of the table; a cross is the centre"
            + (
                "; on the right what has the colour and is left after cleaning."
                if found.way == "colour"
                else "; on the right pixels of a class."
                if found.way == "map"
                else "; on the right the pixels of objects."
                if found.mask is not None
                else "."
            ),
        )
    ]
    if found.items:
        sections.append(Section("Objects", _limits(found), _table(found)))
    if shares := found.facts.get("shares"):
        rows = tuple((name, 100 * share) for name, share in shares.items())
        sections.append(Section("Classes of pixels", table=Table(("class", ("share", "%")), rows)))
    return sections


def _limits(found: Found) -> str:
    more = len(found.items) - SHOWN
    said = ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in found.limits.items())
    return f"Limits: {said}." + (f"  {more} more are in objects.csv." if more > 0 else "")


def _table(found: Found) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for k, one in enumerate(found.items[:SHOWN], 1):
        box = " ".join(f"{v:.0f}" for v in one.box)
        x, y = (f"{v:.1f}" for v in one.centre)
        rows.append((k, one.name, one.score, f"{x}, {y}", box, one.area, "cut" if one.cut else ""))
    headings = (
        "",
        "name",
        "score",
        ("centre x, y", "px"),
        ("left top width height", "px"),
        ("area", "px"),
        "edge",
    )
    empty = [all(row[c] in (None, "") for row in rows) for c in range(len(headings))]
    kept = [c for c in range(len(headings)) if not empty[c]]
    return Table(
        tuple(headings[c] for c in kept), tuple(tuple(row[c] for c in kept) for row in rows), digits=4
    )


def _numbers(found: Found) -> dict[str, Any]:
    """Everything under plain names."""
    numbers: dict[str, Any] = {
        "picture": {"name": found.picture, "width": found.image.shape[1], "height": found.image.shape[0]},
        "way": found.way,
        "limits": dict(found.limits),
        "objects": [
            {
                "name": one.name,
                "score": one.score,
                "centre_px": list(one.centre),
                "box_px": list(one.box),
                "area_px": one.area,
                "cut": one.cut,
            }
            for one in found.items
        ],
    }
    if found.way == "colour":
        numbers["colour"] = str(found.colour)
        numbers["specks"] = found.specks
        numbers["hue_change"] = found.hue
        numbers["mask_share"] = float(np.mean(found.mask > 0)) if found.mask is not None else None
        if found.light is not None:
            numbers["light"] = {name: getattr(found.light, name) for name in ("darker", "brighter", "factor")}
    else:
        numbers["network"] = dict(found.facts)
    return numbers
