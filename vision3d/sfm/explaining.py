"""Why a picture has no place in a model, and why a set of pictures gave none."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from sequential.errors import DataError
from vision3d.sfm.view_graph import ViewGraph

__all__ = ["NoModelError", "partnered", "why_missing", "why_no_model"]

FEW_FEATURES = 50
ENOUGH = 30  # points of the model that a picture has to see to get its place
MOSTLY = 0.7
FEW_PARTNERS = 0.08


class NoModelError(DataError):
    """No two pictures gave a model to start from.

    Attributes
    ----------
    graph : which pictures were matched with which
    missing : (name, reason) of every picture
    """

    def __init__(self, message: str, graph: ViewGraph, missing: tuple[tuple[str, str], ...]) -> None:
        super().__init__(message)
        self.graph = graph
        self.missing = missing


def why_missing(graph: ViewGraph, picture: int, placed: Collection[int], others: Collection[int] = ()) -> str:
    """One phrase about a picture without a place.

    Parameters
    ----------
    placed : pictures of the model
    others : pictures of a second model that this one belongs to; empty where it belongs to none
    """
    features = int(graph.features[picture])
    if features < FEW_FEATURES:
        return f"shows too little: {features} features; it is dark, blurred or bare"
    if others:
        named = ", ".join(graph.names[k] for k in sorted(others)[:3] if k != picture)
        return f"belongs to a second model, of {len(others)} pictures ({named} …), apart from the first"
    edges = graph.edges_of(picture)
    verified = edges[graph.inliers[edges] > 0]
    partner = np.where(graph.pairs[:, 0] == picture, graph.pairs[:, 1], graph.pairs[:, 0])
    if not len(verified):
        best = edges[np.argmax(graph.matches[edges])] if len(edges) else None
        told = (
            "none of its features is matched anywhere"
            if best is None or graph.matches[best] == 0
            else f"its best pair, with {graph.names[partner[best]]}, has {graph.matches[best]} matches "
            "that no motion explains"
        )
        return f"overlaps no other picture: {told}"
    known = [edge for edge in verified if int(partner[edge]) in placed]
    if not known:
        named = ", ".join(graph.names[partner[edge]] for edge in verified[:3])
        return f"matches only pictures that have no place either: {named}"
    best = max(known, key=lambda edge: graph.inliers[edge])
    count, name = int(graph.inliers[best]), graph.names[partner[best]]
    return f"matches {name} in {count} points, too few of which have a place in space ({ENOUGH} are needed)"


def partnered(graph: ViewGraph) -> float:
    """Share of a picture's features that the best other picture shares with it, in the median picture."""
    best = np.zeros(len(graph.names))
    for (a, b), count in zip(graph.pairs, graph.inliers, strict=True):
        best[a], best[b] = max(best[a], count), max(best[b], count)
    return float(np.median(best / np.maximum(graph.features, 1))) if len(best) else 0.0


def why_no_model(graph: ViewGraph) -> str:
    """One sentence about pictures that gave no model at all."""
    verified = graph.inliers > 0
    if not len(graph.pairs) or not verified.any():
        if (graph.features < FEW_FEATURES).mean() > 0.5:
            return (
                f"the pictures show too little to follow: {int(np.median(graph.features))} features in the "
                "median picture; take sharper ones of something with texture"
            )
        k = int(np.argmax(graph.matches)) if len(graph.matches) else -1
        told = ""
        if k >= 0:
            a, b = (graph.names[one] for one in graph.pairs[k])
            told = f": the best pair, {a} and {b}, has {graph.matches[k]} matches that no motion explains"
        return f"no two pictures overlap{told}; take them so that each shows most of what the one before did"
    turned, flat = graph.share_of("pure rotation"), graph.share_of("planar")
    either = graph.share_of("flat or turned")
    if turned + flat + either > MOSTLY and turned >= flat:
        return (
            "the camera only turned, and depth shows only when it moves: every pair is explained by a "
            "rotation; walk a step between pictures"
        )
    if turned + flat + either > MOSTLY:
        return (
            "every pair is explained by one plane, which leaves depth and focal length open; take in "
            "something that is not flat, or give --camera"
        )
    best = int(graph.inliers.max())
    share = partnered(graph)
    if share < FEW_PARTNERS:
        return (
            f"only {100.0 * share:.0f} % of the features find a partner in another picture: what is seen "
            "repeats (bricks, windows, leaves), or pictures overlap too little; take in what is there once"
        )
    return (
        f"no pair is good enough to start from: the best has {best} verified matches; take pictures that "
        "overlap more, seen from places a step apart"
    )
