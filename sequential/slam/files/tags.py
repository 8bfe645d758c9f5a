"""The tags of graph files: what stands after each, and in what order its weights are written.

g2o: Kuemmerle, Grisetti, Strasdat, Konolige, Burgard 2011, "g2o: a general framework for graph optimization".
TORO: Grisetti, Stachniss, Grzonka, Burgard 2007; its `EDGE2` weights are written xx xy yy tt xt yt, the g2o
tags' along the rows of the upper triangle, and some files of the older tags follow g2o's order instead.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["KNOWN", "Tag"]


@dataclass(frozen=True, slots=True)
class Tag:
    """One tag.

    Parameters
    ----------
    does : "vertex", "point", "between", "displacement", "sighting", "offset" or "fix"
    axes : 2, 3, or 0 where it says nothing about it
    ids : whole numbers that come first
    numbers : of the value or the measurement
    weights : of the upper triangle, 0 where there are none
    angles : a pose in space as roll, pitch and yaw, not as a quaternion
    optional : the weights may be left out: then they are ones
    as_cov : the weights are a covariance
    """

    does: str
    axes: int
    ids: int
    numbers: int = 0
    weights: int = 0
    angles: bool = False
    optional: bool = False
    as_cov: bool = False

    def lengths(self) -> tuple[int, ...]:
        """How many words may stand after the tag."""
        whole = self.ids + self.numbers + self.weights
        return (whole, whole - self.weights) if self.optional else (whole,)


KNOWN = {
    "VERTEX_SE2": Tag("vertex", 2, 1, 3),
    "VERTEX2": Tag("vertex", 2, 1, 3),
    "VERTEX": Tag("vertex", 2, 1, 3),
    "VERTEX_SE3:QUAT": Tag("vertex", 3, 1, 7),
    "VERTEX3": Tag("vertex", 3, 1, 6, angles=True),
    "VERTEX_XY": Tag("point", 2, 1, 2),
    "VERTEX_TRACKXYZ": Tag("point", 3, 1, 3),
    "EDGE_SE2": Tag("between", 2, 2, 3, 6),
    "EDGE2": Tag("between", 2, 2, 3, 6, optional=True),
    "EDGE": Tag("between", 2, 2, 3, 6, optional=True),
    "ODOMETRY": Tag("between", 2, 2, 3, 6, as_cov=True),
    "EDGE_SE3:QUAT": Tag("between", 3, 2, 7, 21),
    "EDGE3": Tag("between", 3, 2, 6, 21, angles=True, optional=True),
    "EDGE_SE2_XY": Tag("displacement", 2, 2, 2, 3),
    "LANDMARK2": Tag("displacement", 2, 2, 2, 3),
    "LANDMARK": Tag("displacement", 2, 2, 2, 3, as_cov=True),
    "EDGE_SE3_TRACKXYZ": Tag("displacement", 3, 3, 3, 6),
    "BR": Tag("sighting", 2, 2, 4),
    "PARAMS_SE3OFFSET": Tag("offset", 3, 1, 7),
    "FIX": Tag("fix", 0, 1),
}
"""Every tag that is understood.  `BR` holds bearing, range and their two standard deviations."""
