"""Where a pose graph begins: LAGO in the plane, chordal relaxation, a spanning tree; all NumPy and SciPy."""

from sequential.slam.initial.chordal import chordal_poses, chordal_rotations
from sequential.slam.initial.lago import lago_headings, lago_poses
from sequential.slam.initial.links import Links, links_of
from sequential.slam.initial.start import METHODS, initial_poses
from sequential.slam.initial.tree import spanning_tree, tree_poses

__all__ = [
    "METHODS",
    "Links",
    "chordal_poses",
    "chordal_rotations",
    "initial_poses",
    "lago_headings",
    "lago_poses",
    "links_of",
    "spanning_tree",
    "tree_poses",
]
